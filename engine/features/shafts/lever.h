// What forces along a shaft are for the hand that holds it and for the wall that it passes.
//
// An instrument turns about its trocar and slides through it. So what tissue does to its shaft
// reaches the hand by its moment about the trocar and by its part along the shaft; the rest is the
// wall's. The hand is taken to act at the tip, as its device does in the scene: the force there
// that has the same moment is the lever's.
#pragma once

#include "kernels/base/fields.h"
#include "kernels/base/types.h"

namespace viscera {

/// Forces on a shaft, put together; world.
struct ShaftLoad {
  Vec3 force = Vec3::Zero();   ///< [N]
  Vec3 torque = Vec3::Zero();  ///< about the trocar [N m]

  void add(const Vec3& one, const Vec3& at, const Vec3& trocar) {
    force += one;
    torque += (at - trocar).cross(one);
  }
  static constexpr auto fields() {
    return std::tuple(field("force", &ShaftLoad::force), field("torque", &ShaftLoad::torque));
  }
};
static_assert(fields_cover<ShaftLoad>());

struct LeverForces {
  Vec3 at_tip = Vec3::Zero();    ///< what the hand feels there [N]
  Vec3 reaction = Vec3::Zero();  ///< of the trocar on the shaft: load + reaction = at_tip [N]
  double twist = 0.0;            ///< about the shaft, which no force at the tip holds [N m]
  static constexpr auto fields() {
    return std::tuple(field("at_tip", &LeverForces::at_tip),
                      field("reaction", &LeverForces::reaction),
                      field("twist", &LeverForces::twist));
  }
};
static_assert(fields_cover<LeverForces>());

/// How far a place of the shaft moves across it as the tip does: below 0 beyond the trocar.
double lever_share(const Vec3& at, const Vec3& tip, const Vec3& trocar);

/// Whatever is no lever (the tip in its trocar) has no force at the tip.
LeverForces about_trocar(const ShaftLoad& load, const Vec3& tip, const Vec3& trocar);

}  // namespace viscera
