#include "engine/verification/lifted_body.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "kernels/base/stopwatch.h"
#include "kernels/paff/nodal_measures.h"
#include "kernels/points/node_placement.h"

namespace viscera {
namespace {

Progress silent() {
  return [](double, std::string_view) { return true; };
}

/// What holds the grip's points, or their mean.
Result<HeldRows> grip_rows(const LiftShape& shape, const ShapeFunctions& fields) {
  HeldRows rows;
  ShapeValues at;
  std::map<int, double> mean;
  for (const Vec3& x : shape.grip) {
    if (!fields.evaluate(x, false, at))
      return failure("grip: found no fields at its points, expected nodes about them");
    if (!shape.holds_mean) rows.add(at.nodes, at.values);
    for (std::size_t i = 0; i < at.nodes.size(); ++i)
      mean[at.nodes[i]] += at.values[i] / static_cast<double>(shape.grip.size());
  }
  if (!shape.holds_mean) return rows;
  std::vector<int> nodes;
  std::vector<double> values;
  for (const auto& [node, value] : mean) nodes.push_back(node), values.push_back(value);
  rows.add(nodes, values);
  return rows;
}

}  // namespace

Vec3 lifted(double time, double height, double duration) {
  const double s = std::clamp(time / duration, 0.0, 1.0);
  const double way = height * s * s * s * (10.0 + s * (6.0 * s - 15.0));
  return {-way / 3.0, 0.0, way};
}

Result<std::unique_ptr<LiftedBody>> LiftedBody::prepare(const LiftedBodyOptions& options) {
  const Stopwatch watch;
  auto lifted = std::unique_ptr<LiftedBody>(new LiftedBody);
  const LiftShape shape = lift_shape(options.shape);
  lifted->body_.surface = shape.surface;
  auto cloud = place_nodes(
      lifted->body_.surface, SurfaceTree(lifted->body_.surface),
      [&](const Vec3&) { return options.spacing; }, {}, silent());
  if (!cloud) return std::unexpected(cloud.error());
  lifted->body_.cloud = std::move(*cloud);
  ElasticProblem problem = lifted->body_.problem(options.material, shape.is_held);
  problem.few_points = true;  // as organs at finite strain are prepared
  auto system =
      GalerkinSystem::assemble(problem, galerkin_formulation().support_factor(), silent());
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
  auto shared = std::make_shared<const FiniteBody>(std::move(*finite));
  auto solver = options.in_levels
                    ? FiniteSolver::prepare_in_levels(std::move(shared), *region, *hold,
                                                      lifted->body_.cloud, *volumes, options.solver)
                    : FiniteSolver::prepare(std::move(shared), lifted->body_.cloud.positions,
                                            *volumes, options.solver);
  if (!solver) return std::unexpected(solver.error());
  lifted->solver_ = std::make_unique<FiniteSolver>(std::move(*solver));

  auto rows = grip_rows(shape, lifted->system_->fields());
  if (!rows) return std::unexpected(rows.error());
  lifted->grip_ = lifted->solver_->grip(std::move(*rows));
  const HeldRows& held = lifted->grip_.rows;

  auto factor = lifted->system_->factor();
  if (!factor) return std::unexpected(factor.error());
  const auto n = static_cast<Eigen::Index>(3 * lifted->body_.cloud.size());
  const auto m = static_cast<Eigen::Index>(3 * held.points());
  MatrixX loads = MatrixX::Zero(n, m);
  for (std::size_t p = 0; p < held.points(); ++p)
    for (std::size_t e = held.begin[p]; e < held.begin[p + 1]; ++e)
      loads.block<3, 3>(3 * static_cast<Eigen::Index>(held.nodes[e]),
                        3 * static_cast<Eigen::Index>(p)) += held.values[e] * Mat3::Identity();
  MatrixX columns = loads;
  if (auto solved =
          factor->solve({columns.data(), static_cast<std::size_t>(n * m)}, static_cast<int>(m));
      !solved)
    return std::unexpected(solved.error());
  lifted->linear_rows_ = loads.transpose() * columns;
  lifted->linear_columns_ = std::move(columns);
  lifted->prepare_s_ = watch.seconds();
  return lifted;
}

GripTouch LiftedBody::held_at(const Vec3& moved, const FiniteStep& last) const {
  return GripTouch(grip_, std::vector<Vec3>(grip_.rows.points(), moved), last.forces);
}

Vec3 LiftedBody::force(const FiniteStep& step) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : step.forces) sum += force;
  return sum;
}

VectorX LiftedBody::linear_grip_forces(const Vec3& moved) const {
  return linear_rows_.ldlt().solve(
      moved.replicate(static_cast<Eigen::Index>(grip_.rows.points()), 1));
}

Vec3 LiftedBody::linear_force(const Vec3& moved) const {
  const VectorX forces = linear_grip_forces(moved);
  Vec3 sum = Vec3::Zero();
  for (Eigen::Index row = 0; row < forces.size(); row += 3) sum += forces.segment<3>(row);
  return sum;
}

VectorX LiftedBody::linear_displacements(const Vec3& moved) const {
  return linear_columns_ * linear_grip_forces(moved);
}

}  // namespace viscera
