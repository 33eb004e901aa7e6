#include "engine/verification/smoke_case.h"

#include <array>
#include <cmath>
#include <numbers>

#include "engine/verification/bodies.h"
#include "kernels/base/random.h"

namespace viscera {
namespace {

constexpr double kSupport = 3e-3;            // [m]
constexpr double kSpacing = 0.5 * kSupport;  // of the particles [m]
constexpr double kEdge = 4e-3;               // of the sheet's triangles, as of an organ's [m]
constexpr double kMargin = 6e-3;             // of the sheet beyond the box [m]
constexpr double kThickness = 15e-3;         // of the sheet [m]
constexpr double kBump = 2e-3;               // height of the bumps over and under the sheet [m]
constexpr double kBumpWave = 25e-3;          // [m]
constexpr double kBreath = 0.2;              // change of that height, relative
constexpr double kBreathPeriod = 4.0;        // [s]
constexpr double kOldest = 5.0;              // age of the particles at first [s]
constexpr double kDensity = 1e-3;            // of the smoke: half a metre of it hides all [kg/m3]
constexpr double kStirring = 0.05;           // of the gas [m/s]
constexpr double kTurn = 2.0 * std::numbers::pi;

double bump(double x, double y) {
  return std::sin(kTurn / kBumpWave * x) * std::cos(kTurn / kBumpWave * y);
}

std::size_t across(std::size_t particles) {
  return static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(particles))));
}

/// A slab about the box's floor, z = 0, with its top in bumps.
TriangleSurface make_sheet(double width) {
  const double outer = width + 2.0 * kMargin;
  TriangleSurface sheet = unit_cube(static_cast<int>(std::ceil(outer / kEdge)));
  for (Vec3& vertex : sheet.vertices) {
    const bool top = vertex.z() > 0.499;
    vertex = Vec3(outer * vertex.x() + 0.5 * width, outer * vertex.y() + 0.5 * width,
                  kThickness * (vertex.z() - 0.5));
    if (top) vertex.z() += kBump * bump(vertex.x(), vertex.y());
  }
  return sheet;
}

std::vector<SurfaceTopology::Triangle> triangles_of(const TriangleSurface& surface) {
  std::vector<SurfaceTopology::Triangle> triangles;
  for (const std::array<int, 3>& t : surface.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  return triangles;
}

}  // namespace

SmokeCase::SmokeCase(std::size_t particles)
    : particles_(particles),
      width_(kSpacing * static_cast<double>(across(particles))),
      sheet_(make_sheet(width_)),
      topology_(triangles_of(sheet_)) {
  // The bumps take as much off the lattice as they leave to it, but for half a spacing.
  const double top = width_ + (1.0 + kBreath) * kBump + kSpacing;
  parameters_.domain = Box(Vec3(0.0, 0.0, -2.0 * kBump), Vec3(width_, width_, top));
  parameters_.spacing = kSupport;
  parameters_.max_particles = particles;
  parameters_.lifetime = 3600.0;
  shaft_.from = shaft_.from_before = Vec3(0.5 * width_, 0.5 * width_, 0.6 * width_);
  shaft_.to = shaft_.to_before = Vec3(0.8 * width_, -0.1, width_ + 0.1);
  shaft_.radius = 2.5e-3;
}

void SmokeCase::fill(SmokeVolume& volume) const {
  const std::size_t row = across(particles_);
  SmokeEmission emission;
  emission.particles = 1;
  emission.mass = kDensity * std::pow(kSpacing, 3);
  emission.temperature = 0.0;
  emission.speed = 0.0;
  emission.duration = kOldest;
  for (std::size_t i = 0; i < particles_; ++i) {
    const Random random(4, i);
    Vec3 at = kSpacing * Vec3(static_cast<double>(i % row) + random.uniform(0),
                              static_cast<double>(i / row % row) + random.uniform(1),
                              static_cast<double>(i / row / row) + random.uniform(2));
    at.z() += kBump * bump(at.x(), at.y()) + 0.5 * kSpacing;
    emission.position = at;
    volume.emit(emission);
  }
}

Vec3 SmokeCase::stirring(const Vec3& at) const {
  const Vec3 turn = kTurn / width_ * at;
  return kStirring * Vec3(std::sin(turn.x()) * std::cos(turn.z()), 0.0,
                          -std::cos(turn.x()) * std::sin(turn.z()));
}

SmokeSurroundings SmokeCase::around(double time) {
  const double grown = kBreath * std::sin(kTurn * time / kBreathPeriod);
  corners_.resize(sheet_.vertices.size());
  for (std::size_t v = 0; v < corners_.size(); ++v) {
    Vec3 at = sheet_.vertices[v];
    if (at.z() > -0.5 * kThickness) at.z() += grown * kBump * bump(at.x(), at.y());
    corners_[v] = at.cast<float>();
  }
  surface_ = {1, &topology_, corners_, Pose{}};
  SmokeSurroundings around;
  around.surfaces = {&surface_, 1};
  around.obstacles = {&shaft_, 1};
  return around;
}

}  // namespace viscera
