// How far jaws slide and close within a frame, so that friction and squeeze are what they may be.
#pragma once

#include "engine/features/jaws/jaws.h"

namespace viscera {

/// After contact on an organ was solved with the cells `range` that these jaws hold: slides and
/// closes them as the answer asks, and moves the cells. True: it must be solved again. `response`
/// as TissueContact::cell_response of that solve. `dt`: of the frame [s].
bool settle_jaws(const JawsBody& body, const Pose& organ, const Grasp& grasp,
                 const CellRange& range, const ContactSolution& solution, const MatrixX& response,
                 double dt, Jaws& jaws, std::vector<ContactCell>& cells);

/// Once it is known what holds: Jaws.torque, presses, way, flags.
void note_jaws(const Pose& organ, const CellRange& range, const std::vector<ContactCell>& cells,
               const ContactSolution& solution, FrameReport& report, Jaws& jaws);

}  // namespace viscera
