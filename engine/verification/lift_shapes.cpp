#include "engine/verification/lift_shapes.h"

#include <cmath>
#include <numbers>

#include "engine/verification/bodies.h"

namespace viscera {
namespace {

const Vec3 kHalfAxes(45e-3, 17.5e-3, 17.5e-3);  // [m]
constexpr double kHeldBelow = -15e-3;           // along x [m]
constexpr int kGripPoints = 10;

/// On the surface: the far pole's surroundings, some 12 mm across.
std::vector<Vec3> pole_points() {
  std::vector<Vec3> points;
  for (int i = 0; i < kGripPoints; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / (kGripPoints / 2.0);
    const double x = i < kGripPoints / 2 ? 0.95 : 0.98;
    const double r = std::sqrt(1.0 - x * x);
    points.push_back(kHalfAxes.cwiseProduct(Vec3(x, r * std::cos(angle), r * std::sin(angle))));
  }
  return points;
}

std::vector<double> even_lines(double length, int parts) {
  std::vector<double> lines;
  for (int i = 0; i <= parts; ++i) lines.push_back(length * (double(i) / parts - 0.5));
  return lines;
}

/// A block about the origin, held at its least x, moved at places spread over its other end.
LiftShape block(const Vec3& size, int across, bool holds_mean) {
  const int along = static_cast<int>(std::lround(across * size.x() / size.z()));
  LiftShape shape;
  shape.surface = lined_box(even_lines(size.x(), along), even_lines(size.y(), across),
                            even_lines(size.z(), across));
  const double end = 0.5 * size.x();
  shape.is_held = [end](const Vec3& x) { return x.x() < -end * (1.0 - 1e-6); };
  constexpr int kSide = 7;
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j)
      shape.grip.emplace_back(end, size.y() * ((i + 0.5) / kSide - 0.5),
                              size.z() * ((j + 0.5) / kSide - 0.5));
  shape.holds_mean = holds_mean;
  return shape;
}

/// A pipe along x about the origin, held and moved as a block; its grip on the rim's middle.
LiftShape pipe(double length, double inner, double outer, int along, int around) {
  LiftShape shape;
  TriangleSurface& surface = shape.surface;
  // A closed outline (x, r), counter-clockwise seen with r upwards: out along the bore, the rim,
  // back outside, the other rim.
  std::vector<Vec2> outline;
  for (int i = 0; i < along; ++i) outline.emplace_back(length * (0.5 - double(i) / along), outer);
  outline.emplace_back(-0.5 * length, outer);
  outline.emplace_back(-0.5 * length, 0.5 * (inner + outer));
  for (int i = 0; i <= along; ++i) outline.emplace_back(length * (double(i) / along - 0.5), inner);
  outline.emplace_back(0.5 * length, 0.5 * (inner + outer));
  const int places = static_cast<int>(outline.size());
  for (const Vec2& at : outline)
    for (int j = 0; j < around; ++j) {
      const double angle = 2.0 * std::numbers::pi * j / around;
      surface.vertices.emplace_back(at.x(), at.y() * std::cos(angle), at.y() * std::sin(angle));
    }
  const auto vertex = [&](int i, int j) { return i % places * around + j % around; };
  for (int i = 0; i < places; ++i)
    for (int j = 0; j < around; ++j) {
      surface.triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
      surface.triangles.push_back({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
    }
  const double end = 0.5 * length;
  shape.is_held = [end](const Vec3& x) { return x.x() < -end * (1.0 - 1e-6); };
  for (int j = 0; j < kGripPoints; ++j) {
    const double angle = 2.0 * std::numbers::pi * j / kGripPoints, r = 0.5 * (inner + outer);
    shape.grip.emplace_back(end, r * std::cos(angle), r * std::sin(angle));
  }
  return shape;
}

}  // namespace

TriangleSurface ellipsoid(const Vec3& half_axes, int rings) {
  TriangleSurface surface;
  const int around = 2 * rings;
  const auto place = [&](double polar, double angle) -> Vec3 {
    return half_axes.cwiseProduct(Vec3(std::cos(polar), std::sin(polar) * std::cos(angle),
                                       std::sin(polar) * std::sin(angle)));
  };
  surface.vertices.push_back(place(0.0, 0.0));
  for (int ring = 1; ring < rings; ++ring)
    for (int i = 0; i < around; ++i)
      surface.vertices.push_back(place(std::numbers::pi * ring / rings,
                                       2.0 * std::numbers::pi * (i + 0.5 * (ring % 2)) / around));
  surface.vertices.push_back(place(std::numbers::pi, 0.0));
  const int last = static_cast<int>(surface.vertices.size()) - 1;
  const auto at = [&](int ring, int i) { return 1 + (ring - 1) * around + (i + around) % around; };
  for (int i = 0; i < around; ++i) surface.triangles.push_back({0, at(1, i), at(1, i + 1)});
  for (int ring = 1; ring + 1 < rings; ++ring)
    for (int i = 0; i < around; ++i) {
      if (ring % 2 == 0) {
        surface.triangles.push_back({at(ring, i), at(ring + 1, i), at(ring, i + 1)});
        surface.triangles.push_back({at(ring, i + 1), at(ring + 1, i), at(ring + 1, i + 1)});
      } else {
        surface.triangles.push_back({at(ring, i), at(ring + 1, i), at(ring + 1, i + 1)});
        surface.triangles.push_back({at(ring, i), at(ring + 1, i + 1), at(ring, i + 1)});
      }
    }
  for (int i = 0; i < around; ++i)
    surface.triangles.push_back({last, at(rings - 1, i + 1), at(rings - 1, i)});
  return surface;
}

LiftShape lift_shape(LiftedShape shape) {
  switch (shape) {
    case LiftedShape::kBar:
      return block(Vec3(80e-3, 20e-3, 20e-3), 8, false);
    case LiftedShape::kSlenderBar:
      return block(Vec3(100e-3, 5e-3, 5e-3), 4, true);
    case LiftedShape::kTube:
      return pipe(80e-3, 7e-3, 10e-3, 26, 24);
    case LiftedShape::kGallbladder:
      break;
  }
  return {ellipsoid(kHalfAxes, 24), [](const Vec3& x) { return x.x() < kHeldBelow; }, pole_points(),
          false};
}

}  // namespace viscera
