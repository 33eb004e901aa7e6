#include "engine/run/strands.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/features/beds/cut_beds.h"
#include "engine/features/touching/drawn_organ.h"

namespace viscera {
namespace {

/// Fibres that a bond is drawn as; the first thick, the others fine.
constexpr std::size_t kFibres = 3;
/// And, fine ones beside each other, of a film over the bed's edge.
constexpr std::size_t kFilmFibres = 6;
/// Of the radius of the area that a bond stands for, at its waist: most of it is water.
constexpr std::array<double, kFibres> kThick = {0.3, 0.17, 0.1};
/// Feet are wider by this.
constexpr double kFoot = 1.9;
/// Feet lie this far from the bond's end, of the radius of its area.
constexpr double kSpread = 1.7;
/// What is drawn out keeps its volume down to this radius, and tapers to it where it tore [m].
constexpr double kThinnest = 0.04e-3;
/// A bond between surfaces that touch is as long as this [m].
constexpr double kShortest = 1e-3;
/// Of the way at which it parts, what is left of a half that tore.
constexpr double kDrawnBack = 0.17;
/// What is left of a half that heat parted [m].
constexpr double kCharred = 0.3e-3;
/// Torn ends lie down: aside of the surface's normal by so much of it at most.
constexpr double kLying = 1.6;
/// How far torn ends bend aside, of their length.
constexpr double kLoose = 0.6;

/// Evenly spread over [0, 1), another one for each fibre of each bond, and for each `purpose`.
double own_number(std::size_t fibre, std::size_t purpose) {
  constexpr std::array kWays = {std::numbers::phi, std::numbers::sqrt2, std::numbers::sqrt3,
                                std::numbers::e};
  const double turns = static_cast<double>(fibre + 1) * kWays[purpose];
  return turns - std::floor(turns);
}

/// A surface where a bond ends, as it is drawn, world.
struct End {
  Vec3 place = Vec3::Zero();   ///< [m]
  Vec3 normal = Vec3::Zero();  ///< unit
  Vec3 along = Vec3::Zero();   ///< unit, across the normal: fast to the tissue

  End(const DrawnOrgan& organ, const SurfacePoint& point)
      : place(organ.place(point)),
        normal(organ.normal(point.triangle)),
        along((organ.place({point.triangle, Vec3::UnitY()}) -
               organ.place({point.triangle, Vec3::UnitX()}))
                  .normalized()) {}

  /// Unit, across the normal.
  Vec3 aside(double turns) const {
    const double angle = 2.0 * std::numbers::pi * turns;
    return std::cos(angle) * along + std::sin(angle) * normal.cross(along);
  }
};

class BedStrands {
 public:
  BedStrands(const World& world, Entity entity)
      : bed_(*world.find<Bed>(entity)),
        places_(places_now(world, entity)),
        bonds_(world.find<BedState>(entity)->bonds),
        organs_{DrawnOrgan(world, bed_.organs[0]), DrawnOrgan(world, bed_.organs[1])} {}

  std::vector<StrandHalf> halves() const {
    const std::size_t bonds = bonds_.opened.size();
    std::vector<StrandHalf> all;
    const bool film = !places_.layer.edges.empty();
    all.reserve(2 * (kFibres + (film ? kFilmFibres : 0)) * bonds);
    for (std::size_t bond = 0; bond < bonds; ++bond) {
      const BondEnds ends = ends_of(bond);
      for (std::size_t f = 0; f < kFibres; ++f)
        add(bond, ends, kFibres * bond + f, kThick[f], places_.layer.law, all);
    }
    for (std::size_t bond = 0; film && bond < bonds; ++bond) {
      if (!(places_.layer.edge(bond) > 0.0)) continue;
      const BondEnds ends = ends_of(bond);
      for (std::size_t f = 0; f < kFilmFibres; ++f)
        add(bond, ends, kFibres * bonds + kFilmFibres * bond + f, kThick.back(), places_.layer.film,
            all);
    }
    return all;
  }

 private:
  using BondEnds = std::array<End, 2>;

  BondEnds ends_of(std::size_t bond) const {
    return {End(organs_[0], places_.points[0][bond]), End(organs_[1], places_.points[1][bond])};
  }

  /// A fibre of a bond, by its number among all, its radius over the bond's and the law that says
  /// how far it goes.
  void add(std::size_t bond, const BondEnds& ends, std::size_t fibre, double slender,
           const CohesiveLaw& law, std::vector<StrandHalf>& halves) const {
    const double wide = std::sqrt(places_.layer.areas[bond] / std::numbers::pi);
    const bool whole = bonds_.parted_by[bond] == 0 && law.left(bonds_.opened[bond]) > 0.0;
    const double thick = wide * slender * (0.5 + own_number(fibre, 1));
    std::array<Vec3, 2> feet;
    for (std::size_t side = 0; side < 2; ++side)
      feet[side] = ends[side].place + kSpread * wide * own_number(fibre, 2) *
                                          ends[side].aside(own_number(2 * fibre + side, 3));
    for (std::size_t side = 0; side < 2; ++side) {
      StrandHalf half;
      half.foot = feet[side].cast<float>();
      half.foot_radius = static_cast<float>(kFoot * std::max(kThinnest, thick));
      half.seed = static_cast<float>(own_number(fibre, 0));
      if (whole)
        reach_across(feet[1 - side], thick, half);
      else
        draw_back(bonds_.parted_by[bond] == kPartedByHeat, law.last(), ends[side], 2 * fibre + side,
                  half);
      halves.push_back(half);
    }
  }

  static void reach_across(const Vec3& to, double thick, StrandHalf& half) {
    half.reach = 0.5f * (to.cast<float>() - half.foot);
    const double drawn_out = std::max(1.0, 2.0 * half.reach.cast<double>().norm() / kShortest);
    half.end_radius = static_cast<float>(std::max(kThinnest, thick / std::sqrt(drawn_out)));
  }

  static void draw_back(bool burnt, double last, const End& end, std::size_t number,
                        StrandHalf& half) {
    const double length = (burnt ? kCharred : kDrawnBack * last) * (0.4 + own_number(number, 0));
    const Vec3 lying = kLying * own_number(number, 2) * end.aside(own_number(number, 1));
    half.reach = (length * (end.normal + lying).normalized()).cast<float>();
    half.end_radius = kThinnest;
    half.bend = (kLoose * length * end.aside(own_number(number, 3))).cast<float>();
    half.charred = burnt ? 1.0f : 0.0f;
  }

  const Bed& bed_;
  const BedPlaces& places_;
  const BondStates& bonds_;
  std::array<DrawnOrgan, 2> organs_;
};

}  // namespace

std::vector<StrandHalf> strand_halves(const World& world, Entity bed) {
  return BedStrands(world, bed).halves();
}

}  // namespace viscera
