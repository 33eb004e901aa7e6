// Beds: layers of connective tissue that hold organs together, bond by bond, until force or heat
// parts them (kernels/contact/cohesive_layer.h). They are solved with what the organs touch, as one
// island (touching/islands.h).
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "engine/features/beds/bed_places.h"
#include "engine/simulation/feature.h"
#include "kernels/contact/contact_island.h"

namespace viscera {

/// One component a bed, on an entity of its own.
struct Bed {
  static constexpr bool kConstant = true;
  std::string name;
  std::array<Entity, 2> organs;
  BedPlaces places;
  double parts_at = 0.0;  ///< [K]
};

struct BedState {
  static constexpr std::string_view kName = "beds";
  BondStates bonds;
  std::vector<Vec3> forces;     ///< of each cell on the first organ, world [N]          (cells)
  double greatest_force = 0.0;  ///< of all together, so far [N]
  static constexpr auto fields() {
    using S = BedState;
    return std::tuple(field("bonds", &S::bonds), field("forces", &S::forces),
                      field("greatest_force", &S::greatest_force));
  }
};
static_assert(fields_cover<BedState>());

/// A bed's part of this frame's contact problem.
struct BedInStep {
  std::unique_ptr<LayerInStep> layer;        ///< null: nothing loads it
  std::array<std::size_t, 2> first_cells{};  ///< of its joints in both organs' cells
};

/// The other organs of beds that are loaded in this frame, as often as there are such beds.
std::vector<Entity> bedded_with(const World& world, Entity organ);

/// The cells of beds between organs that are solved as one, as joints, with the forces that they
/// have had. `bodies`: what these organs are there; -1: nothing.
void add_beds(World& world, std::span<const Entity> organs, std::span<const int> bodies,
              std::vector<Joint>& joints, std::vector<Vec3>& forces,
              std::vector<JointsThatYield>& yielding);
/// Forces of those joints, and how far their bonds have opened. `known`: there was an answer.
void take_beds(World& world, std::span<const Entity> organs, std::span<const int> bodies,
               std::span<const Vec3> forces, bool known);

/// What has become of a bed.
struct BedFigures {
  std::string name;
  std::array<std::string, 2> between;
  std::size_t bonds = 0, whole = 0;                   ///< whole: they hold something
  std::size_t by_force = 0, by_heat = 0, by_cut = 0;  ///< what has parted the others
  double area = 0.0;                                  ///< of all bonds [m2]
  double parted = 0.0;                                ///< of that [m2]
  double torn = 0.0;                                  ///< of what parted, by force [m2]
  double film = 0.0, film_parted = 0.0;      ///< length of edge under a film; of that, parted [m]
  double work = 0.0;                         ///< that force has put into parting it [J]
  double force = 0.0, greatest_force = 0.0;  ///< of all bonds together, now and so far [N]
};
std::vector<BedFigures> bed_figures(const World& world);
std::vector<ReportSection> beds_report(const World& world);  ///< "beds"

Feature beds_feature();

}  // namespace viscera
