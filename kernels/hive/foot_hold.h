// What everything else that holds a body (jaws, springs, other tools) takes off its compliance
// about one tool's foot: such a body is stiffer there. So is one that is strained, or softer. To
// first order in place, which is enough for holds that lie farther off than the foot is wide, and
// of constant size for a haptic tick.
//
// Tissue that has stiffened right about the foot leaves a small part of the compliance, to take the
// rest off it would leave the error of the whole: that compliance is divided instead.
#pragma once

#include <algorithm>
#include <cmath>

#include "kernels/base/fields.h"

namespace viscera {

/// A force f at a place x moves a place y by g(y) g(x) times what the body alone says, less
/// P(y)^T root S root^T P(x) f, S being diagonal of the signs, with P(x) = (1, a, b) (x) I, a and b
/// the coordinates of x along two axes in the surface, and g = `give`.
struct FootHold {
  using Vector9 = Eigen::Matrix<double, 9, 1>;

  Vec3 centre = Vec3::Zero();                             ///< at rest [m]
  Vec3 along_x = Vec3::UnitX(), along_y = Vec3::UnitY();  ///< unit, in the surface
  double reach = 0.0;  ///< places farther from the centre count as that far [m]; 0: nothing holds
  Eigen::Matrix<double, 9, 9> root = Eigen::Matrix<double, 9, 9>::Zero();  ///< [sqrt(m/N)]
  Vector9 signs = Vector9::Ones();  ///< 1: taken; -1: given, where a body has become softer
  /// Logarithm of the modulus of the tissue right about a place over what the body alone has, as
  /// (1, a, b) times this [1, 1/m, 1/m], within these bounds.
  Vec3 stiffer = Vec3::Zero();
  double least = 0.0, most = 0.0;
  /// Of root S root^T what belongs to `give`: both change together from place to place [m/N].
  Eigen::Matrix<double, 9, 9> divided = Eigen::Matrix<double, 9, 9>::Zero();

  bool is_sound() const {
    return signs.cwiseAbs() == Vector9::Ones() && centre.allFinite() && along_x.allFinite() &&
           along_y.allFinite() && reach >= 0.0 && reach < 1e3 && root.allFinite() &&
           stiffer.allFinite() && divided.allFinite() && std::abs(least) < kMostStiffer &&
           std::abs(most) < kMostStiffer && least <= most;
  }
  bool none() const { return reach == 0.0; }

  /// Of a place and a unit direction: the products of two such, each with its sign, are what is
  /// taken off [sqrt(m/N)].
  Vector9 share(const Vec3& place, const Vec3& direction) const {
    return root.transpose() * weights(place, direction);
  }

  /// The root of the modulus of the body alone over that about a place.
  double give(const Vec3& place) const {
    if (least == 0.0 && most == 0.0) return 1.0;
    const Vec2 at = within(reach, place);
    const double there = stiffer.x() + at.x() * stiffer.y() + at.y() * stiffer.z();
    return std::exp(-0.5 * std::clamp(there, least, most));
  }

  /// (1, a, b) (x) direction.
  Vector9 weights(const Vec3& place, const Vec3& direction) const {
    const Vec2 at = within(reach, place);
    Vector9 all;
    all << direction, at.x() * direction, at.y() * direction;
    return all;
  }
  /// How that changes along the two axes.
  Eigen::Matrix<double, 9, 2> weight_slopes(const Vec3& place, const Vec3& direction) const {
    Eigen::Matrix<double, 9, 2> slopes = Eigen::Matrix<double, 9, 2>::Zero();
    if (!is_within(reach, place)) return slopes;
    slopes.block<3, 1>(3, 0) = direction;
    slopes.block<3, 1>(6, 1) = direction;
    return slopes;
  }
  /// How `give` changes along them.
  Vec2 give_slopes(const Vec3& place) const {
    const double g = give(place), logarithm = -2.0 * std::log(g);
    if (logarithm <= least || logarithm >= most || !is_within(reach, place)) return Vec2::Zero();
    return -0.5 * g * stiffer.tail<2>();
  }

  static constexpr auto fields() {
    return std::tuple(field("centre", &FootHold::centre), field("along_x", &FootHold::along_x),
                      field("along_y", &FootHold::along_y), field("reach", &FootHold::reach),
                      field("root", &FootHold::root), field("signs", &FootHold::signs),
                      field("stiffer", &FootHold::stiffer), field("least", &FootHold::least),
                      field("most", &FootHold::most), field("divided", &FootHold::divided));
  }

 private:
  static constexpr double kMostStiffer = 20.0;  // as a logarithm

  Vec2 coordinates(const Vec3& place) const {
    return {(place - centre).dot(along_x), (place - centre).dot(along_y)};
  }
  bool is_within(double most, const Vec3& place) const { return coordinates(place).norm() < most; }
  Vec2 within(double most, const Vec3& place) const {
    const Vec2 at = coordinates(place);
    return at.norm() > most ? Vec2(at * (most / at.norm())) : at;
  }
};
static_assert(fields_cover<FootHold>());

/// One hold passing into another: what either leaves, by its share.
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
  /// As FootHold::give: what two such have in common is what is left of the body's answer between
  /// two places.
  Vec2 give_at(const Vec3& place) const {
    return {std::sqrt(1.0 - share) * from.give(place), std::sqrt(share) * to.give(place)};
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
