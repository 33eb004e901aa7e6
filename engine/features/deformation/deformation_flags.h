// What solving contact and deforming organs may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// The organ stays at its last good state and answers no more force. Its material and resolution
/// may be at fault, too.
inline constexpr FrameFlag kOrganFrozen{
    "organ_frozen",
    "an organ's displacement was not finite; it is frozen: prepare it afresh (--no-cache)"};
/// The organ kept its last shape and gave no force in that frame.
inline constexpr FrameFlag kContactNotConverged{
    "contact_not_converged",
    "contact had no solution in some frame, without force there: smaller tool steps, or fewer "
    "tools on one spot"};
/// Where, and by how much, the report's warnings say. The dent right under a small tip counts by
/// its mean over a node's spacing alone.
inline constexpr FrameFlag kBeyondLinear{
    "beyond_linear",
    "an organ was turned by more than 0.2 rad or stretched by more than 15 % somewhere, which "
    "linear tissue doesn't carry: its shape and force there are a guide only; press or lift it "
    "less far"};
/// It goes on from its last sound shape, without velocity.
inline constexpr FrameFlag kTissueLost{"tissue_lost",
                                       "tissue at finite strain found no sound state in some frame "
                                       "and kept its last one: smaller tool "
                                       "steps, or a greater finite/viscous_time_ms"};
/// The report says what a further iteration would have gained.
inline constexpr FrameFlag kTissueUnsettled{
    "tissue_unsettled",
    "tissue at finite strain was farther from its equilibrium in some frame than its forces may "
    "err: more finite/iterations, or slower tools"};
/// Nothing need be done; a greater grip_limit_N holds more.
inline constexpr FrameFlag kGripSlipped{
    "grip_slipped", "a closed jaw slid over the tissue: the pull passed its grip limit"};

}  // namespace viscera
