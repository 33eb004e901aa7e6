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
  /// So many columns of the root are given, where a body has become softer, and the rest taken.
  int given = 0;
  /// Logarithm of the modulus of the tissue right about a place over what the body alone has, as
  /// (1, a, b) times this [1, 1/m, 1/m], within these bounds.
  Vec3 stiffer = Vec3::Zero();
  double least = 0.0, most = 0.0;
  /// Of root S root^T what belongs to `give`: both change together from place to place [m/N]. Its
  /// rows from the fourth on, each up to the diagonal: the first three no slope asks for.
  using Slopes = Eigen::Matrix<double, 39, 1>;
  Slopes divided = Slopes::Zero();
  static Slopes slopes_of(const Eigen::Matrix<double, 9, 9>& whole) {
    Slopes rows;
    Eigen::Index at = 0;
    for (Eigen::Index i = 3; i < 9; ++i)
      for (Eigen::Index j = 0; j <= i; ++j) rows[at++] = 0.5 * (whole(i, j) + whole(j, i));
    return rows;
  }
  /// The rows from the fourth on of `divided` times this.
  Eigen::Matrix<double, 6, 1> divided_times(const Vector9& x) const {
    Eigen::Matrix<double, 6, 1> product = Eigen::Matrix<double, 6, 1>::Zero();
    Eigen::Index at = 0;
    for (Eigen::Index i = 3; i < 9; ++i)
      for (Eigen::Index j = 0; j <= i; ++j, ++at) {
        product[i - 3] += divided[at] * x[j];
        if (j >= 3 && j < i) product[j - 3] += divided[at] * x[i];
      }
    return product;
  }

  bool is_sound() const {
    return given >= 0 && given <= 9 && centre.allFinite() && along_x.allFinite() &&
           along_y.allFinite() && reach >= 0.0 && reach < 1e3 && root.allFinite() &&
           stiffer.allFinite() && divided.allFinite() && std::abs(least) < kMostStiffer &&
           std::abs(most) < kMostStiffer && least <= most;
  }
  bool none() const { return reach == 0.0; }
  /// Of the root's columns: 1: taken; -1: given.
  Vector9 signs() const {
    Vector9 all = Vector9::Ones();
    all.head(given).setConstant(-1.0);
    return all;
  }

  /// Of a place and a unit direction: the products of two such, each with its sign, are what is
  /// taken off [sqrt(m/N)].
  Vector9 share(const Vec3& place, const Vec3& direction) const {
    return root.transpose() * weights(place, direction);
  }

  /// The root of the modulus of the body alone over that about a place.
  double give(const Vec3& place) const {
    if (least == 0.0 && most == 0.0) return 1.0;
    const Vec2 at = within_reach(place);
    const double there = stiffer.x() + at.x() * stiffer.y() + at.y() * stiffer.z();
    return std::exp(-0.5 * std::clamp(there, least, most));
  }

  /// (1, a, b) (x) direction.
  Vector9 weights(const Vec3& place, const Vec3& direction) const {
    const Vec2 at = within_reach(place);
    Vector9 all;
    all << direction, at.x() * direction, at.y() * direction;
    return all;
  }
  /// How `give` changes along the two axes.
  Vec2 give_slopes(const Vec3& place) const {
    const double g = give(place), logarithm = -2.0 * std::log(g);
    if (logarithm <= least || logarithm >= most || !is_within(place)) return Vec2::Zero();
    return -0.5 * g * stiffer.tail<2>();
  }

  static constexpr auto fields() {
    return std::tuple(field("centre", &FootHold::centre), field("along_x", &FootHold::along_x),
                      field("along_y", &FootHold::along_y), field("reach", &FootHold::reach),
                      field("root", &FootHold::root), field("given", &FootHold::given),
                      field("stiffer", &FootHold::stiffer), field("least", &FootHold::least),
                      field("most", &FootHold::most), field("divided", &FootHold::divided));
  }

  /// Nearer than `reach`.
  bool is_within(const Vec3& place) const { return coordinates(place).norm() < reach; }

 private:
  static constexpr double kMostStiffer = 20.0;  // as a logarithm

  Vec2 coordinates(const Vec3& place) const {
    return {(place - centre).dot(along_x), (place - centre).dot(along_y)};
  }
  Vec2 within_reach(const Vec3& place) const {
    const Vec2 at = coordinates(place);
    return at.norm() > reach ? Vec2(at * (reach / at.norm())) : at;
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
    both << from.signs(), to.signs();
    return both;
  }

  static constexpr auto fields() {
    return std::tuple(field("from", &HoldBlend::from), field("to", &HoldBlend::to),
                      field("share", &HoldBlend::share));
  }
};
static_assert(fields_cover<HoldBlend>());

}  // namespace viscera
