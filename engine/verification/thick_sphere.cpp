#include "engine/verification/thick_sphere.h"

#include <cmath>
#include <numbers>

namespace viscera {

PressurisedSphere::PressurisedSphere(const IsotropicMaterial& material, double inner, double outer)
    : material_(material) {
  const double a3 = std::pow(inner, 3), b3 = std::pow(outer, 3);
  const double pressure = 0.1 * material.youngs_modulus;
  uniform_ =
      pressure * a3 * (1.0 - 2.0 * material.poisson_ratio) / ((b3 - a3) * material.youngs_modulus);
  radial_ = pressure * a3 * b3 / (4.0 * material.shear_modulus() * (b3 - a3));
}

StaticLoads PressurisedSphere::loads() const {
  const PressurisedSphere self = *this;
  return {.body_force = {},
          .traction =
              [self](const Vec3& x, const Vec3& n) {
                const double r = x.norm();
                const Mat3 gradient =
                    (self.uniform_ + self.radial_ / std::pow(r, 3)) * Mat3::Identity() -
                    3.0 * self.radial_ / std::pow(r, 5) * x * x.transpose();
                const Mat3 stress =
                    self.material_.lame_lambda() * gradient.trace() * Mat3::Identity() +
                    2.0 * self.material_.shear_modulus() * gradient;
                return Vec3(stress * n);
              },
          .held_displacement = self};
}

TriangleSurface hollow_sphere(double inner, double outer, double edge) {
  const auto ball = [&](double radius) {
    const int steps = std::max(8, static_cast<int>(std::ceil(std::numbers::pi * radius / edge)));
    std::vector<Vec2> outline;
    for (int i = 0; i <= steps; ++i) {
      const double angle = std::numbers::pi * i / steps;
      outline.emplace_back(radius * std::sin(angle), radius * std::cos(angle));
    }
    outline.front().x() = outline.back().x() = 0.0;
    return turned_surface(outline);
  };
  TriangleSurface surface = ball(outer);
  const TriangleSurface hole = ball(inner);
  const int first = static_cast<int>(surface.vertices.size());
  surface.vertices.insert(surface.vertices.end(), hole.vertices.begin(), hole.vertices.end());
  for (const std::array<int, 3>& t : hole.triangles)
    surface.triangles.push_back({first + t[0], first + t[2], first + t[1]});
  return surface;
}

}  // namespace viscera
