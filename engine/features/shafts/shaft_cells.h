// The cells by which a stretch of a shaft presses an organ.
//
// One row of cells along the line of contact, each as long as the next is far and as wide as gives
// a line of contact its force. Under a cylinder of radius r the force p on each metre spreads over
// a width of 2 b, b = sqrt(4 p r / (pi E*)) [Johnson1985] eq. 4.43. A row presses evenly over its
// width w and asks for its mean displacement: that is the same as of the lowest line under the
// cylinder where w = e b / 2. (The mean over an evenly pressed strip is 2 p / (pi E*) (3/2 - ln w),
// the lowest line of Hertz's (1/2 + ln 2 - ln b) of the same.) b is the last frame's; the force
// depends on it as a logarithm, so it settles within three.
//
// A row can't go to and fro beneath the shaft, as cells side by side may, and the more of it there
// is for the same number of cells. It says where tissue is pressed no finer than its width.
#pragma once

#include <vector>

#include "engine/features/contact/contact_cells.h"
#include "engine/features/shafts/stretches.h"

namespace viscera {

/// A stretch has so many at most. Where they lie farther apart than w, they are wider than it, too,
/// and the force is found too great.
inline constexpr int kMostCellsOfStretch = 40;

/// What a shaft touches an organ with.
struct ShaftRub {
  double friction = 0.0;
  const Cling* cling = nullptr;  ///< of the last frame; null: nothing clung to it
  Vec3 undrawn = Vec3::Zero();   ///< undrawn_drag(*cling, ...) [m]
};

/// Appends a stretch's cells, and says in it which they are; false: there are none. Cells that the
/// `tissue` can't answer are left out, `unreached` tells it.
bool lay_shaft_cells(const ShaftAbout& shaft, const ShaftRub& rub, const OrganModel& model,
                     const TissueContact& tissue, const TissueSheet& drawn, ShaftStretch& stretch,
                     std::vector<ContactCell>& cells, bool& unreached);

/// ShaftStretch::half_width under this force on the cells that are pressed, `pressed` metres of the
/// shaft; as it was where it would hardly change.
double half_width_under(double force, double pressed, double radius,
                        const IsotropicMaterial& material, double before);

}  // namespace viscera
