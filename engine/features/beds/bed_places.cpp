#include "engine/features/beds/bed_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace viscera {
namespace {

/// Shares of cells in a bond's opening reach so far, in distances of cells.
constexpr double kReach = 1.9;
/// Bonds within so many of their distances are beside each other.
constexpr double kNeighbours = 1.9;
/// Cells lie no farther apart than this [m].
constexpr double kCoarsest = 10e-3;
/// Away from the bed nothing is kept: patches there are wide [m].
constexpr double kElsewhere = 10e-3, kMargin = 5e-3;
/// Surfaces that face each other less than this (cosine) aren't bonded.
constexpr double kFacing = -0.2;

class BedPlacing {
 public:
  BedPlacing(const BedDescription& bed, std::array<const OrganModel*, 2> organs,
             std::array<Pose, 2> poses, std::size_t first)
      : bed_(bed),
        one_(*organs[first]),
        other_(*organs[1 - first]),
        pose_(poses[first]),
        other_pose_(poses[1 - first]),
        finder_(one_.surface, one_.rest_positions),
        other_finder_(other_.surface, other_.rest_positions) {}

  /// A patch of the first organ, and its place on the second.
  struct Pair {
    SurfacePatch one, other;
  };
  std::vector<Pair> pairs(const std::function<double(const Vec3&)>& pitch) const {
    const Region about = bed_.region.grown(kMargin);
    std::vector<Pair> found;
    for (const SurfacePatch& patch :
         patches_of(one_.surface, one_.rest_normals, finder_, [&](const Vec3& place) {
           return about.contains(pose_.to_world(place)) ? pitch(place) : kElsewhere;
         }))
      if (const auto other = opposite(patch)) found.push_back({patch, *other});
    return found;
  }

  double nodes_apart(const Vec3& place) const {
    if (one_.touchable.spacings.empty()) return kCoarsest;
    return std::min(kCoarsest, spacing_at(one_.touchable, place));
  }

  /// Of the surfaces in the region, for a message [m]; none: one has no surface there.
  std::optional<double> nearest() const {
    std::optional<double> least;
    for (const Vec3& vertex : one_.surface.vertices) {
      const Vec3 at = pose_.to_world(vertex);
      if (!bed_.region.contains(at)) continue;
      const auto hit = other_finder_.closest(other_pose_.to_local(at), 1.0);
      if (hit && (!least || hit->distance < *least)) least = hit->distance;
    }
    return least;
  }

 private:
  std::optional<SurfacePatch> opposite(const SurfacePatch& patch) const {
    const Vec3 at = pose_.to_world(patch.position);
    if (!bed_.region.contains(at)) return std::nullopt;
    const auto hit = other_finder_.closest(other_pose_.to_local(at), bed_.within);
    if (!hit) return std::nullopt;
    SurfacePatch other =
        patch_at(hit->point, patch.area, other_.surface, other_.rest_normals, other_finder_);
    if (!(pose_.direction_to_world(patch.normal).dot(other_pose_.direction_to_world(other.normal)) <
          kFacing))
      return std::nullopt;
    return other;
  }

  const BedDescription& bed_;
  const OrganModel &one_, &other_;
  Pose pose_, other_pose_;
  CollisionSurface finder_, other_finder_;
};

}  // namespace

Result<BedPlaces> place_bed(const SceneDescription& scene, std::size_t bed,
                            std::array<const OrganModel*, 2> organs, std::array<Pose, 2> poses,
                            std::size_t first) {
  const BedDescription& description = beds_of(scene)[bed];
  const BedPlacing placing(description, organs, poses, first);
  const auto bonds = placing.pairs([&](const Vec3&) { return description.pitch; });
  const auto cells = placing.pairs(
      [&](const Vec3& place) { return std::max(description.pitch, placing.nodes_apart(place)); });
  if (bonds.empty() || cells.empty()) {
    const std::optional<double> nearest = placing.nearest();
    return failure(fmt::format(
        "{}: beds/{}/region: found {}, expected surfaces of \"{}\" and \"{}\" that face each other "
        "there, at most {:g} mm apart (within_mm)",
        scene.file.string(), bed,
        nearest ? fmt::format("none nearer than {:.1f} mm", 1e3 * *nearest)
                : fmt::format("no surface of \"{}\"", description.between[first]),
        description.between[0], description.between[1], 1e3 * description.within));
  }
  BedPlaces places;
  std::vector<Vec3> normals, middles;
  double widest = 0.0;
  for (const auto& cell : cells) {
    places.cells[first].push_back(cell.one);
    places.cells[1 - first].push_back(cell.other);
    middles.push_back(cell.one.position);
    widest = std::max(widest, placing.nodes_apart(cell.one.position));
  }
  for (const auto& bond : bonds) {
    places.points[first].push_back(bond.one.point);
    places.points[1 - first].push_back(bond.other.point);
    places.ends[first].push_back(bond.one.position);
    places.ends[1 - first].push_back(bond.other.position);
    places.layer.areas.push_back(bond.one.area);
    normals.push_back(bond.one.normal);
  }
  places.layer.law = description.law;
  if (description.film) {
    places.layer.film = *description.film;
    places.layer.edges = layer_edges(places.ends[first], normals, places.layer.areas,
                                     kNeighbours * description.pitch);
  }
  places.layer.cells = cells.size();
  places.first = first;
  places.reach = kReach * std::max(widest, description.pitch);
  places.layer.shares = bond_shares(places.ends[first], normals, middles, places.reach);
  return places;
}

}  // namespace viscera
