// Small bodies with nodes, and loads with known answers, for tests of the elastic formulations.
#pragma once

#include <cmath>
#include <fstream>
#include <functional>
#include <numeric>
#include <sstream>
#include <string>

#include "engine/verification/bodies.h"
#include "kernels/base/random.h"
#include "kernels/paff/galerkin.h"
#include "kernels/points/node_placement.h"
#include "tests/support/shapes.h"

namespace viscera::test {

using Body = NodedBody;
using viscera::jittered_cube;

/// Nodes by the advancing front at this spacing.
inline Body placed_body(TriangleSurface surface, const SpacingField& spacing) {
  Body body{std::move(surface), {}};
  Result<PointCloud> cloud =
      place_nodes(body.surface, SurfaceTree(body.surface), spacing, {}, no_progress());
  if (cloud) body.cloud = std::move(*cloud);
  return body;
}

/// `v` and triangular `f` lines of an OBJ file; enough for the organs of the data folder.
inline TriangleSurface read_simple_obj(const std::string& path) {
  TriangleSurface surface;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      Vec3 x;
      words >> x[0] >> x[1] >> x[2];
      surface.vertices.push_back(x);
    } else if (kind == "f") {
      std::array<int, 3> triangle{};
      for (int& corner : triangle) {
        std::string word;
        words >> word;
        corner = std::stoi(word) - 1;
      }
      surface.triangles.push_back(triangle);
    }
  }
  return surface;
}

inline Mat3 stress(const IsotropicMaterial& material, const Mat3& displacement_gradient) {
  return material.lame_lambda() * displacement_gradient.trace() * Mat3::Identity() +
         material.shear_modulus() * (displacement_gradient + displacement_gradient.transpose());
}

/// The linear field u = G x + c with the loads that hold it.
struct LinearField {
  Mat3 gradient = (Mat3() << .1, .2, -.3, .05, -.2, .1, .3, .15, .25).finished();
  Vec3 offset = Vec3(.1, .2, .3);

  Vec3 operator()(const Vec3& x) const { return gradient * x + offset; }

  StaticLoads loads(const IsotropicMaterial& material) const {
    const Mat3 sigma = stress(material, gradient);
    return {.body_force = {},
            .traction = [sigma](const Vec3&, const Vec3& n) { return Vec3(sigma * n); },
            .held_displacement = *this};
  }
};

/// A full quadratic field, u_i = x^T H_i x + (G x + c)_i, with the loads that hold it: tractions
/// that vary linearly and a constant body force.
struct QuadraticField {
  LinearField linear;
  Mat3 curvature[3] = {(Mat3() << .3, -.1, .2, -.1, .1, .15, .2, .15, -.2).finished(),
                       (Mat3() << -.2, .1, .05, .1, .4, -.15, .05, -.15, .1).finished(),
                       (Mat3() << .1, .2, -.1, .2, -.3, .1, -.1, .1, .25).finished()};

  Vec3 operator()(const Vec3& x) const {
    Vec3 u = linear(x);
    for (int i = 0; i < 3; ++i) u[i] += x.dot(curvature[i] * x);
    return u;
  }

  Mat3 gradient(const Vec3& x) const {
    Mat3 gradient = linear.gradient;
    for (int i = 0; i < 3; ++i) gradient.row(i) += 2.0 * (curvature[i] * x).transpose();
    return gradient;
  }

  StaticLoads loads(const IsotropicMaterial& material) const {
    const double lambda = material.lame_lambda(), mu = material.shear_modulus();
    Vec3 force = Vec3::Zero();  // -div sigma = -(lambda + mu) grad div u - mu laplace u
    for (int i = 0; i < 3; ++i) {
      force -= 2.0 * (lambda + mu) * curvature[i].row(i).transpose();
      force[i] -= 2.0 * mu * curvature[i].trace();
    }
    const QuadraticField self = *this;
    return {.body_force = [force](const Vec3&) { return force; },
            .traction = [self, material](
                            const Vec3& x,
                            const Vec3& n) { return Vec3(stress(material, self.gradient(x)) * n); },
            .held_displacement = self};
  }
};

/// Largest error of the displacement over the nodes, relative to its largest size.
inline double largest_error(const GalerkinSystem& system, const std::vector<double>& unknowns,
                            const std::function<Vec3(const Vec3&)>& exact) {
  double error = 0.0, size = 0.0;
  for (const Vec3& x : system.fields().cloud().positions) {
    error = std::max(error, (system.displacement(unknowns, x) - exact(x)).norm());
    size = std::max(size, exact(x).norm());
  }
  return error / size;
}

/// Places that are single nodes: what a solver does with them can be asked for directly.
inline SparseWeights nodes_as_places(const std::vector<int>& nodes) {
  SparseWeights places;
  for (const int node : nodes) {
    places.nodes.push_back(node);
    places.values.push_back(1.0f);
    places.row_begin.push_back(static_cast<int>(places.nodes.size()));
  }
  return places;
}

/// 0, 1, ... count - 1.
inline std::vector<int> first_indices(std::size_t count) {
  std::vector<int> indices(count);
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

}  // namespace viscera::test
