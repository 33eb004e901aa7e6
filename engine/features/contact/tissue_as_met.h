// An organ as one tool meets it: moved and held by everything else that touches it.
#pragma once

#include <functional>
#include <optional>

#include "engine/features/contact/first_order.h"
#include "engine/simulation/world.h"
#include "haptics/tissue_snapshot.h"
#include "kernels/contact/tissue_contact.h"

namespace viscera {

/// Of range.instrument: CellRange.met, and how it settles (met_way, met_share). How the
/// tissue under a tool would lie without its dent, from its rest; organ's frame: the rigid motion
/// by everything but this tool, and how far this tool has carried it aside. Tissue leaves sideways
/// from under a tool near an edge, or where a body gives way as a whole; cells that kept to the
/// tissue which lay under the tool at rest would push it aside by that over its radius. `tip` is
/// the tool's there [m]. By the last frame's contact, with which it settles from frame to frame,
/// the slower the deeper the contact is and, under a tool that stands still, the more often it went
/// to and fro; of a tool that wasn't in it, by the surface as it is drawn.
void take_motion_as_met(const World& world, Entity organ, const Vec3& tip, CellRange& range);

/// To be called after contact was solved: CellRange.met of the tools that press this organ.
void note_what_tools_meet(World& world, Entity organ);

/// What the tissue under a tool answers that touches an organ.
struct TissueUnder {
  std::optional<FirstOrder> about;   ///< none: the tool's cells have no side
  std::optional<OthersHold> others;  ///< none: this frame's contact has no answer
};
/// Finds that after contact was solved; none: the tool doesn't touch the organ. It may be called
/// once, on any thread, as long as nobody else does anything with the organ's TissueContact.
std::function<TissueUnder()> ask_tissue_under(World& world, Entity organ, Entity instrument);

/// Fills `snapshot` (all but frame, tick and velocity) with the organ as it is at the end of this
/// frame's step. About the tool's foot: the rigid motion of the tissue by other tools, springs,
/// gravity and so on, and what their hold takes off its answer, as `under` has it where the tool
/// touches. Tissue farther than `reach` from the tip isn't sought: `nearest` is then none [m].
/// False where this frame's contact under the tool has no answer: the snapshot before this one
/// tells more, and shall stay.
bool meet_tissue(World& world, Entity organ, Entity instrument, double reach,
                 const std::optional<TissueUnder>& under, TissueSnapshot& snapshot);

}  // namespace viscera
