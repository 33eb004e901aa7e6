#include "engine/organ/part_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "engine/organ/recipe.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// As medical files are that don't say it [m].
constexpr double kAssumedUnit = 1e-3;
/// Of the map's moduli; a label map has a thousand.
constexpr std::size_t kMostModuli = 1u << 20;

/// Places that divide a cube's edge into three.
template <class Visit>
void in_cube(const Vec3& x, double edge, const Visit& visit) {
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = -1; k <= 1; ++k) visit(Vec3(x + edge / 3.0 * Vec3(i, j, k)));
}

SignedDistance distance_of(const Region& region) {
  switch (region.shape) {
    case Region::Shape::kHalfSpace:
      return [point = region.a, normal = region.b.normalized()](const Vec3& x) {
        return (x - point).dot(normal);
      };
    case Region::Shape::kSphere:
      return [centre = region.a, radius = region.radius](const Vec3& x) {
        return (x - centre).norm() - radius;
      };
    case Region::Shape::kBox:
      break;
  }
  return [middle = Vec3(0.5 * (region.a + region.b)),
          half = Vec3(0.5 * (region.b - region.a))](const Vec3& x) {
    const Vec3 beyond = (x - middle).cwiseAbs() - half;
    return beyond.cwiseMax(0.0).norm() + std::min(0.0, beyond.maxCoeff());
  };
}

/// Of a layer under the whole surface. A cube whose centre lies less than half an edge deep is
/// taken for what the surface leaves of a cell: a slab as thick as twice that depth.
CubeShare capsule_share(const TriangleSurface& surface, double thickness) {
  const auto tree = std::make_shared<const SurfaceTree>(surface);
  return [tree, thickness](const Vec3& x, double edge) {
    const double depth = std::max(0.0, -tree->signed_distance(x));
    if (depth < 0.5 * edge) return depth > 0.0 ? std::min(1.0, thickness / (2.0 * depth)) : 1.0;
    return std::clamp((thickness - depth) / edge + 0.5, 0.0, 1.0);
  };
}

/// Index of the voxel, and how far beyond its centre in voxels along each axis.
struct VoxelPlace {
  Eigen::Vector3i low;
  Vec3 rest;
};

VoxelPlace voxel_place(const LabelMap& map, const Mat3& to_index, const Vec3& x) {
  const Vec3 index = to_index * (x - map.origin);
  VoxelPlace place;
  for (int c = 0; c < 3; ++c) {
    const double low = std::clamp(std::floor(index[c]), -2.0, static_cast<double>(map.size[c]) + 1);
    place.low[c] = static_cast<int>(low);
    place.rest[c] = std::clamp(index[c] - low, 0.0, 1.0);
  }
  return place;
}

/// Visits the eight voxels about a place with their weights; those outside count as 0.
template <class Visit>
void about(const LabelMap& map, const VoxelPlace& place, const Visit& visit) {
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    Eigen::Vector3i at;
    bool inside = true;
    for (int c = 0; c < 3; ++c) {
      const bool high = corner >> c & 1;
      at[c] = place.low[c] + (high ? 1 : 0);
      weight *= high ? place.rest[c] : 1.0 - place.rest[c];
      inside = inside && at[c] >= 0 && at[c] < map.size[c];
    }
    if (weight > 0.0) visit(weight, inside ? map.labels[map.at(at.x(), at.y(), at.z())] : 0);
  }
}

Result<CubeShare> label_share(const LabelPart& part) {
  auto map = read_label_map(part.file, {.unit = {}, .assumed = kAssumedUnit});
  if (!map) return std::unexpected(map.error());
  if (std::ranges::find(map->labels, part.label) == map->labels.end())
    return failure(fmt::format("labels/label: found no voxel of label {} in {}, expected some",
                               part.label, part.file.string()));
  const Mat3 to_index = map->axes.inverse();
  return [map = std::make_shared<const LabelMap>(std::move(*map)), to_index, label = part.label](
             const Vec3& x, double edge) {
    double sum = 0.0;
    in_cube(x, edge, [&](const Vec3& y) {
      about(*map, voxel_place(*map, to_index, y),
            [&](double weight, std::int32_t found) { sum += found == label ? weight : 0.0; });
    });
    return sum / 27.0;
  };
}

}  // namespace

CubeShare share_inside(SignedDistance distance) {
  return [distance = std::move(distance)](const Vec3& x, double edge) {
    const double half_diagonal = 0.5 * std::sqrt(3.0) * edge, here = distance(x);
    if (here > half_diagonal) return 0.0;
    if (here < -half_diagonal) return 1.0;
    double sum = 0.0;
    in_cube(x, edge,
            [&](const Vec3& y) { sum += std::clamp(0.5 - 3.0 * distance(y) / edge, 0.0, 1.0); });
    return sum / 27.0;
  };
}

Result<CubeShare> part_share(const PartDescription& part, const TriangleSurface& surface,
                             const std::filesystem::path& assets) {
  if (const auto* capsule = std::get_if<CapsulePart>(&part.where))
    return capsule_share(surface, capsule->thickness);
  if (const auto* region = std::get_if<Region>(&part.where))
    return share_inside(distance_of(*region));
  if (const auto* labels = std::get_if<LabelPart>(&part.where)) return label_share(*labels);
  const auto* recipe = std::get_if<RecipePart>(&part.where);
  if (!recipe) return failure("found a map of moduli, expected a part with a shape");
  auto body = load_recipe(assets, recipe->name, recipe->seed);
  if (!body) return std::unexpected(body.error());
  return share_inside(std::move(body->distance));
}

ModulusMap::ModulusMap(LabelMap map, double unit)
    : map_(std::move(map)), unit_(unit), to_index_(map_.axes.inverse()) {}

Result<ModulusMap> ModulusMap::read(const std::filesystem::path& file, double unit) {
  auto map =
      read_label_map(file, {.unit = {}, .assumed = kAssumedUnit, .most_values = kMostModuli});
  if (!map) return std::unexpected(map.error());
  const auto least = std::ranges::min_element(map->labels);
  if (*least < 0)
    return failure(fmt::format("field: found the modulus {} in {}, expected none below 0", *least,
                               file.string()));
  return ModulusMap(std::move(*map), unit);
}

bool ModulusMap::known_at(const Vec3& x) const {
  const Vec3 index = to_index_ * (x - map_.origin);
  for (int c = 0; c < 3; ++c)
    if (!(index[c] >= -0.5 && index[c] <= map_.size[c] - 0.5)) return false;
  return !std::isnan(mean(x, 2.0 * map_.spacing().maxCoeff()));
}

double ModulusMap::mean(const Vec3& x, double edge) const {
  double sum = 0.0, known = 0.0;
  const auto add = [&](const Vec3& y) {
    about(map_, voxel_place(map_, to_index_, y), [&](double weight, std::int32_t value) {
      if (value == 0) return;
      sum += weight * value;
      known += weight;
    });
  };
  in_cube(x, edge, add);
  if (known == 0.0) in_cube(x, 3.0 * map_.spacing().maxCoeff(), add);
  return known > 0.0 ? unit_ * sum / known : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace viscera
