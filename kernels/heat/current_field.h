// How current spreads from a disc into tissue whose conductivity varies.
#pragma once

#include <array>
#include <vector>

#include "kernels/heat/bioheat.h"
#include "kernels/heat/disc_field.h"

namespace viscera {

/// Where conductivity varies, the potential is still taken as a function of DiscField's u, the one
/// that dissipates least (Thomson's principle; so the resistance is never overrated by much, and is
/// exact for uniform tissue and for what varies from shell to shell, as drying under a contact
/// does). With S(u) the conductance of a shell, sum of sigma |grad u|^2 over it, current I heats a
/// place by sigma |grad u|^2 (I / S)^2: within a shell current goes round what is dry, between
/// shells it can't.
///
/// Tissue may boil dry within a frame. Within a step the field therefore follows what each voxel
/// has taken, as if no heat left it until the step's end: see lasts() and follow().
class CurrentField {
 public:
  /// Of a disc at `point` facing into the tissue against `outward`, during a step of `dt` [s];
  /// warms bricks up to a few radii away. Dried layers thinner in all than `gap` [m] are crossed by
  /// sparks.
  CurrentField(Bioheat& heat, const Vec3& point, const Vec3& outward, double radius, double gap,
               double dt);

  double near_resistance() const {
    return near_;
  }  ///< of the tissue that is heated, with what crosses its dried layers [Ohm]
  double far_resistance() const { return far_; }  ///< of the organ beyond, at rest [Ohm]
  bool any_tissue() const { return !voxels_.state.empty(); }

  /// For how long `current` [A], and `sparks` [W] that end on the spot, may go on before some voxel
  /// isn't what it was [s].
  double lasts(double current, double sparks = 0.0) const;

  struct Heating {
    double tissue = 0.0;  ///< [J]
    double sparks = 0.0;  ///< of that, what sparks from the gap gave it [J]
    double gas = 0.0;     ///< what no tissue is left to take: it goes off with steam and fumes [J]
  };
  /// What these make of `time` [s] of the step. Where the tissue has dried, sparks that cross it
  /// heat it as part of what current does; those from the gap heat the outermost voxels under the
  /// disc, evenly.
  Heating heat_with(Bioheat& heat, double current, double time, double sparks = 0.0);
  /// Conductivities and resistance after what the tissue has taken.
  void follow(const ThermalTissue& tissue);

 private:
  using Shares = DiscField::Shares;
  static constexpr int kMostShells = DiscField::kMostShells;
  struct Voxel {
    HeatBrick* brick;
    int index;
    float fraction;                ///< of it is tissue
    double kelvin, water;          ///< as the step began
    double capacity;               ///< [J/K]
    double to_boil, latent, room;  ///< heat until it boils, of its water, until kHottest [J]
    double taken;                  ///< of the step's heat so far [J]
    double struck;                 ///< share of the sparks that end here
  };
  struct Voxels {
    std::vector<Voxel> state;
    std::vector<Shares> shares;
  };

  Voxels collect(HeatBrick& brick, const Bioheat& heat) const;
  double struck_share(const Vec3& centre) const;
  void conduct();

  DiscField disc_;
  Vec3 point_, outward_;
  double voxel_;
  double gap_, dt_, whole_, bite_;
  Voxels voxels_;
  std::vector<double> conductivity_, if_wet_;      ///< [S/m]
  std::vector<double> drive_;                      ///< heat by a unit of current squared [Ohm]
  double near_ = 0.0, far_ = 0.0, outside_ = 0.0;  ///< outside_: of near_, not in tissue [Ohm]
};

}  // namespace viscera
