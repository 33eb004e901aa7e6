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
/// Nothing need be done; a greater grip_limit_N holds more.
inline constexpr FrameFlag kGripSlipped{
    "grip_slipped", "a closed jaw slid over the tissue: the pull passed its grip limit"};

}  // namespace viscera
