// Tissue beyond linear under a ball, within a haptic tick.
//
// The linear hive's cells keep their compliance A, which is accurate; added is what finite strains
// change, found on the tissue about the tool's axis (axial_tissue.h) as a difference on the same
// grid. With v the cells' displacements along the tool's way and P their means over the rings of
// the pattern, the energy of the whole is
//   v A^-1 v / 2 + N(P v) - L(P v),
// N of the non-linear grid, L of the linear one. So a shallow touch is exactly the linear hive's;
// the grid's own error counts only in the difference; the periphery and the surface's shape are the
// linear hive's; and since all is one energy of the tool's place, closed paths give nothing back.
// What is left out: that the difference isn't the same all around the axis, and that the body is
// neither flat nor deep there.
//
// The tool's shape counts at finite strain too: a cell that has moved aside by s meets the ball
// where it is there, and is pushed aside by its slope.
//
// Each step linearises N about the grid's state, condenses it to the rings and solves the cells'
// complementarity problem with it: a Newton step of grid and contact together. The first step of a
// tick starts where the last tick ended, and is nearly always enough. When time is up the last good
// linearisation answers, to first order exact; likewise where the tissue gives way under the tool,
// until it is found again with nearly the force that was foretold, so that the force never jumps.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/hive/axial_tissue.h"
#include "kernels/hive/hive.h"
#include "kernels/hive/hyperelastic_model.h"

namespace viscera {

struct NonlinearSettings {
  HyperelasticModel model = HyperelasticModel::kNeoHookean;
  IsotropicMaterial material;
  int rings = 3;       ///< of the tool's hexagonal pattern of cells, 1 to 6
  int nodes = 80;      ///< of the grid, about; 28 to 2000
  int most_steps = 3;  ///< in a tick
};

/// Asked before every step whether time is up: the kernel knows no clock. No function: it never is,
/// so that runs repeat.
struct TimeIsUp {
  bool (*asked)(void* user) = nullptr;
  void* user = nullptr;
  explicit operator bool() const { return asked && asked(user); }
};

struct NonlinearForce {
  HiveForce hive;            ///< along the cells' direction; no moment
  double stiffness = 0.0;    ///< by how much the force rises per depth of all cells [N/m]
  int steps = 0;             ///< Newton's
  bool by_tangent = false;   ///< the steps didn't settle: the last good linearisation's answer
  bool out_of_time = false;  ///< because time was up
};

class NonlinearHive {
 public:
  static constexpr std::size_t kMostHives = 2;

  /// A linear hive that is seated on the pattern's cells, and its share in the answer.
  struct Share {
    Hive* hive = nullptr;  ///< is told the forces, for its displacement()
    double weight = 1.0;
  };

  /// Takes all memory. Fails on settings out of range.
  static Result<NonlinearHive> create(const NonlinearSettings& settings);
  NonlinearHive(NonlinearHive&&) noexcept;
  NonlinearHive& operator=(NonlinearHive&&) noexcept;
  ~NonlinearHive();

  /// The tick: a ball of `ball_radius` [m] pushes each cell `depths` [m] along one common
  /// direction, none pulling. Cells lie in rings about the tool, `across` [m] the pattern's radius
  /// (haptics/tool_foot.h). At most two hives; weights sum to the answer's share.
  NonlinearForce press(std::span<const Share> hives, std::span<const double> depths, double across,
                       double ball_radius, TimeIsUp time = {}) noexcept;

  /// The tool has left the tissue: the next touch begins undeformed.
  void release() noexcept;

  int nodes() const noexcept;
  int unknowns() const noexcept;
  const NonlinearSettings& settings() const noexcept;

  /// What the contact is solved with: a linearisation and the state that it was made about.
  struct Tangent {
    AxialTissue::Linearisation grid;
    AxialTissue::RingVector v, load_factor;  ///< of the state; of its loads, sums of cell forces
    AxialTissue::RingVector offset, slope;   ///< of the ball's profile where the rings are
    AxialTissue::RingVector at;              ///< their lateral displacement in the state
    double ball = 0.0, energy = 0.0;
    static constexpr auto fields() {
      return std::tuple(field("grid", &Tangent::grid), field("v", &Tangent::v),
                        field("load_factor", &Tangent::load_factor),
                        field("offset", &Tangent::offset), field("slope", &Tangent::slope),
                        field("at", &Tangent::at), field("ball", &Tangent::ball),
                        field("energy", &Tangent::energy));
    }
  };
  /// The grid's displacements and loads, from which the next tick's first step goes on.
  struct Place {
    std::vector<double> displacements;   ///< AxialTissue::state()
    AxialTissue::RingVector force_sums;  ///< of the rings' cells, of the state's contact
    static constexpr auto fields() {
      return std::tuple(field("displacements", &Place::displacements),
                        field("force_sums", &Place::force_sums));
    }
  };
  struct State {
    Place now;
    Tangent tangent;
    bool has_tangent = false;
    bool astray = false;  ///< the last good tangent answers until the tissue is found again
    bool has_good = false;
    Tangent good;  ///< with the place that the last settled tick left
    Place good_place;
    std::array<PressedCells::State, kMostHives> pressed;  ///< of each hive
    static constexpr auto fields() {
      return std::tuple(field("now", &State::now), field("tangent", &State::tangent),
                        field("has_tangent", &State::has_tangent), field("astray", &State::astray),
                        field("has_good", &State::has_good), field("good", &State::good),
                        field("good_place", &State::good_place), field("pressed", &State::pressed));
    }
  };
  State state() const;
  void restore(const State& state);
  /// Of a grid and a pattern of this size.
  bool fits(const State& state) const noexcept;

 private:
  struct Data;
  explicit NonlinearHive(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};
static_assert(fields_cover<NonlinearHive::Tangent>() && fields_cover<NonlinearHive::Place>() &&
              fields_cover<NonlinearHive::State>());

}  // namespace viscera
