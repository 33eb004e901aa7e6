// How organs' elasticity follows the tissue that heat coagulates: the stiffness of what has
// coagulated, and the shape that its shrinkage leaves.
//
// An update takes longer than a frame, so it is computed beside the frames and used from a frame on
// that its size alone decides: a run is the same on any machine, which waits where it is slower.
#pragma once

#include <future>
#include <optional>

#include "engine/features/coagulation/coagulation_keys.h"
#include "engine/simulation/feature.h"
#include "kernels/contact/stiffness_update.h"
#include "kernels/heat/coagulated_points.h"

namespace viscera {

/// Tissue that has coagulated. Made when some has.
struct OrganChange {
  static constexpr std::string_view kName = "coagulated organs";
  std::uint64_t seen = 0;    ///< version of the heat that was last looked at
  TissueChange asked;        ///< what the last update was made of, or is being  (points)
  TissueChange used;         ///< and the one in use; empty: none yet
  std::uint64_t due = 0;     ///< frame from which on `asked` is used, where `pending`
  std::int64_t updates = 0;  ///< used so far
  double stiffened = 0.0, left_out = 0.0;  ///< at least half as stiff again; and not followed [m3]
  bool pending = false;
  static constexpr auto fields() {
    using S = OrganChange;
    return std::tuple(field("seen", &S::seen), field("asked", &S::asked), field("used", &S::used),
                      field("due", &S::due), field("updates", &S::updates),
                      field("stiffened", &S::stiffened), field("left_out", &S::left_out),
                      field("pending", &S::pending));
  }
};
static_assert(fields_cover<OrganChange>());

/// What is computed from it, on a thread of its own.
struct OrganUpdate {
  std::unique_ptr<CoagulationGauge> gauge;
  std::shared_ptr<const StiffnessUpdate> update;  ///< of OrganChange::used; null: none yet
  TissueChange made_of;                           ///< what `update` was made of
  std::shared_future<StiffnessUpdate> next;       ///< of OrganChange::asked
};

/// How an organ's elasticity followed its burns.
struct StiffeningFigures {
  double greatest_factor = 1.0;  ///< of Young's modulus
  double stiffened = 0.0;        ///< volume at least half as stiff again [m3]
  double left_out = 0.0;         ///< like it, but too far from the hooks' paths [m3]
  /// Of the surface, by shrinkage alone [m]; none at finite strain, where it isn't told apart.
  std::optional<double> greatest_shrinkage;
  int updates = 0;
  std::size_t nodes = 0, rank = 0;  ///< of the last update
};
/// None: nothing coagulated, or it isn't followed.
std::optional<StiffeningFigures> stiffening_of(const World& world, Entity organ);
std::vector<ReportSection> coagulation_report(const World& world);  ///< part of "tissue"

Feature coagulation_feature();

}  // namespace viscera
