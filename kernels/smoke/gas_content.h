// What the gas of a grid holds besides itself, heat, vapour, droplets and air, and how it goes from
// cell to cell.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/smoke/gas_layout.h"
#include "kernels/smoke/gas_mixture.h"

namespace viscera {

/// Of GasContent, as arrays have it.
enum GasKind : std::size_t { kGasHeat, kGasVapour, kGasDroplets, kGasAir, kGasKinds };

/// Where what the gas was given has gone. Heat counts vapour as vapour: droplets have given theirs
/// off, and take it along. Water is vapour and droplets.
///   given = stored (GasContents::stored) + to_walls + out, for heat; for water and air without
/// walls. `out`: through evacuators, leaks and open sides, and into what became solid.
struct GasBook {
  double heat_given = 0.0, heat_to_walls = 0.0, heat_out = 0.0;  ///< [J]
  double water_given = 0.0, water_out = 0.0;                     ///< [kg]
  double air_given = 0.0, air_out = 0.0;                         ///< [kg]

  static constexpr auto fields() {
    using B = GasBook;
    return std::tuple(field("heat_given", &B::heat_given),
                      field("heat_to_walls", &B::heat_to_walls), field("heat_out", &B::heat_out),
                      field("water_given", &B::water_given), field("water_out", &B::water_out),
                      field("air_given", &B::air_given), field("air_out", &B::air_out));
  }
};
static_assert(fields_cover<GasBook>());

/// By volume in every cell (GasContent's units); 0 in solids and ghosts.
struct GasContents {
  std::array<std::vector<float>, kGasKinds> of;  ///< empty: none of that kind has come yet
  GasBook book;

  bool any() const;
  bool has(GasKind kind) const { return !of[kind].empty(); }
  GasContent at(std::size_t cell) const;
  /// What all cells hold: [J], [kg].
  GasContent stored(const GasLayout& layout, double cell_volume) const;

  static constexpr auto fields() {
    return std::tuple(field("of", &GasContents::of), field("book", &GasContents::book));
  }
};
static_assert(fields_cover<GasContents>());

/// The box of cells [low, high] that hold something; empty: low > high.
struct GasBox {
  std::array<int, 3> low{0, 0, 0}, high{-1, -1, -1};

  bool empty() const { return low[0] > high[0]; }
  GasBox grown(int cells, const std::array<int, 3>& n) const;
};

/// Carries contents through the faces of a grid: in each explicit substep by the flow, with van
/// Leer's limited second-order values [VanLeer1974], and by diffusion. Conserves each kind to
/// rounding, and makes nothing negative and no new extremes where gas doesn't pile up. Only the box
/// of cells that hold more than can be felt is worked on, with room around it. Same digits for any
/// number of threads.
class GasTransport {
 public:
  /// In at most so many substeps. Gas that is too fast for them carries less than it would.
  static constexpr int kMostSubsteps = 12;

  struct Flow {
    const GasFaces* velocity = nullptr;           ///< [m/s]
    const GasFaces* passes = nullptr;             ///< > 0 where gas passes
    std::span<const std::uint8_t> solid;          ///< cells
    std::span<const float> sinks;                 ///< share of a cell's gas drawn off [1/s]
    std::span<const float> walls;                 ///< sum of 2 / h^2 over a cell's walls [1/m2]
    Vec3 spacing = Vec3::Ones();                  ///< [m]
    std::array<double, kGasKinds> diffusivity{};  ///< [m2/s]
  };
  /// So much of each kind can be felt; less, at the box's edge, waits there.
  using Least = std::array<float, kGasKinds>;

  struct Outcome {
    int substeps = 0;
    std::size_t slowed = 0;  ///< cells whose gas was too fast
  };

  explicit GasTransport(const GasLayout& layout = {}) : layout_(layout) {}

  /// Advances by dt [s]. Walls, at the resting temperature, take heat: what they took of each cell
  /// is added to `to_walls` [J/m3]. Fills in what the book of the contents says of walls and sinks.
  Outcome move(const Flow& flow, const Least& least, double dt, GasContents& contents,
               std::span<float> to_walls);
  /// The box of what can be felt.
  GasBox box_of(const GasContents& contents, const Least& least) const;
  std::size_t memory_bytes() const;

 private:
  /// What a cell's gas leaves it by, at most, in the box [1/s].
  double fastest(const Flow& flow, const GasFaces& velocity, const GasBox& box) const;
  std::size_t slow_down(const Flow& flow, const GasBox& box, double most);
  void find_fluxes(const Flow& flow, const GasFaces& velocity, const GasBox& box,
                   const std::vector<float>& values, double diffusivity, double dt);
  double through_sides(const GasBox& box) const;
  struct Lost {
    double walls = 0.0, out = 0.0;  // of all cells, by volume of one
    Lost& operator+=(const Lost& other) {
      walls += other.walls, out += other.out;
      return *this;
    }
  };
  Lost update(const Flow& flow, const GasBox& box, double wall_diffusivity, double dt,
              std::vector<float>& values, std::span<float> to_walls) const;

  GasLayout layout_;
  GasFaces flux_;    // of one kind, times dt / spacing: what a cell gains or loses by it
  GasFaces slowed_;  // velocities, where some were too fast
};

}  // namespace viscera
