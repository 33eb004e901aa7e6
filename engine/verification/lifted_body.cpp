#include "engine/verification/lifted_body.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "kernels/base/stopwatch.h"
#include "kernels/paff/nodal_measures.h"
#include "kernels/points/node_placement.h"

namespace viscera {
namespace {

const Vec3 kHalfAxes(45e-3, 17.5e-3, 17.5e-3);  // [m]
constexpr double kHeldBelow = -15e-3;           // along x [m]
constexpr int kGripPoints = 10;

Progress silent() {
  return [](double, std::string_view) { return true; };
}

/// On the surface: the far pole's surroundings, some 12 mm across.
std::vector<Vec3> grip_points() {
  std::vector<Vec3> points;
  for (int i = 0; i < kGripPoints; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / (kGripPoints / 2.0);
    const double x = i < kGripPoints / 2 ? 0.95 : 0.98;
    const double r = std::sqrt(1.0 - x * x);
    points.push_back(kHalfAxes.cwiseProduct(Vec3(x, r * std::cos(angle), r * std::sin(angle))));
  }
  return points;
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

Vec3 lifted(double time, double height, double duration) {
  const double s = std::clamp(time / duration, 0.0, 1.0);
  const double way = height * s * s * s * (10.0 + s * (6.0 * s - 15.0));
  return {-way / 3.0, 0.0, way};
}

Result<std::unique_ptr<LiftedBody>> LiftedBody::prepare(const LiftedBodyOptions& options) {
  const Stopwatch watch;
  auto lifted = std::unique_ptr<LiftedBody>(new LiftedBody);
  lifted->body_.surface = ellipsoid(kHalfAxes, 24);
  auto cloud = place_nodes(
      lifted->body_.surface, SurfaceTree(lifted->body_.surface),
      [&](const Vec3&) { return options.spacing; }, {}, silent());
  if (!cloud) return std::unexpected(cloud.error());
  lifted->body_.cloud = std::move(*cloud);
  auto system = GalerkinSystem::assemble(
      lifted->body_.problem(options.material, [](const Vec3& x) { return x.x() < kHeldBelow; }),
      galerkin_formulation().support_factor(), silent());
  if (!system) return std::unexpected(system.error());
  lifted->system_ = std::make_unique<GalerkinSystem>(std::move(*system));
  auto region = lifted->system_->region([](const Vec3&) { return true; });
  if (!region) return std::unexpected(region.error());
  auto hold = lifted->system_->hold();
  if (!hold) return std::unexpected(hold.error());
  auto finite = FiniteBody::create(*region, *hold);
  if (!finite) return std::unexpected(finite.error());
  auto volumes = nodal_volumes(lifted->body_.surface, lifted->body_.cloud);
  if (!volumes) return std::unexpected(volumes.error());
  auto solver = FiniteSolver::prepare(std::make_shared<FiniteBody>(std::move(*finite)),
                                      lifted->body_.cloud.positions, *volumes, options.solver);
  if (!solver) return std::unexpected(solver.error());
  lifted->solver_ = std::make_unique<FiniteSolver>(std::move(*solver));

  HeldRows rows;
  ShapeValues at;
  for (const Vec3& x : grip_points()) {
    if (!lifted->system_->fields().evaluate(x, false, at))
      return failure("grip: found no fields at its points, expected nodes about them");
    rows.add(at.nodes, at.values);
  }
  lifted->grip_ = lifted->solver_->grip(rows);

  auto factor = lifted->system_->factor();
  if (!factor) return std::unexpected(factor.error());
  const auto n = static_cast<Eigen::Index>(3 * lifted->body_.cloud.size());
  const auto m = static_cast<Eigen::Index>(3 * rows.points());
  MatrixX loads = MatrixX::Zero(n, m);
  for (std::size_t p = 0; p < rows.points(); ++p)
    for (std::size_t e = rows.begin[p]; e < rows.begin[p + 1]; ++e)
      loads.block<3, 3>(3 * static_cast<Eigen::Index>(rows.nodes[e]),
                        3 * static_cast<Eigen::Index>(p)) += rows.values[e] * Mat3::Identity();
  MatrixX columns = loads;
  if (auto solved =
          factor->solve({columns.data(), static_cast<std::size_t>(n * m)}, static_cast<int>(m));
      !solved)
    return std::unexpected(solved.error());
  lifted->linear_rows_ = loads.transpose() * columns;
  lifted->prepare_s_ = watch.seconds();
  return lifted;
}

GripTarget LiftedBody::target(const Vec3& moved) const {
  return {&grip_, std::vector<Vec3>(grip_.rows.points(), moved)};
}

Vec3 LiftedBody::force(const FiniteStep& step) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : step.forces) sum += force;
  return sum;
}

Vec3 LiftedBody::linear_force(const Vec3& moved) const {
  const VectorX forces =
      linear_rows_.ldlt().solve(moved.replicate(static_cast<Eigen::Index>(grip_.rows.points()), 1));
  Vec3 sum = Vec3::Zero();
  for (Eigen::Index row = 0; row < forces.size(); row += 3) sum += forces.segment<3>(row);
  return sum;
}

}  // namespace viscera
