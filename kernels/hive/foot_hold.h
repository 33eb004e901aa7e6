// What everything else that holds a body (jaws, springs, other tools) takes off its compliance
// about one tool's foot: such a body is stiffer there. So is one that is strained, or softer. To
// first order in place, which is enough for holds that lie farther off than the foot is wide, and
// of constant size for a haptic tick.
#pragma once

#include <cmath>

#include "kernels/base/fields.h"

namespace viscera {

/// A force f at a place x moves a place y by P(y)^T root S root^T P(x) f less than the body alone
/// says, S being diagonal of the signs, with P(x) = (1, a, b) (x) I, a and b the coordinates of x
/// along two axes in the surface.
struct FootHold {
  using Vector9 = Eigen::Matrix<double, 9, 1>;

  Vec3 centre = Vec3::Zero();                             ///< at rest [m]
  Vec3 along_x = Vec3::UnitX(), along_y = Vec3::UnitY();  ///< unit, in the surface
  double reach = 0.0;  ///< places farther from the centre count as that far [m]; 0: nothing holds
  Eigen::Matrix<double, 9, 9> root = Eigen::Matrix<double, 9, 9>::Zero();  ///< [sqrt(m/N)]
  Vector9 signs = Vector9::Ones();  ///< 1: taken; -1: given, where a body has become softer

  bool is_sound() const {
    return signs.cwiseAbs() == Vector9::Ones() && centre.allFinite() && along_x.allFinite() &&
           along_y.allFinite() && reach >= 0.0 && reach < 1e3 && root.allFinite();
  }
  bool none() const { return reach == 0.0; }

  /// Of a place and a unit direction: the products of two such, each with its sign, are what is
  /// taken off [sqrt(m/N)].
  Vector9 share(const Vec3& place, const Vec3& direction) const {
    Vec2 at((place - centre).dot(along_x), (place - centre).dot(along_y));
    if (at.norm() > reach) at *= reach / at.norm();
    Vector9 weights;
    weights << direction, at.x() * direction, at.y() * direction;
    return root.transpose() * weights;
  }

  static constexpr auto fields() {
    return std::tuple(field("centre", &FootHold::centre), field("along_x", &FootHold::along_x),
                      field("along_y", &FootHold::along_y), field("reach", &FootHold::reach),
                      field("root", &FootHold::root), field("signs", &FootHold::signs));
  }
};
static_assert(fields_cover<FootHold>());

/// One hold passing into another: what either takes off, by its share.
struct HoldBlend {
  using Vector18 = Eigen::Matrix<double, 18, 1>;

  FootHold from, to;
  double share = 1.0;  ///< of `to`

  bool none() const { return (from.none() || share >= 1.0) && (to.none() || share <= 0.0); }
  bool is_sound() const { return from.is_sound() && to.is_sound() && share >= 0.0 && share <= 1.0; }
  /// As FootHold::share.
  Vector18 share_at(const Vec3& place, const Vec3& direction) const {
    Vector18 both;
    both << std::sqrt(1.0 - share) * from.share(place, direction),
        std::sqrt(share) * to.share(place, direction);
    return both;
  }
  /// Of its numbers.
  Vector18 signs() const {
    Vector18 both;
    both << from.signs, to.signs;
    return both;
  }

  static constexpr auto fields() {
    return std::tuple(field("from", &HoldBlend::from), field("to", &HoldBlend::to),
                      field("share", &HoldBlend::share));
  }
};
static_assert(fields_cover<HoldBlend>());

}  // namespace viscera
