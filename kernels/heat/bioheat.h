// Heat in one organ: Pennes' equation [Pennes1948] with boiling, cooling surfaces, charring and
// damage, on bricks that exist where it is warm.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "kernels/heat/bioheat_passes.h"
#include "kernels/heat/heat_book.h"
#include "kernels/heat/heat_passes.h"

namespace viscera {

/// How a step in time is taken.
enum class HeatScheme {
  kFewest,    ///< explicit substeps, or a super step where that takes fewer passes
  kExplicit,  ///< forward Euler, as many substeps as its bound asks for
  kSuper,     ///< one super step of second order
};

struct BioheatOptions {
  double voxel = 0.5e-3;              ///< [m]
  double body = kZeroCelsius + 37.0;  ///< temperature at rest [K]
  SurfaceCooling cooling;
  HeatScheme scheme = HeatScheme::kFewest;
  /// At a brick's side, how warm tissue may be before heat is followed beyond it [K]. Until then it
  /// stays; what is left when all of a brick has come below half of it is booked as `boundary`.
  double followed = 0.05;
  std::size_t most_bricks = 8192;  ///< about 150 MB
};

/// What left the tissue in one voxel during a step.
struct Vapour {
  Vec3 position = Vec3::Zero();  ///< rest frame [m]
  double water = 0.0;            ///< boiled [kg]
  double tissue = 0.0;           ///< fumes of charring solids [kg]
  double temperature = 0.0;      ///< [K]

  static constexpr auto fields() {
    return std::tuple(field("position", &Vapour::position), field("water", &Vapour::water),
                      field("tissue", &Vapour::tissue), field("temperature", &Vapour::temperature));
  }
};
static_assert(fields_cover<Vapour>());

/// When fields that a device holds come to the CPU.
enum class HeatReturn {
  kEveryStep,  ///< a device that fails costs nothing: the step is taken again on the CPU
  kWhenAsked,  ///< by fetch(); one that fails costs the steps since then
};

class Bioheat {
 public:
  /// What goes with the fields: both are of one time.
  struct Totals {
    HeatBook book;  ///< but for `stored`
    double greatest = 0.0, water_lost = 0.0, tissue_lost = 0.0;

    static constexpr auto fields() {
      using T = Totals;
      return std::tuple(field("book", &T::book), field("greatest", &T::greatest),
                        field("water_lost", &T::water_lost), field("tissue_lost", &T::tissue_lost));
    }
  };
  struct State {
    HeatBricks::State bricks;
    std::vector<Vapour> vapour;  ///< of the last step
    Totals totals;
    double stored_at_start = 0.0;  ///< of the book [J]
    std::uint64_t version = 0;
    int passes = 0;  ///< of the last step

    static constexpr auto fields() {
      using S = State;
      return std::tuple(field("bricks", &S::bricks), field("vapour", &S::vapour),
                        field("totals", &S::totals), field("stored_at_start", &S::stored_at_start),
                        field("version", &S::version), field("passes", &S::passes));
    }
  };

  /// `tissue` has passed check(). `distance`: see SignedDistance; none: tissue is everywhere.
  Bioheat(const ThermalTissue& tissue, const BioheatOptions& options, SignedDistance distance = {});

  /// Between steps: heat put in for the step to come isn't in it. Where a device keeps fields for
  /// itself, fetch() comes before.
  const State& state() const;
  /// A device takes all fields anew. Who remembers version() forgets it.
  void restore(State state);
  /// Whether restore() may take it; see HeatBricks.
  bool fits(const State& state) const;

  const ThermalTissue& tissue() const { return tissue_; }
  const BioheatOptions& options() const { return options_; }
  HeatBricks& bricks() { return bricks_; }
  const HeatBricks& bricks() const { return bricks_; }
  double voxel_volume() const { return options_.voxel * options_.voxel * options_.voxel; }

  /// Computes on `passes` from now on; null: on the CPU. Where it fails, the fields are as they
  /// last came, the CPU goes on from there, and device_failure() says why. Who writes fields of
  /// warm bricks by hand sets `altered`.
  void compute_on(std::shared_ptr<HeatPasses> passes, HeatReturn fields = HeatReturn::kEveryStep);
  HeatPasses* device() const { return device_.get(); }
  const std::string& device_failure() const { return device_failure_; }  ///< empty: none
  /// Makes the bricks' fields those of now, where a device keeps them for itself: before an
  /// electrode is used or anything but the book is looked at.
  void fetch();

  /// Heats the tissue of one voxel of a brick during the next step [W]; where there is none,
  /// nothing. From one thread.
  void heat_voxel(HeatBrick& brick, int voxel, double power);
  /// Takes heat out of the tissue of one voxel at once, into an instrument [J].
  void draw_from_voxel(HeatBrick& brick, int voxel, double energy);
  /// Heat capacity of the tissue in one voxel [J/K].
  double voxel_capacity(const HeatBrick& brick, int voxel) const;

  /// The tissue has been cut within these bricks: see HeatBricks::take_shapes(). What warmth has
  /// gone with it is booked as `removed`.
  void take_shapes(std::vector<ShapedBrick> shapes);

  /// Advances by dt [s], any length; nothing is done where nothing is warm. Same digits for any
  /// number of threads.
  void step(double dt);

  /// Of the last step; boiling and charring, not the evaporation of warm wet tissue. In order of
  /// bricks.
  const std::vector<Vapour>& vapour() const { return state_->vapour; }
  /// Smoke among it [kg].
  double smoke(const Vapour& vapour) const {
    return tissue_.smoke_yield * (vapour.water + vapour.tissue);
  }

  HeatBook book() const;
  /// Starts a new one: what is stored now is its zero.
  void begin_book();

  std::size_t warm_bricks() const { return warm_.size(); }
  std::size_t warm_voxels() const { return warm_.size() * BrickField::kVoxels; }
  double greatest_excess() const { return state_->totals.greatest; }  ///< so far [K]
  double excess_now() const;                                          ///< greatest there is [K]
  double tissue_above(double kelvin) const;                           ///< volume now [m3]
  double coagulated_volume() const;                                   ///< Omega >= 1 [m3]
  double dead_volume() const;  ///< by the lethal dose of heat, or coagulated [m3]
  double vaporised_water() const { return state_->totals.water_lost; }    ///< so far, boiled [kg]
  double vaporised_tissue() const { return state_->totals.tissue_lost; }  ///< so far [kg]
  std::uint64_t version() const { return state_->version; }   ///< raised by steps that change it
  int passes_of_last_step() const { return state_->passes; }  ///< evaluations of the rates

 private:
  HeatPasses& passes() { return device_ ? *device_ : cpu_; }
  void forget_device();
  bool take_step(double dt);
  void advance(const HeatFlows& now, double dt);
  bool super_step(const HeatFlows& first, double dt, int stages);
  void book_flows(double living, double boundary);
  void book_step();
  void follow_heat();
  void let_go();
  void list_warm();
  double stored() const;
  template <class Is>
  double volume_that(const Is& is) const;

  ThermalTissue tissue_;
  BioheatOptions options_;
  BioheatNumbers numbers_;
  std::shared_ptr<State> state_;  // never null; its bricks are those of `bricks_`
  HeatBricks bricks_;
  std::vector<HeatBrick*> warm_;  // in order of bricks
  CpuHeatPasses cpu_;
  std::shared_ptr<HeatPasses> device_;  // null: cpu_
  HeatReturn return_ = HeatReturn::kEveryStep;
  bool current_ = true;  // the fields here are those of now
  std::string device_failure_;
  Totals fetched_;  // when the fields last came
};
static_assert(fields_cover<Bioheat::Totals>() && fields_cover<Bioheat::State>());

}  // namespace viscera
