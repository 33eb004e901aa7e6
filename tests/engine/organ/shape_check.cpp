#include "tests/engine/organ/shape_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/organ/mesh_editor.h"
#include "kernels/base/hash.h"
#include "kernels/points/surface_checks.h"
#include "tests/support/paths.h"

namespace viscera::test {

TriangleSurface built(const RecipeGeometry& geometry) {
  auto surface = build_shape(geometry, project_file("assets"));
  if (surface) return *surface;
  ADD_FAILURE() << surface.error().text();
  return {};
}

std::string defects(const TriangleSurface& surface) {
  std::string all;
  for (const std::string& defect : surface_defects(surface)) all += defect + "\n";
  return all;
}

double least_angle_degrees(const TriangleSurface& surface) {
  double least = 180.0;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto& x = surface.vertices;
    least = std::min(least, least_angle(x[a], x[b], x[c]) * 180.0 / std::numbers::pi);
  }
  return least;
}

double mean_edge(const TriangleSurface& surface) {
  return std::sqrt(4.0 / std::sqrt(3.0) * area(surface) /
                   static_cast<double>(surface.triangles.size()));
}

double greatest_offset(const TriangleSurface& surface, const SignedDistance& distance) {
  double greatest = 0.0;
  for (const Vec3& x : surface.vertices) greatest = std::max(greatest, std::abs(distance(x)));
  return greatest;
}

std::string content_hash(const TriangleSurface& surface) {
  Hasher hasher;
  for (const Vec3& x : surface.vertices) hasher.bytes(x.data(), 3 * sizeof(double));
  for (const auto& t : surface.triangles) hasher.bytes(t.data(), 3 * sizeof(int));
  return hasher.hex();
}

}  // namespace viscera::test
