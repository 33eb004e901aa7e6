#include "engine/features/touching/meeting_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/features/contact/tissue_sheet.h"
#include "engine/features/touching/chosen_places.h"
#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// Places of a circle that a patch's height is averaged over.
constexpr int kPlaces = 6;
/// A triangle's edge is divided into so many parts at most.
constexpr int kMostParts = 32;
/// Normals between vertices hold where the triangle's own is no farther from them (20 degrees): at
/// an edge they point to neither face.
constexpr double kSmooth = 0.94;

Vec3 mean_normal(const TriangleSurface& surface, std::span<const Vec3f> normals,
                 const SurfacePoint& point) {
  const Vec3 sum = corner_mean(normals, surface, point);
  const double length = sum.norm();
  const Vec3 flat = face_normal(surface, point.triangle);
  return length > 0.0 && sum.dot(flat) > kSmooth * length ? Vec3(sum / length) : flat;
}

}  // namespace

Vec3 face_normal(const TriangleSurface& surface, int triangle) {
  const Vec3 across = area_vector(surface, triangle);
  const double length = across.norm();
  return length > 0.0 ? Vec3(across / length) : Vec3::UnitZ();
}

SurfacePatch patch_at(const SurfacePoint& point, double area, const TriangleSurface& surface,
                      std::span<const Vec3f> normals, const CollisionSurface& finder) {
  SurfacePatch patch{point, position(surface, point), mean_normal(surface, normals, point), area,
                     0.0};
  const double radius = std::sqrt(area / std::numbers::pi);
  // A disc's mean of the distance squared from its middle.
  const double ring = radius / std::numbers::sqrt2;
  const Vec3 first = patch.normal.unitOrthogonal(), second = patch.normal.cross(first);
  double sum = 0.0;
  int found = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kPlaces;
    const Vec3 about = patch.position + ring * (std::cos(angle) * first + std::sin(angle) * second);
    const auto hit = finder.closest(about, radius);
    if (!hit || face_normal(surface, hit->point.triangle).dot(patch.normal) < kSameFace) continue;
    sum += (hit->position - patch.position).dot(patch.normal);
    ++found;
  }
  if (found > 0) patch.height = sum / found;
  return patch;
}

namespace {

/// A bit of the surface.
struct Bit {
  SurfacePoint point;
  Vec3 position = Vec3::Zero(), normal = Vec3::UnitZ();
  double area = 0.0;
};

/// Each triangle in equal parts, no edge of them longer than half the pitch there.
std::vector<Bit> bits_of(const TriangleSurface& surface, std::span<const double> pitch) {
  std::vector<Bit> bits;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    double longest = 0.0, apart = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto a = static_cast<std::size_t>(surface.triangles[t][c]);
      const auto b = static_cast<std::size_t>(surface.triangles[t][(c + 1) % 3]);
      longest = std::max(longest, (surface.vertices[a] - surface.vertices[b]).norm());
      apart = apart == 0.0 ? pitch[a] : std::min(apart, pitch[a]);
    }
    const int parts = std::clamp(static_cast<int>(std::ceil(2.0 * longest / apart)), 1, kMostParts);
    const double area = area_vector(surface, static_cast<int>(t)).norm() / (parts * parts);
    const Vec3 normal = face_normal(surface, static_cast<int>(t));
    for (int i = 0; i < parts; ++i)
      for (int j = 0; j < parts - i; ++j)
        for (const int up : {0, 1}) {
          if (up == 1 && i + j + 1 == parts) continue;
          const double third = up == 1 ? 2.0 / 3.0 : 1.0 / 3.0;
          const double x = (i + third) / parts, y = (j + third) / parts;
          const SurfacePoint point{static_cast<int>(t), Vec3(1.0 - x - y, x, y)};
          bits.push_back({point, position(surface, point), normal, area});
        }
  }
  return bits;
}

}  // namespace

std::vector<SurfacePatch> patches_of(const TriangleSurface& surface, std::span<const Vec3f> normals,
                                     const CollisionSurface& finder,
                                     const std::function<double(const Vec3&)>& pitch) {
  std::vector<double> apart;
  for (const Vec3& vertex : surface.vertices) apart.push_back(pitch(vertex));
  const double widest = apart.empty() ? 0.0 : *std::ranges::max_element(apart);
  if (!(widest > 0.0)) return {};
  const std::vector<Bit> bits = bits_of(surface, apart);
  // A patch doesn't go around an edge: one that did would lie as deep as its mean place, and touch
  // only once the edge had sunk in so far.
  ChosenPlaces chosen(widest);
  std::vector<std::size_t> middles;
  for (std::size_t b = 0; b < bits.size(); ++b) {
    const std::array<int, 3>& corners =
        surface.triangles[static_cast<std::size_t>(bits[b].point.triangle)];
    double here = 0.0;
    for (std::size_t c = 0; c < 3; ++c)
      here += bits[b].point.weights[static_cast<Eigen::Index>(c)] *
              apart[static_cast<std::size_t>(corners[c])];
    if (chosen.nearest(bits[b].position, bits[b].normal, here) >= 0) continue;
    chosen.add(bits[b].position, bits[b].normal, static_cast<int>(middles.size()));
    middles.push_back(b);
  }
  std::vector<double> areas(middles.size(), 0.0);
  for (const Bit& bit : bits)
    if (const int owner = chosen.nearest(bit.position, bit.normal, widest); owner >= 0)
      areas[static_cast<std::size_t>(owner)] += bit.area;
  std::vector<SurfacePatch> patches(middles.size());
  parallel_for_each_index(middles.size(), 64, [&](std::size_t i) {
    patches[i] = patch_at(bits[middles[i]].point, areas[i], surface, normals, finder);
  });
  std::erase_if(patches, [](const SurfacePatch& patch) { return !(patch.area > 0.0); });
  return patches;
}

}  // namespace viscera
