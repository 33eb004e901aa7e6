// Heat that goes from one organ's tissue to another's through what lies between them.
#pragma once

#include "kernels/heat/bioheat.h"

namespace viscera {

/// During the step of dt [s] that follows, from the voxel at a rest place of one organ to that at
/// one of another, by a conductance between their middles [W/K]: what one is heated by the other is
/// cooled by. No more than brings both a quarter nearer to each other, so that no step swings.
/// Nothing goes where both are as warm as each other within BioheatOptions::followed, or where
/// either has no tissue. What has gone from the first to the second [J].
double conduct(Bioheat& one, const Vec3& at_one, Bioheat& other, const Vec3& at_other,
               double conductance, double dt);

}  // namespace viscera
