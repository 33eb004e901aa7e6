// Heat in one organ: Pennes' equation [Pennes1948] with boiling, cooling surfaces, charring and damage, on
// bricks that exist where it is warm.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "kernels/heat/bioheat_passes.h"
#include "kernels/heat/heat_book.h"

namespace viscera {

/// How a step in time is taken.
enum class HeatScheme {
  kFewest,   ///< explicit substeps, or a super step where that takes fewer passes
  kExplicit, ///< forward Euler, as many substeps as its bound asks for
  kSuper,    ///< one super step of second order
};

struct BioheatOptions {
  double voxel = 0.5e-3;               ///< [m]
  double body = kZeroCelsius + 37.0;   ///< temperature at rest [K]
  SurfaceCooling cooling;
  HeatScheme scheme = HeatScheme::kFewest;
  /// At a brick's side, how warm tissue may be before heat is followed beyond it [K]. Until then it stays;
  /// what is left when all of a brick has come below half of it is booked as `boundary`.
  double followed = 0.05;
  std::size_t most_bricks = 8192;      ///< about 150 MB
};

/// What left the tissue in one voxel during a step.
struct Vapour {
  Vec3 position = Vec3::Zero();  ///< rest frame [m]
  double water = 0.0;            ///< boiled [kg]
  double tissue = 0.0;           ///< fumes of charring solids [kg]
  double temperature = 0.0;      ///< [K]
};

class Bioheat {
 public:
  /// `tissue` has passed check(). `distance`: see SignedDistance; none: tissue is everywhere.
  Bioheat(const ThermalTissue& tissue, const BioheatOptions& options, SignedDistance distance = {});

  const ThermalTissue& tissue() const { return tissue_; }
  const BioheatOptions& options() const { return options_; }
  HeatBricks& bricks() { return bricks_; }
  const HeatBricks& bricks() const { return bricks_; }
  double voxel_volume() const { return options_.voxel * options_.voxel * options_.voxel; }

  /// Heats the tissue of one voxel of a brick during the next step [W]; where there is none, nothing. From
  /// one thread.
  void heat_voxel(HeatBrick& brick, int voxel, double power);
  /// Takes heat out of the tissue of one voxel at once, into an instrument [J].
  void draw_from_voxel(HeatBrick& brick, int voxel, double energy);
  /// Heat capacity of the tissue in one voxel [J/K].
  double voxel_capacity(const HeatBrick& brick, int voxel) const;

  /// Advances by dt [s], any length; nothing is done where nothing is warm. Same digits for any number of
  /// threads.
  void step(double dt);

  /// Of the last step; boiling and charring, not the evaporation of warm wet tissue. In order of bricks.
  const std::vector<Vapour>& vapour() const { return vapour_; }
  /// Smoke among it [kg].
  double smoke(const Vapour& vapour) const {
    return tissue_.smoke_yield * (vapour.water + vapour.tissue);
  }

  HeatBook book() const;
  /// Starts a new one: what is stored now is its zero.
  void begin_book();

  std::size_t warm_bricks() const { return warm_.size(); }
  std::size_t warm_voxels() const { return warm_.size() * BrickField::kVoxels; }
  double greatest_excess() const { return greatest_; }        ///< so far [K]
  double excess_now() const;                                  ///< the greatest there is [K]
  double tissue_above(double kelvin) const;                   ///< volume now [m3]
  double harmed_volume(double damage = 1.0) const;            ///< Omega at least this [m3]
  double vaporised_water() const { return water_lost_; }      ///< so far, boiled [kg]
  double vaporised_tissue() const { return tissue_lost_; }    ///< so far [kg]
  std::uint64_t version() const { return version_; }          ///< raised when a step changed something
  int passes_of_last_step() const { return passes_; }         ///< evaluations of the rates

 private:
  struct Flows {
    double living = 0.0, boundary = 0.0;
  };

  template <class Body>
  void for_warm(const Body& body);
  void find_all_rates();
  Flows flows() const;
  void advance(double dt);
  void super_step(double dt, int stages);
  void settle(double dt);
  void book_step();
  void follow_heat();
  void let_go();
  void list_warm();
  double stored() const;

  ThermalTissue tissue_;
  BioheatOptions options_;
  BioheatNumbers numbers_;
  HeatBricks bricks_;
  std::vector<HeatBrick*> warm_;  // in order of bricks
  std::vector<Vapour> vapour_;
  HeatBook book_;
  double stored_at_start_ = 0.0, greatest_ = 0.0, water_lost_ = 0.0, tissue_lost_ = 0.0;
  std::uint64_t version_ = 0;
  int passes_ = 0;
};

}  // namespace viscera
