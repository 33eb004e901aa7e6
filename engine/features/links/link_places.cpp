#include "engine/features/links/link_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/base/thin_out.h"

namespace viscera {
namespace {

/// Samples of a surface lie a region's width over this apart.
constexpr double kSamplesAcross = 24.0;
constexpr int kMostSplits = 32;  // of a triangle's edge
constexpr std::size_t kMostSamples = 2000;
/// Normals whose product is below this face each other.
constexpr double kFacing = -0.2;
/// Springs whose ends are nearer than this at either organ would be one [m].
constexpr double kLeastApart = 2e-4;
constexpr int kEvenings = 8;

struct Sample {
  Vec3 position, normal;
};

struct Patch {
  std::vector<Sample> samples;
  double area = 0.0;
};

Box box_of(const Region& region) {
  if (region.shape == Region::Shape::kBox) return {region.a, region.b};
  const Vec3 r = Vec3::Constant(region.radius);
  return {region.a - r, region.a + r};
}

/// Evenly split triangles' centres inside the region; world.
Patch patch_in(const Region& region, const TriangleSurface& surface, const Pose& pose) {
  const Box box = box_of(region);
  const double pitch = box.sizes().maxCoeff() / kSamplesAcross;
  const std::vector<Vec3> normals = vertex_normals(surface);
  Patch patch;
  for (const auto& corners : surface.triangles) {
    std::array<Vec3, 3> x, n;
    Box around;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto v = static_cast<std::size_t>(corners[c]);
      x[c] = pose.to_world(surface.vertices[v]);
      n[c] = pose.direction_to_world(normals[v]);
      around.extend(x[c]);
    }
    if (!box.intersects(around)) continue;
    const Vec3 ab = x[1] - x[0], ac = x[2] - x[0];
    const double longest = std::max({ab.norm(), ac.norm(), (x[2] - x[1]).norm()});
    const int splits = std::clamp(static_cast<int>(std::ceil(longest / pitch)), 1, kMostSplits);
    const double area = 0.5 * ab.cross(ac).norm() / (splits * splits);
    const auto add = [&](double i, double j) {
      const double b = i / splits, c = j / splits;
      const Vec3 at = x[0] + b * ab + c * ac;
      if (!region.contains(at)) return;
      patch.samples.push_back({at, ((1.0 - b - c) * n[0] + b * n[1] + c * n[2]).normalized()});
      patch.area += area;
    };
    for (int i = 0; i < splits; ++i)
      for (int j = 0; i + j < splits; ++j) {
        add(i + 1.0 / 3.0, j + 1.0 / 3.0);
        if (i + j + 1 < splits) add(i + 2.0 / 3.0, j + 2.0 / 3.0);
      }
  }
  thin_out(patch.samples, kMostSamples);
  return patch;
}

using Spring = LinkPlaces::Spring;

std::vector<Spring> pairs(const std::vector<Sample>& first, const std::vector<Sample>& second) {
  std::vector<Spring> all, facing;
  for (const Sample& a : first) {
    const Sample* nearest = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const Sample& b : second) {
      const double distance = (b.position - a.position).squaredNorm();
      if (distance >= least) continue;
      least = distance;
      nearest = &b;
    }
    const Spring spring{{a.position, nearest->position}, {a.normal, nearest->normal}};
    all.push_back(spring);
    if (a.normal.dot(nearest->normal) < kFacing) facing.push_back(spring);
  }
  return facing.empty() ? all : facing;
}

Vec3 middle(const Spring& spring) {
  return 0.5 * (spring.positions[0] + spring.positions[1]);
}

std::size_t nearest_to(const Vec3& x, const std::vector<Spring>& springs) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const double distance = (middle(springs[i]) - x).squaredNorm();
    if (distance >= least) continue;
    least = distance;
    best = i;
  }
  return best;
}

/// Far from each other first, then each to the middle of those that are nearest to it.
std::vector<Spring> spread(const std::vector<Spring>& candidates) {
  Vec3 mean = Vec3::Zero();
  for (const Spring& c : candidates) mean += middle(c);
  mean /= static_cast<double>(candidates.size());
  std::vector<Vec3> centres = {middle(candidates[nearest_to(mean, candidates)])};
  std::vector<double> off(candidates.size(), std::numeric_limits<double>::infinity());
  while (centres.size() < kMostSprings) {
    std::size_t farthest = 0;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      off[i] = std::min(off[i], (middle(candidates[i]) - centres.back()).norm());
      if (off[i] > off[farthest]) farthest = i;
    }
    if (off[farthest] < kLeastApart) break;
    centres.push_back(middle(candidates[farthest]));
  }
  for (int pass = 0; pass < kEvenings; ++pass) {
    std::vector<Vec3> sums(centres.size(), Vec3::Zero());
    std::vector<double> counts(centres.size(), 0.0);
    for (const Spring& candidate : candidates) {
      std::size_t own = 0;
      for (std::size_t c = 1; c < centres.size(); ++c)
        if ((middle(candidate) - centres[c]).squaredNorm() <
            (middle(candidate) - centres[own]).squaredNorm())
          own = c;
      sums[own] += middle(candidate);
      counts[own] += 1.0;
    }
    for (std::size_t c = 0; c < centres.size(); ++c)
      if (counts[c] > 0.0) centres[c] = sums[c] / counts[c];
  }
  std::vector<Spring> chosen;
  for (const Vec3& centre : centres) {
    const Spring& spring = candidates[nearest_to(centre, candidates)];
    const bool apart = std::all_of(chosen.begin(), chosen.end(), [&](const Spring& other) {
      return (spring.positions[0] - other.positions[0]).norm() > kLeastApart &&
             (spring.positions[1] - other.positions[1]).norm() > kLeastApart;
    });
    if (apart) chosen.push_back(spring);
  }
  return chosen;
}

std::string region_text(const Region& region) {
  const auto mm = [](const Vec3& v) {
    return fmt::format("[{:g}, {:g}, {:g}]", 1e3 * v.x(), 1e3 * v.y(), 1e3 * v.z());
  };
  if (region.shape == Region::Shape::kSphere)
    return fmt::format("a ball of {:g} mm about {} mm", 1e3 * region.radius, mm(region.a));
  return fmt::format("a box from {} to {} mm", mm(region.a), mm(region.b));
}

/// The error of a region that holds no surface of an organ: how far away that is.
Error nothing_there(const SceneDescription& scene, std::size_t link, std::size_t organ,
                    const TriangleSurface& surface) {
  const LinkDescription& tie = links_of(scene)[link];
  const Box box = box_of(tie.region);
  Vec3 nearest = Vec3::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : surface.vertices) {
    const Vec3 at = scene.organs[organ].pose.to_world(vertex);
    const double distance = (at - box.center()).norm();
    if (distance >= least) continue;
    least = distance;
    nearest = at;
  }
  Error error;
  error.messages.push_back(fmt::format(
      "{}: links/{}/region: found {} without any surface of organ \"{}\", expected some; the "
      "organ's nearest vertex is at [{:.1f}, {:.1f}, {:.1f}] mm",
      scene.file.string(), link, region_text(tie.region), scene.organs[organ].name,
      1e3 * nearest.x(), 1e3 * nearest.y(), 1e3 * nearest.z()));
  return error;
}

}  // namespace

Result<LinkPlaces> place_springs(const SceneDescription& scene, std::size_t link,
                                 std::span<const TriangleSurface* const> surfaces) {
  const LinkDescription& tie = links_of(scene)[link];
  std::array<Patch, 2> patches;
  Error missing;
  for (std::size_t end = 0; end < 2; ++end)
    for (std::size_t o = 0; o < scene.organs.size(); ++o) {
      if (scene.organs[o].name != tie.between[end]) continue;
      patches[end] = patch_in(tie.region, *surfaces[o], scene.organs[o].pose);
      if (patches[end].samples.empty())
        missing.messages.push_back(nothing_there(scene, link, o, *surfaces[o]).messages.front());
    }
  if (!missing.messages.empty()) return std::unexpected(missing);
  for (std::size_t end = 0; end < 2; ++end)
    if (tie.between[end] == LinkDescription::kGround) {
      patches[end] = patches[1 - end];
      for (Sample& sample : patches[end].samples) sample.normal = -sample.normal;
    }
  LinkPlaces places;
  places.springs = spread(pairs(patches[0].samples, patches[1].samples));
  places.areas = {patches[0].area, patches[1].area};
  return places;
}

}  // namespace viscera
