#include "engine/features/parting/tear.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/features/parting/parting.h"
#include "kernels/finite/finite_solver.h"

namespace viscera {
namespace {

/// A body that is new opens for so long before it may tear on: ten times the viscous time that an
/// organ has by default. Chosen [s].
constexpr double kOpensFor = 0.2;
/// A tear has so many discs at most: where all of a large organ is drawn out, the next body goes
/// on.
constexpr std::size_t kMostDiscs = 500;
/// Places about a disc that are asked whether they are gone.
constexpr int kAboutDisc = 16;

/// A point of the energy where tissue tears.
struct TearingPoint {
  Vec3 place = Vec3::Zero();    ///< at rest [m]
  Vec3 across = Vec3::UnitX();  ///< unit, normal of the tear at rest
  double stretch = 1.0;
  double size = 0.0;  ///< edge of a cube that has its volume [m]

  double radius() const { return kOfTornDisc * size; }
  /// Whether the tear goes on from here to there: discs meet, and it is of the same layer.
  bool leads_to(const TearingPoint& other) const {
    const Vec3 way = other.place - place;
    const double along = std::abs(way.dot(across));
    const double beside = std::sqrt(std::max(0.0, way.squaredNorm() - along * along));
    return along <= 0.25 * (size + other.size) && beside <= radius() + other.radius();
  }
};

/// Normals at rest of planes that lie across `directions` in the shape without stress.
void turn_to_rest(const FiniteBody& body, const std::vector<std::size_t>& points,
                  std::vector<TearingPoint>& tearing) {
  if (body.unloaded().empty()) return;
  const std::vector<PointDeformation> at_rest =
      body.deformations(std::vector<double>(3 * body.nodes(), 0.0));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Mat3& f = at_rest[points[i]].gradient;
    if (f.determinant() > 0.0)
      tearing[i].across = (f.inverse().transpose() * tearing[i].across).normalized();
  }
}

/// Of an organ as it is now, in the order of its points.
std::vector<TearingPoint> tearing_points(const OrganModel& model,
                                         const std::vector<double>& displacements,
                                         double ultimate_strain, const TissueShare& left) {
  const FiniteBody& body = model.finite->body();
  if (displacements.size() != 3 * body.nodes() || model.energy_points.size() != body.points())
    return {};
  const TearLimit limit = TearLimit::of(body.moduli(), ultimate_strain);
  const std::vector<PointDeformation> deformed = body.deformations(displacements);
  std::vector<TearingPoint> tearing;
  std::vector<std::size_t> points;
  for (std::size_t q = 0; q < deformed.size(); ++q) {
    const auto most = torn(deformed[q], limit);
    if (!most || left.share(model.energy_points[q]) < 0.5) continue;
    tearing.push_back({model.energy_points[q], most->direction, most->stretch, 0.0});
    points.push_back(q);
  }
  if (tearing.empty()) return tearing;
  const std::vector<double> volumes = body.point_volumes();
  for (std::size_t i = 0; i < points.size(); ++i) tearing[i].size = std::cbrt(volumes[points[i]]);
  turn_to_rest(body, points, tearing);
  return tearing;
}

/// How many of the places about a disc are gone.
int gone_about(const TornDisc& disc, const TissueShare& left) {
  const Vec3 one = disc.across.unitOrthogonal(), other = disc.across.cross(one);
  int gone = 0;
  for (int i = 0; i < kAboutDisc; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kAboutDisc;
    const Vec3 place =
        disc.middle + disc.radius * (std::cos(angle) * one + std::sin(angle) * other);
    if (left.share(place) < 0.5) ++gone;
  }
  return gone;
}

/// It goes on from what is gone beside it: moved along its normal, by half of the point's size at
/// the most, to where most about it is gone. Discs of one layer that lay in planes of their own
/// would leave threads between them.
TornDisc disc_of(const TearingPoint& point, const TissueShare& left) {
  const TornDisc straight{point.place, point.across, point.radius(), left.least_kerf()};
  TornDisc best = straight;
  int most = gone_about(best, left);
  const int steps = static_cast<int>(0.5 * point.size / left.voxel());
  for (int step = 1; step <= steps; ++step)
    for (const double sign : {-1.0, 1.0}) {
      TornDisc moved = straight;
      moved.middle += sign * step * left.voxel() * point.across;
      const int gone = gone_about(moved, left);
      if (gone <= most) continue;
      most = gone;
      best = moved;
    }
  return best;
}

/// One tear: the point that is stretched most, and from there all to which it leads. Others wait
/// for the next body: what this one relieves isn't known before.
void take_tear(const std::vector<TearingPoint>& points, OrganCut& cut) {
  std::vector<char> seen(points.size(), 0);
  std::vector<std::size_t> tear = {static_cast<std::size_t>(
      std::ranges::max_element(points, {}, &TearingPoint::stretch) - points.begin())};
  seen[tear.front()] = 1;
  const double plate = cut.gone.taken_by_plate(cut.gone.least_kerf());
  for (std::size_t i = 0; i < std::min(tear.size(), kMostDiscs); ++i) {
    const TearingPoint& point = points[tear[i]];
    const TornDisc disc = disc_of(point, cut.gone);
    const double taken = cut.gone.take_out(
        disc.reach(), [&disc](const Vec3& place) { return disc.distance(place); });
    if (taken > 0.0) {
      cut.changed = true;
      // Discs lie over each other, and beyond the skin.
      cut.torn += std::min(taken / plate, point.size * point.size);
    }
    for (std::size_t other = 0; other < points.size(); ++other)
      if (!seen[other] && point.leads_to(points[other])) {
        seen[other] = 1;
        tear.push_back(other);
      }
  }
}

}  // namespace

std::optional<PrincipalStretch> torn(const PointDeformation& point, const TearLimit& limit) {
  if (!(stretch_bound(point.gradient) >= limit.stretch)) return std::nullopt;
  if (!(point.gradient.determinant() > 0.0)) return std::nullopt;
  const PrincipalStretch most = greatest_stretch(point.gradient);
  if (!(most.stretch >= limit.stretch)) return std::nullopt;
  if (!(greatest_stress(limit.law, point, most.stretch) >= limit.stress)) return std::nullopt;
  return most;
}

double TornDisc::distance(const Vec3& place) const {
  const Vec3 way = place - middle;
  const double along = way.dot(across);
  const double beside = std::sqrt(std::max(0.0, way.squaredNorm() - along * along));
  return std::hypot(std::max(0.0, beside - radius), along) - 0.5 * thickness;
}

Box TornDisc::reach() const {
  Vec3 half;
  for (int axis = 0; axis < 3; ++axis)
    half[axis] =
        0.5 * thickness + radius * std::sqrt(std::max(0.0, 1.0 - across[axis] * across[axis]));
  return {middle - half, middle + half};
}

bool may_tear(const World& world) {
  const Pool<Cuttable>& organs = world.all<Cuttable>();
  for (std::size_t o = 0; o < organs.size(); ++o)
    if (organs[o].ultimate_strain > 0.0) return true;
  return false;
}

void tear_tissue(World& world, const FrameContext& context) {
  Pool<OrganCut>& organs = world.all<OrganCut>();
  const std::uint64_t opens_for = world.model().steps().steps_in(kOpensFor);
  for (std::size_t o = 0; o < organs.size(); ++o) {
    const Entity organ = organs.owner(o);
    OrganCut& cut = organs[o];
    const double ultimate_strain = world.find<Cuttable>(organ)->ultimate_strain;
    if (ultimate_strain == 0.0 || cut.pending) continue;
    // The shape is still that of the body before, which held.
    if (cut.due > 0 && context.frame < cut.due + opens_for) continue;
    const OrganTouch* touch = world.find<OrganTouch>(organ);
    if (!touch || world.find<OrganState>(organ)->frozen || !touch->solver->moving()) continue;
    const std::vector<TearingPoint> points =
        tearing_points(*world.find<OrganBody>(organ)->model,
                       touch->solver->state().motion.displacements, ultimate_strain, cut.gone);
    if (!points.empty()) take_tear(points, cut);
  }
}

}  // namespace viscera
