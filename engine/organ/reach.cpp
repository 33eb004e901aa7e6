#include "engine/organ/reach.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <set>

#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// What is tied to an organ pulls at its nodes this far around, in their spacings.
constexpr double kPullSpacings = 2.6;

bool near_any(const std::vector<Vec3>& points, double radius, const Vec3& x) {
  return std::any_of(points.begin(), points.end(),
                     [&](const Vec3& p) { return (p - x).squaredNorm() < radius * radius; });
}

/// Whether anything that acts on it strains it farther than linear tissue carries.
bool strains_far(const Reach& reach, const TriangleSurface& surface) {
  if (!reach.may_be_finite) return false;
  if (reach.strained_anywhere || reach.sags || !reach.moving_holds.empty()) return true;
  const Box box = bounds(surface);
  std::optional<SurfaceTree> tree;  // most tips stay clear of most organs
  const auto within = [&](const Vec3& x, double radius) {
    if (box.exteriorDistance(x) > std::max(radius, 0.0)) return false;
    if (!tree) tree.emplace(surface);
    return tree->signed_distance(x) < radius;
  };
  return std::ranges::any_of(reach.closings,
                             [&](const Reach::Tip& jaw) { return within(jaw.at, jaw.radius); }) ||
         std::ranges::any_of(reach.burns,
                             [&](const Vec3& x) { return within(x, reach.burn_radius); }) ||
         std::ranges::any_of(reach.tips, [&](const Reach::Tip& tip) {
           return !tip.closed && within(tip.at, tip.radius - kDeepPush);
         });
}

/// The bricks that hold a vertex which is asked for, in the order of their indices.
std::vector<Region> bricks_of(const TriangleSurface& surface,
                              const std::function<bool(const Vec3&)>& wanted) {
  std::set<std::array<int, 3>> bricks;
  for (const Vec3& vertex : surface.vertices) {
    std::array<int, 3> brick;
    for (int c = 0; c < 3; ++c)
      brick[static_cast<std::size_t>(c)] = static_cast<int>(std::floor(vertex[c] / kReachBrick));
    if (!bricks.contains(brick) && wanted(vertex)) bricks.insert(brick);
  }
  std::vector<Region> regions;
  for (const std::array<int, 3>& brick : bricks) {
    Region region;
    region.shape = Region::Shape::kBox;
    region.a = kReachBrick * Vec3(brick[0], brick[1], brick[2]);
    region.b = region.a + Vec3::Constant(kReachBrick);
    regions.push_back(region);
  }
  return regions;
}

const char* name_of(Region::Shape shape) {
  switch (shape) {
    case Region::Shape::kHalfSpace:
      return "half_space";
    case Region::Shape::kSphere:
      return "sphere";
    case Region::Shape::kBox:
      return "box";
  }
  return "";
}

Result<void> check_fine(const std::vector<Region>& regions, const TriangleSurface& surface) {
  Error error;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (!vertices_in({regions[i]}, surface).empty()) continue;
    const Box box = bounds(surface);
    const Vec3 low = 1e3 * box.min(), high = 1e3 * box.max();
    error.messages.push_back(fmt::format(
        "resolution/fine/{}: found a {} that holds no vertex of the surface, expected one that "
        "does; the surface reaches from ({:.0f}, {:.0f}, {:.0f}) to ({:.0f}, {:.0f}, {:.0f}) mm in "
        "the organ's own frame",
        i, name_of(regions[i].shape), low.x(), low.y(), low.z(), high.x(), high.y(), high.z()));
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

}  // namespace

void Reach::attach(const Region& region, const OrganDescription& organ) {
  attachments.push_back({region.grown(kPullSpacings * organ.resolution.finest), organ.pose});
}

bool Reach::covers(const Vec3& x) const {
  return std::ranges::any_of(
             tips, [&](const Tip& tip) { return (tip.at - x).squaredNorm() < radius * radius; }) ||
         std::any_of(attachments.begin(), attachments.end(), [&](const Attachment& attachment) {
           return attachment.region.contains(attachment.pose.to_world(x));
         });
}

std::vector<Vec3> vertices_in(const std::vector<Region>& regions, const TriangleSurface& surface) {
  std::vector<Vec3> inside;
  for (const Vec3& vertex : surface.vertices)
    if (std::any_of(regions.begin(), regions.end(),
                    [&](const Region& region) { return region.contains(vertex); }))
      inside.push_back(vertex);
  return inside;
}

Result<BodyDemand> demand_on(const OrganDescription& organ, const Tissue& tissue,
                             const Reach& reach, const TriangleSurface& surface) {
  BodyDemand demand;
  if (!organ.deformable) return demand;
  const std::vector<Region>& fine = organ.resolution.fine;
  if (auto sound = check_fine(fine, surface); !sound) return std::unexpected(sound.error());
  demand.sags = reach.sags;
  demand.weight = reach.weight;
  demand.moving_holds = reach.moving_holds;
  demand.touched =
      reach.anywhere || std::any_of(surface.vertices.begin(), surface.vertices.end(),
                                    [&](const Vec3& vertex) { return reach.covers(vertex); });
  demand.strained = demand.touched && strains_far(reach, surface);
  if (!demand.elastic()) return demand;
  demand.fine =
      fine.empty() ? bricks_of(surface, [&](const Vec3& x) { return reach.covers(x); }) : fine;
  if (!demand.touched || !reach.stiffens || !tissue.thermal || reach.burn_radius == 0.0)
    return demand;
  demand.burnt =
      fine.empty()
          ? bricks_of(surface,
                      [&](const Vec3& x) { return near_any(reach.burns, reach.burn_radius, x); })
          : fine;
  if (!demand.burnt.empty()) demand.burn_depth = reach.burn_radius;
  return demand;
}

Response response_of(const OrganDescription& organ, const BodyDemand& demand) {
  if (organ.response != Response::kAuto) return organ.response;
  return demand.strained ? Response::kFinite : Response::kLinear;
}

}  // namespace viscera
