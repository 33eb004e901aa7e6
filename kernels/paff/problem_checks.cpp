#include "kernels/paff/problem_checks.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "kernels/paff/local_spacing.h"
#include "kernels/points/neighbours.h"

namespace viscera {
namespace {

void check_material(const IsotropicMaterial& material, std::vector<std::string>& mistakes) {
  std::ostringstream text;
  if (!(material.youngs_modulus > 0.0 && std::isfinite(material.youngs_modulus))) {
    text << "material: Young's modulus is " << material.youngs_modulus
         << " Pa; expected a positive number";
    mistakes.push_back(text.str());
  }
  if (!(material.poisson_ratio >= 0.0 && material.poisson_ratio < 0.5)) {
    text.str("");
    text << "material: Poisson's ratio is " << material.poisson_ratio
         << "; expected at least 0 and less than 0.5";
    mistakes.push_back(text.str());
  }
}

void check_cloud(const PointCloud& cloud, std::vector<std::string>& mistakes) {
  if (cloud.size() < 4) {
    mistakes.push_back("nodes: there are " + std::to_string(cloud.size()) +
                       "; expected at least 4: use a smaller node spacing");
  }
  if (cloud.spacings.size() != cloud.size()) {
    mistakes.push_back("nodes: " + std::to_string(cloud.size()) + " positions but " +
                       std::to_string(cloud.spacings.size()) + " spacings; expected one each");
    return;
  }
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.positions[i].allFinite() && cloud.spacings[i] > 0.0 &&
        std::isfinite(cloud.spacings[i])) {
      continue;
    }
    std::ostringstream text;
    text << "nodes: node " << i << " lies at (" << cloud.positions[i].transpose()
         << ") m with spacing " << cloud.spacings[i]
         << " m; expected finite numbers and a positive spacing";
    mistakes.push_back(text.str());
    return;
  }
}

/// The fields of two nodes at nearly one place hardly differ: d apart, the stiffness against their
/// difference falls as (d / h)^2, and their entries of the compliance grow as its inverse. Stored
/// in single precision they are then wrong by 2^-24 (h / d)^2 of what the nodes feel together: 2e-5
/// at this limit, which placed clouds keep ten times over.
void check_separation(const PointCloud& cloud, std::vector<std::string>& mistakes) {
  constexpr double kLeast = 0.05;  // of the spacing
  const std::vector<int> nearest = nearest_neighbours(cloud.positions, 1);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (nearest[i] < 0) continue;
    const auto j = static_cast<std::size_t>(nearest[i]);
    const double distance = (cloud.positions[i] - cloud.positions[j]).norm();
    if (distance >= kLeast * std::max(cloud.spacings[i], cloud.spacings[j])) continue;
    std::ostringstream text;
    text << "nodes: " << i << " and " << j << " at (" << 1e3 * cloud.positions[i].transpose()
         << ") mm are " << 1e3 * distance << " mm apart, with a spacing of "
         << 1e3 * cloud.spacings[i] << " mm; expected at least a twentieth of it: remove one";
    mistakes.push_back(text.str());
    return;
  }
}

/// Background cells follow the mean spacing h about a node and carry points up to 0.29 h from any
/// place along each edge, 0.5 h across the cell. A node whose support (1.8 of its own spacing) is
/// smaller than that may have no point within, and no stiffness.
void check_gradation(const PointCloud& cloud, std::vector<std::string>& mistakes) {
  constexpr double kLeast = 0.28;  // 0.5 / 1.8
  const LocalSpacing around(cloud);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double h = around(cloud.positions[i]);
    if (cloud.spacings[i] >= kLeast * h) continue;
    std::ostringstream text;
    text << "nodes: about node " << i << " at (" << 1e3 * cloud.positions[i].transpose()
         << ") mm the spacing changes at once from " << 1e3 * cloud.spacings[i] << " mm to "
         << 1e3 * h << " mm; expected it to grow gradually, by a quarter of the distance at most: "
         << "remove the crowded nodes or make the others finer around them";
    mistakes.push_back(text.str());
    return;
  }
}

void check_surface(const TriangleSurface& surface, std::vector<std::string>& mistakes) {
  if (surface.empty()) {
    mistakes.push_back("surface: it has no triangles; expected a closed surface");
    return;
  }
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    if (surface.vertices[i].allFinite()) continue;
    std::ostringstream text;
    text << "surface: vertex " << i << " lies at (" << surface.vertices[i].transpose()
         << ") m; expected finite numbers";
    mistakes.push_back(text.str());
    return;
  }
  const int vertex_count = static_cast<int>(surface.vertices.size());
  for (const std::array<int, 3>& triangle : surface.triangles) {
    for (const int v : triangle) {
      if (v >= 0 && v < vertex_count) continue;
      mistakes.push_back("surface: a triangle names vertex " + std::to_string(v) +
                         "; expected 0 to " + std::to_string(vertex_count - 1));
      return;
    }
  }
  if (const double enclosed = volume(surface); !(enclosed > 0.0)) {
    std::ostringstream text;
    text << "surface: it encloses " << enclosed
         << " m3; expected a positive volume (closed, oriented outwards)";
    mistakes.push_back(text.str());
  }
}

/// A node stands for about the cube of its spacing. Spacings far too small for the body (a wrong
/// unit) would call for endless background cells before the shape functions fail.
void check_coverage(const TriangleSurface& surface, const PointCloud& cloud,
                    std::vector<std::string>& mistakes) {
  constexpr double kMostPerNode = 30.0;
  double covered = 0.0;
  for (const double h : cloud.spacings) covered += h * h * h;
  const double enclosed = volume(surface);
  if (enclosed <= kMostPerNode * covered) return;
  std::ostringstream text;
  text << "nodes: by their spacings they fill " << covered << " m3 of the " << enclosed
       << " m3 that the surface encloses; expected about all of it";
  mistakes.push_back(text.str());
}

}  // namespace

std::vector<std::string> problem_mistakes(const ElasticProblem& problem) {
  std::vector<std::string> mistakes;
  check_material(problem.material, mistakes);
  if (problem.surface) {
    check_surface(*problem.surface, mistakes);
  } else {
    mistakes.push_back("surface: none given");
  }
  if (problem.cloud) {
    check_cloud(*problem.cloud, mistakes);
  } else {
    mistakes.push_back("nodes: none given");
  }
  if (mistakes.empty()) check_coverage(*problem.surface, *problem.cloud, mistakes);
  if (mistakes.empty()) check_separation(*problem.cloud, mistakes);
  if (mistakes.empty()) check_gradation(*problem.cloud, mistakes);
  if (!problem.is_fixed) mistakes.push_back("fixed region: none given; a body must be held");
  return mistakes;
}

std::string modulus_mistake(const VolumeQuadrature& points, std::span<const double> modulus) {
  constexpr double kLeast = 1e-4, kMost = 1e4;
  for (std::size_t q = 0; q < modulus.size(); ++q) {
    if (modulus[q] >= kLeast && modulus[q] <= kMost) continue;
    std::ostringstream text;
    text << "material: at (" << 1e3 * points.positions[q].transpose() << ") mm Young's modulus is "
         << modulus[q] << " times that of the tissue; expected 0.0001 to 10,000";
    return text.str();
  }
  return {};
}

std::string fibres_mistake(const VolumeQuadrature& points, std::span<const Fibres> fibres,
                           const IsotropicMaterial& material) {
  constexpr double kMost = 1e4, kUnit = 1e-9;
  const double most = kMost * material.youngs_modulus;
  for (std::size_t q = 0; q < fibres.size(); ++q) {
    const auto& [direction, modulus] = fibres[q];
    const bool sound = modulus >= 0.0 && modulus <= most;
    if (sound && (modulus == 0.0 || std::abs(direction.squaredNorm() - 1.0) < kUnit)) continue;
    std::ostringstream text;
    text << "material: at (" << 1e3 * points.positions[q].transpose() << ") mm fibres have ";
    if (sound)
      text << "the direction (" << direction.transpose() << "); expected one of length 1";
    else
      text << "a modulus of " << modulus << " Pa; expected 0 to 10,000 times Young's, " << most
           << " Pa";
    return text.str();
  }
  return {};
}

Result<void> accept_material(const Formulation& formulation, const IsotropicMaterial& material) {
  const double highest = formulation.highest_poisson_ratio();
  Error mistakes;
  check_material(material, mistakes.messages);
  if (mistakes.messages.empty() && material.poisson_ratio > highest) {
    std::ostringstream text;
    text << "formulation \"" << formulation.name() << "\": Poisson's ratio is "
         << material.poisson_ratio << "; expected at most " << highest
         << ", above which its error grows without bound: use \"galerkin\", or a lower ratio";
    mistakes.messages.push_back(text.str());
  }
  if (mistakes.messages.empty()) return {};
  return std::unexpected(mistakes);
}

}  // namespace viscera
