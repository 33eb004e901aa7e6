#include "engine/verification/hemisphere_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/contact/cell_pattern.h"
#include "kernels/formulations/formulations.h"

namespace viscera {
namespace {

constexpr double kRadius = kHemisphereRadius;
/// Growth of the spacing away from the fine zone.
constexpr double kSlope = 0.25;

/// Distance to the part of the dome within `zone` R of the axis [m].
double distance_to_cap(const Vec3& x, double zone) {
  const double across = std::hypot(x.x(), x.y());
  const double rim = zone * kRadius, height = kRadius * std::sqrt(1.0 - zone * zone);
  if (x.z() > 0.0 && across * height <= rim * x.z()) return std::abs(kRadius - x.norm());
  return std::hypot(across - rim, x.z() - height);
}

SpacingField spacing_field(double finest, const HemisphereOptions& options) {
  const double zone = options.fine_zone, coarsest = std::max(options.coarsest * kRadius, finest);
  if (zone <= 0.0) return [finest](const Vec3&) { return finest; };
  return
      [=](const Vec3& x) { return std::min(coarsest, finest + kSlope * distance_to_cap(x, zone)); };
}

/// Integral of 1 / h^3 over the body: proportional to the nodes.
double node_integral(double finest, const HemisphereOptions& options) {
  constexpr int kSteps = 60;  // a lattice in the octant x, y, z > 0, doubled up by symmetry
  const SpacingField h = spacing_field(finest, options);
  const double step = kRadius / kSteps;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      for (int k = 0; k < kSteps; ++k) {
        const Vec3 x = step * Vec3(i + 0.5, j + 0.5, k + 0.5);
        if (x.norm() < kRadius) sum += std::pow(step / h(x), 3);
      }
    }
  }
  return 4.0 * sum;
}

/// The finest spacing whose integral is this one.
double spacing_of_integral(double wanted, const HemisphereOptions& options) {
  double low = 1e-3 * kRadius, high = kRadius;
  for (int i = 0; i < 40; ++i) {
    const double middle = std::sqrt(low * high);
    (node_integral(middle, options) > wanted ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

/// Triangles of the surface about as wide as nodes are apart where they are closest.
int rings_for(double finest) {
  return std::clamp(static_cast<int>(std::ceil(1.2 * kRadius / finest)), 32, 96);
}

/// Finest spacing that gives at most this many nodes, and hardly fewer.
Result<double> spacing_for(const HemisphereOptions& options, const Progress& progress) {
  const std::size_t nodes = options.nodes;
  const double wanted = static_cast<double>(nodes);
  double nodes_per_integral = 1.2, best = 0.0, most = 0.0;
  for (int pass = 0; pass < 6; ++pass) {
    if (!progress(0.0, "finding the spacing")) return failure(kCancelled);
    const double finest = spacing_of_integral(0.985 * wanted / nodes_per_integral, options);
    const TriangleSurface surface = ringed_hemisphere(kRadius, rings_for(finest));
    auto cloud = place_nodes(surface, SurfaceTree(surface), spacing_field(finest, options), {},
                             no_progress());
    if (!cloud) return std::unexpected(cloud.error());
    const double found = static_cast<double>(cloud->size());
    if (found <= wanted && found > most) {
      most = found;
      best = finest;
    }
    if (most > 0.97 * wanted) return best;
    nodes_per_integral = found / node_integral(finest, options);
  }
  if (best > 0.0) return best;
  return failure(
      fmt::format("hemisphere: found no cloud of at most {} nodes, expected more", nodes));
}

}  // namespace

Result<std::unique_ptr<HemisphereBody>> HemisphereBody::prepare(const HemisphereOptions& options,
                                                                const Progress& progress) {
  std::unique_ptr<HemisphereBody> body(new HemisphereBody);
  if (!find_formulation(options.formulation))
    return failure("formulation: " + unknown_formulation(options.formulation));
  const auto finest = spacing_for(options, progress);
  if (!finest) return std::unexpected(finest.error());
  body->finest_ = *finest;
  const double zone = options.touchable_zone;
  auto prepared = PressedBody::prepare(
      {ringed_hemisphere(kRadius, rings_for(*finest)),
       {kHemisphereModulus, options.poisson_ratio},
       spacing_field(*finest, options),
       [](const Vec3& x) { return x.z() < 1e-9; },
       [zone](const Vec3& x) {
         return zone >= 1.0 || (x.z() > 0.0 && std::hypot(x.x(), x.y()) < zone * kRadius);
       },
       options.formulation},
      progress);
  if (!prepared) return std::unexpected(prepared.error());
  body->body_ = std::move(*prepared);
  const TriangleSurface& surface = body->surface();
  body->dome_areas_.assign(surface.vertices.size(), 0.0);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vec3 area = area_vector(surface, static_cast<int>(t));
    if (area.z() <= 0.0) continue;
    for (const int corner : surface.triangles[t]) {
      body->dome_areas_[static_cast<std::size_t>(corner)] += area.norm() / 3.0;
    }
  }
  return body;
}

std::vector<ContactCell> HemisphereBody::cells(HemisphereContact contact, double poisson_ratio,
                                               double a_over_R, int rings, double tilt) {
  const bool stick = contact == HemisphereContact::kStick;
  const double depth = kHemisphereDepth * kRadius;
  const double reach = 2.0 * kRadius * std::sin(0.5 * std::asin(a_over_R));
  const Mat3 turn = Eigen::AngleAxisd(tilt, Vec3::UnitY()).toRotationMatrix();
  const Vec3 down = -turn.col(2);
  auto cells =
      cap_cells(kRadius, fitted_to_punch(ringed_disc(1.0, rings), reach, poisson_ratio, stick));
  for (ContactCell& cell : cells) {
    cell.normal = turn * cell.normal;
    cell.position = turn * cell.position;
    cell.held = stick;
    cell.direction = -cell.normal;
    cell.displacement = depth * down;
    cell.depth = depth * cell.direction.dot(down);
  }
  return cells;
}

HemispherePressure HemisphereBody::pressure(double a_over_R) const {
  // Enough that the pressure's steps from cell to cell don't show beside the nodes.
  constexpr int kRings = 16;
  const double a = a_over_R * kRadius;
  HemispherePressure pressure;
  std::vector<Vec3> load(compliance().touchable.size(), Vec3::Zero());
  std::vector<LoadShare> shares;
  const double reach = 2.0 * kRadius * std::sin(0.5 * std::asin(a_over_R));
  pressure.cells = cap_cells(kRadius, ringed_disc(reach, kRings));
  for (const ContactCell& cell : pressure.cells) {
    const double across = std::hypot(cell.position.x(), cell.position.y());
    const double fall = std::max(0.0, 1.0 - across * across / (a * a));
    const Vec3 force = -kHemisphereModulus * fall * fall * cell.area * cell.normal;
    const double sigma = PatchContact::spread_factor() * spacing_at(touchable(), cell.position);
    spread_load(touchable(), cell.position, cell.normal, sigma, shares);
    for (const LoadShare& share : shares) {
      load[static_cast<std::size_t>(share.place)] += share.share * force;
    }
    pressure.near_fields.emplace_back(material(), sigma);
    pressure.forces.push_back(force);
  }
  for (std::size_t j = 0; j < load.size(); ++j) {
    if (load[j].isZero(0.0)) continue;
    pressure.response.touched.push_back(static_cast<int>(j));
    pressure.response.loads.push_back(load[j]);
  }
  return pressure;
}

HemisphereAnswer HemisphereBody::press(HemisphereContact contact, double a_over_R, int rings) {
  if (contact == HemisphereContact::kPress) {
    HemispherePressure load = pressure(a_over_R);
    HemisphereAnswer answer;
    for (const Vec3& force : load.forces) answer.force -= force.z();
    ContactSolution solution;
    solution.near_fields = std::move(load.near_fields);
    solution.forces = std::move(load.forces);
    answer.displacements = body_->displacements(solution, load.response, load.cells);
    answer.converged = true;
    return answer;
  }
  PressedAnswer pressed =
      body_->press(cells(contact, material().poisson_ratio, a_over_R, rings, 0.0));
  return {-pressed.force.z(), std::move(pressed.displacements), pressed.converged,
          pressed.smallest_eigenvalue};
}

HemisphereAnswer HemisphereBody::press_pinned(double a_over_R) {
  PressedAnswer pinned = body_->pin(
      [&](const Vec3& x) { return x.z() > 0.0 && std::hypot(x.x(), x.y()) <= a_over_R * kRadius; },
      Vec3(0.0, 0.0, -kHemisphereDepth * kRadius));
  return {-pinned.force.z(), std::move(pinned.displacements), pinned.converged, 1.0};
}

double HemisphereBody::profile_error(const std::vector<Vec3>& displacements,
                                     const HemisphereProfile& reference) const {
  double error = 0.0, size = 0.0;
  for (std::size_t v = 0; v < displacements.size(); ++v) {
    if (dome_areas_[v] <= 0.0) continue;
    const Vec3 exact = kRadius * reference.at(surface().vertices[v].normalized());
    error += dome_areas_[v] * (displacements[v] - exact).squaredNorm();
    size += dome_areas_[v] * exact.squaredNorm();
  }
  return std::sqrt(error / size);
}

}  // namespace viscera
