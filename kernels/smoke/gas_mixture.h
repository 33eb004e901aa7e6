// The gas of the cavity as a mixture: carbon dioxide at rest, and in it heat, steam, air and
// droplets of water.
//
// Ideal gases of one pressure p and one molar heat capacity c. By volume, heat over the resting gas
// is n c (T - T0) with n = p / (R T); by h = 1 - T0 / T, that is n0 c T0 h. So h is heat, as a
// share of n0 c T0, and n = n0 (1 - h) is linear in it. Carbon dioxide makes up what vapour v and
// air a [kg/m3] leave of n, and droplets l weigh besides:
//   rho0 - rho = rho0 h + v (M / Mv - 1) + a (M / Ma - 1) - l.
// Exact for any temperature. What is given to gas makes it larger by h + moles / n0.
#pragma once

#include "kernels/base/fields.h"

namespace viscera {

/// Marks: [R] recalled.
namespace gas {
inline constexpr double kGasConstant = 8.314462618;  ///< [J/(mol K)]
inline constexpr double kMolarMass = 0.04401;        ///< of carbon dioxide [kg/mol]
inline constexpr double kWaterMolarMass = 0.018015;  ///< [kg/mol]
inline constexpr double kAirMolarMass = 0.028965;    ///< [kg/mol]
inline constexpr double kAtmosphere = 101325.0;      ///< [Pa]
/// Of carbon dioxide at 310 K [J/(mol K)]. Steam's is a tenth less, air's a quarter.      [R]
inline constexpr double kMolarHeat = 37.6;
inline constexpr double kViscosity = 1.54e-5;    ///< of CO2 at 310 K [Pa s]       [R]
inline constexpr double kConductivity = 0.0174;  ///< of CO2 at 310 K [W/(m K)]    [R]
/// Of vapour in CO2 at 310 K and one atmosphere [m2/s].                                  [R]
inline constexpr double kVapourDiffusivity = 2.0e-5;
/// Of water at 37 C [J/kg]; with the heat of steam and of water, 2.26e6 at 100 C.        [R]
inline constexpr double kLatentHeat = 2.41e6;
inline constexpr double kWaterDensity = 993.0;  ///< at 37 C [kg/m3]              [R]
}  // namespace gas

/// By volume of gas [kg/m3], [J/m3].
struct GasContent {
  double heat = 0.0;      ///< over the resting gas, what is in droplets as vapour aside
  double vapour = 0.0;    ///< over what the resting gas holds
  double droplets = 0.0;  ///< of condensed steam
  double air = 0.0;
};

/// Carbon dioxide at rest, from which everything else differs.
struct GasMixture {
  double pressure = gas::kAtmosphere + 1600.0;  ///< absolute [Pa]
  double temperature = 310.15;                  ///< T0 [K]
  double humidity = 0.0;                        ///< relative, of the resting gas
  /// Nuclei on which vapour condenses: at its source smoke was counted at over 1e5 in a cubic
  /// centimetre [BruskeHohlfeld2008] [1/m3].
  double nuclei = 1e11;

  double moles() const { return pressure / (gas::kGasConstant * temperature); }  ///< n0 [mol/m3]
  double density() const { return moles() * gas::kMolarMass; }                   ///< rho0 [kg/m3]
  /// n0 c, [J/(m3 K)].
  double heat_capacity() const { return moles() * gas::kMolarHeat; }
  /// n0 c T0: gas with that much heat by volume would have no density [J/m3].
  double full_heat() const { return heat_capacity() * temperature; }
  double heat_diffusivity() const { return gas::kConductivity / heat_capacity(); }  ///< [m2/s]
  double vapour_diffusivity() const {                                               ///< [m2/s]
    return gas::kVapourDiffusivity * gas::kAtmosphere / pressure;
  }
  /// Of heat over vapour: less than one, vapour spreads faster in carbon dioxide.
  double lewis() const { return heat_diffusivity() / vapour_diffusivity(); }

  /// Heat by volume of gas that is warmer by `excess` [K].
  double heat_of(double excess) const { return full_heat() * excess / (temperature + excess); }
  /// [K]; the inverse of heat_of.
  double excess_of(double heat) const;
  /// rho0 - rho [kg/m3].
  double lack(const GasContent& content) const;
  /// What a mass of vapour (or of gas of another molar mass) at rest takes up [m3/kg].
  double volume_of(double molar_mass) const { return 1.0 / (moles() * molar_mass); }
  /// Vapour by volume at saturation [kg/m3]; its pressure by [Buck1981].
  double saturation(double kelvin) const;
  double resting_vapour() const { return humidity * saturation(temperature); }  ///< [kg/m3]

  /// Diameter of droplets that hold so much water by volume of gas [kg/m3]: the nuclei share it; at
  /// least that of a nucleus [m].
  double droplet_diameter(double load) const;

  /// What condenses in dt [s] (negative: evaporates) [kg/m3]. Vapour moves to droplets, or from
  /// them, at the rate of diffusion 2 pi N d D about droplets of one diameter d, N the nuclei; a
  /// droplet gives off latent heat by conduction, which slows it by 1 + L / (c Le) d(rho_s)/dT. It
  /// ends where the gas is saturated or no droplet is left.
  double condenses(const GasContent& content, double dt) const;
  /// What condensing that much changes [m3 by m3]: it warms, and there is less gas.
  double swelling(double condensed) const {
    return condensed * (gas::kLatentHeat / full_heat() - volume_of(gas::kWaterMolarMass));
  }
};

/// What leaves tissue or a nozzle: gas that is given to the cavity's.
struct GasGift {
  double volume = 0.0;  ///< that it takes up [m3]
  double heat = 0.0;    ///< [J]
  double vapour = 0.0;  ///< [kg]

  /// Of steam at `kelvin`.
  static GasGift steam(const GasMixture& mixture, double mass, double kelvin);
  /// Of fumes, or other gas as heavy as carbon dioxide, at `kelvin` [kg].
  static GasGift fumes(const GasMixture& mixture, double mass, double kelvin);
  /// Of heat alone [J].
  static GasGift warmth(const GasMixture& mixture, double heat);

  GasGift& operator+=(const GasGift& other);
  GasGift& operator*=(double share);
  static constexpr auto fields() {
    return std::tuple(field("volume", &GasGift::volume), field("heat", &GasGift::heat),
                      field("vapour", &GasGift::vapour));
  }
};
static_assert(fields_cover<GasGift>());

}  // namespace viscera
