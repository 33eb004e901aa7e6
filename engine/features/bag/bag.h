// Retrieval bags: what was cut off is laid into the sack, the mouth closes, and the bag keeps it
// until it leaves through the trocar (engine/features/parting/remove_pieces.h) or the mouth opens.
//
// The film is thin and slack: it presses nothing, neither organs nor what lies in it. What is kept
// is held at places spread over its surface, which go as the bag's tip goes, as a grasp's do.
#pragma once

#include "engine/features/bag/bag_flags.h"
#include "engine/features/bag/bag_keys.h"
#include "engine/simulation/feature.h"

namespace viscera {

/// On an instrument that is a bag. What it keeps is InstrumentContact::grasp.
struct Bag {
  static constexpr std::string_view kName = "bags";
  bool closed = false;
  std::uint64_t kept = 0;  ///< pieces, as its mouth closed last
  static constexpr auto fields() {
    return std::tuple(field("closed", &Bag::closed), field("kept", &Bag::kept));
  }
};
static_assert(fields_cover<Bag>());

/// An opening below which the mouth is closed.
inline constexpr double kMouthCloses = 0.5;

/// Whether a place lies in the sack, with its mouth as wide as it opens; both in the world [m].
bool in_sack(const BagDescription& bag, const InstrumentState& state, const Vec3& place);

/// Mouths that close or open -> InstrumentContact::grasp.
void close_bags(World& world, const FrameContext& context);

Feature bag_feature();

}  // namespace viscera
