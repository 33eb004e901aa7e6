// Fields to good triangles: marching tetrahedra, then isotropic remeshing on the zero set.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "engine/organ/figures_text.h"
#include "engine/organ/isosurface.h"
#include "engine/organ/mesh_editor.h"
#include "engine/organ/shape.h"

namespace viscera {
namespace {

constexpr double kOnSurface = 1e-4;  // of an edge; the promise is ten times this
constexpr double kCrumb = 0.01;      // share of the volume under which a piece is dropped
constexpr int kMostCellsAcross = 1500;

// Newton steps along the gradient, which is measured anew only where it has stopped helping.
class ZeroSet {
 public:
  ZeroSet(SignedDistance distance, double edge) : distance_(std::move(distance)), edge_(edge) {}

  Vec3 operator()(const Vec3& start) const {
    const double tolerance = kOnSurface * edge_;
    Vec3 x = start, best = start, gradient = Vec3::Zero();
    double f = distance_(x), least = std::abs(f), previous = 0.0;
    for (int step = 0; step < 12 && std::abs(f) > tolerance; ++step) {
      if (step == 0 || std::abs(f) > 0.2 * std::abs(previous)) gradient = slope(x, f);
      const double length2 = gradient.squaredNorm();
      if (!(length2 > 1e-6)) break;
      Vec3 move = -f / length2 * gradient;
      // Where the field has a crease, full steps may swing from one side to the other.
      const double limit = step < 4 ? edge_ : 0.1 * edge_;
      if (move.norm() > limit) move *= limit / move.norm();
      x += move;
      previous = f;
      f = distance_(x);
      if (std::abs(f) < least) least = std::abs(f), best = x;
    }
    return best;
  }

 private:
  Vec3 slope(const Vec3& x, double f) const {
    const double h = 1e-3 * edge_;
    Vec3 gradient;
    for (int axis = 0; axis < 3; ++axis) {
      gradient[axis] = (distance_(x + h * Vec3::Unit(axis)) - f) / h;
    }
    return gradient;
  }

  SignedDistance distance_;
  double edge_;
};

Result<TriangleSurface> one_piece(const TriangleSurface& surface) {
  std::vector<TriangleSurface> pieces = pieces_of(surface);
  const double whole = volume(pieces.front());
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    const double part = volume(pieces[i]);
    if (std::abs(part) < kCrumb * whole) continue;
    const Vec3 centre = bounds(pieces[i]).center();
    char text[160];
    std::snprintf(text, sizeof text,
                  "found %s of %.3g %% of the volume about (%.1f, %.1f, %.1f mm), expected one "
                  "solid piece",
                  part > 0.0 ? "a second piece" : "a cavity", 100.0 * std::abs(part) / whole,
                  1e3 * centre.x(), 1e3 * centre.y(), 1e3 * centre.z());
    return failure(text);
  }
  return std::move(pieces.front());
}

}  // namespace

Result<TriangleSurface> mesh_signed_distance(const SignedDistance& distance, const Box& box,
                                             double edge, double cell) {
  if (box.isEmpty()) return failure("found an empty box, expected one that encloses the body");
  const Vec3 size = box.sizes();
  if (!(edge > 0.0) || !(edge < size.minCoeff())) {
    return failure("found an edge of " + millimetres(edge) +
                   ", expected more than 0 and less than " + millimetres(size.minCoeff()) +
                   ", the least side of the body's box");
  }
  if (size.maxCoeff() / edge > kMostCellsAcross) {
    return failure("found an edge of " + millimetres(edge) + ", expected at least " +
                   millimetres(size.maxCoeff() / kMostCellsAcross) + " for a body of " +
                   millimetres(size.maxCoeff()));
  }
  cell = std::min({cell, 0.8 * edge, size.minCoeff() / 12.0});
  const Result<TriangleSurface> rough = marching_tetrahedra(distance, box, cell);
  if (!rough) return rough;
  const Result<TriangleSurface> body = one_piece(*rough);
  if (!body) return body;
  MeshEditor mesh(*body, ZeroSet(distance, edge), false);
  remesh(mesh, edge, 6);
  mesh.project_all();
  return mesh.surface();
}

Result<TriangleSurface> with_triangle_count(const TriangleSurface& surface, int triangles,
                                            const SignedDistance& distance) {
  if (triangles < 20 || triangles % 2 != 0) {
    return failure("found " + std::to_string(triangles) +
                   " triangles, expected an even number of at least 20 (closed surfaces of "
                   "triangles have an even number)");
  }
  double edge = std::sqrt(4.0 / std::sqrt(3.0) * area(surface) / triangles);
  MeshEditor mesh(surface, ZeroSet(distance, edge), false);
  for (int attempt = 0; attempt < 4; ++attempt) {
    remesh(mesh, edge, attempt == 0 ? 6 : 3);
    const double ratio = static_cast<double>(mesh.triangle_count()) / triangles;
    if (std::abs(ratio - 1.0) < 0.03) break;
    edge *= std::sqrt(ratio);
  }
  if (!reach_triangle_count(mesh, triangles)) {
    return failure("found a body that can't be made of " + std::to_string(triangles) +
                   " triangles, expected more of them");
  }
  mesh.project_all();
  return mesh.surface();
}

}  // namespace viscera
