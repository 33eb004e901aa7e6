#include "engine/verification/ring_organ.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

constexpr double kRing = 0.03, kTube = 0.01;  // radii [m]
constexpr double kYoungs = 5e3, kPoisson = 0.45;

struct RingPoint {
  Vec3 position, normal;
};

RingPoint ring_point(double around, double across) {
  const Vec3 outward(std::cos(around), std::sin(around), 0.0);
  RingPoint point;
  point.normal = std::cos(across) * outward + std::sin(across) * Vec3::UnitZ();
  point.position = kRing * outward + kTube * point.normal;
  return point;
}

double angle(int i, int count) {
  return 2.0 * std::numbers::pi * i / count;
}

/// Displacement per force at this offset [m/N].
Mat3 kelvin(const Vec3& offset, double blunt) {
  const double r2 = offset.squaredNorm() + blunt * blunt;
  const double shear = kYoungs / (2.0 * (1.0 + kPoisson));
  const double factor = 1.0 / (16.0 * std::numbers::pi * shear * (1.0 - kPoisson) * std::sqrt(r2));
  return factor * ((3.0 - 4.0 * kPoisson) * Mat3::Identity() + offset * offset.transpose() / r2);
}

TriangleSurface ring_surface(int around, int across) {
  TriangleSurface surface;
  const auto index = [&](int i, int j) { return (i % around) * across + j % across; };
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      surface.vertices.push_back(ring_point(angle(i, around), angle(j, across)).position);
      surface.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      surface.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  }
  return surface;
}

SurfacePlaces ring_places(int around, int across) {
  SurfacePlaces places;
  // The greatest distance between neighbours: that of the outer rim, or along the tube.
  const double spacing =
      2.0 * std::numbers::pi * std::max((kRing + kTube) / around, kTube / across);
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const RingPoint point = ring_point(angle(i, around), angle(j, across));
      places.positions.push_back(point.position);
      places.normals.push_back(point.normal);
      places.areas.push_back(spacing * spacing);
      places.spacings.push_back(spacing);
    }
  }
  return places;
}

SurfaceCompliance ring_compliance(const SurfacePlaces& places, int touchable) {
  SurfaceCompliance compliance;
  compliance.places = places.size();
  const auto count = static_cast<std::size_t>(touchable);
  for (std::size_t t = 0; t < count; ++t) {
    compliance.touchable.push_back(static_cast<int>(t * places.size() / count));
  }
  const std::size_t rows = compliance.rows();
  compliance.columns.resize(rows * 3 * count);
  parallel_for_each_index(count, 1, [&](std::size_t t) {
    const auto at = static_cast<std::size_t>(compliance.touchable[t]);
    for (std::size_t p = 0; p < places.size(); ++p) {
      const Mat3 response = kelvin(places.positions[p] - places.positions[at], places.spacings[at]);
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
          compliance.columns[(3 * t + b) * rows + 3 * p + a] =
              static_cast<float>(response(static_cast<int>(a), static_cast<int>(b)));
        }
      }
    }
  });
  return compliance;
}

}  // namespace

std::unique_ptr<RingOrgan> make_ring_organ(const RingSize& size) {
  auto organ = std::make_unique<RingOrgan>();
  organ->surface = ring_surface(size.vertices_around, size.vertices_across);
  organ->places = ring_places(size.places_around, size.places_across);
  organ->compliance = ring_compliance(organ->places, size.touchable);
  organ->drawn = carry_surface(organ->surface, organ->places);
  return organ;
}

}  // namespace viscera
