#include "engine/verification/two_balls.h"

#include <cmath>
#include <numbers>

#include "engine/verification/axisymmetric_hemisphere.h"
#include "kernels/contact/cell_pattern.h"

namespace viscera {
namespace {

/// From the upper ball's frame to the world: its pole points down.
Mat3 upside_down() {
  return Vec3(1.0, -1.0, -1.0).asDiagonal();
}

}  // namespace

HertzAnswer hertz(const IsotropicMaterial& material, double radius, double approach) {
  const double modulus =
      material.youngs_modulus / (2.0 * (1.0 - material.poisson_ratio * material.poisson_ratio));
  const double mean_radius = 0.5 * radius;
  return {4.0 / 3.0 * modulus * std::sqrt(mean_radius) * std::pow(approach, 1.5),
          std::sqrt(mean_radius * approach)};
}

HertzAnswer hertz_held(const IsotropicMaterial& material, double radius, double approach,
                       double give) {
  // The approach of Hertz's balls under the same force lies above.
  double least = approach, most = 3.0 * approach;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (least + most);
    const double held = middle - 2.0 * give * hertz(material, radius, middle).force;
    (held < approach ? least : most) = middle;
  }
  return hertz(material, radius, least);
}

Result<double> give_of_base(const IsotropicMaterial& material, double radius) {
  // Of about the disc that balls touch by; c is the same for any small one.
  constexpr double kPunch = 0.14;
  const auto reference = solve_axisymmetric_hemisphere(material.poisson_ratio, kPunch);
  if (!reference) return std::unexpected(reference.error());
  const double modulus =
      material.youngs_modulus / (1.0 - material.poisson_ratio * material.poisson_ratio);
  return 1.0 / (2.0 * modulus * kPunch * radius) -
         1.0 / (reference->frictionless * material.youngs_modulus * radius);
}

Result<std::unique_ptr<TwoBalls>> TwoBalls::prepare(const TwoBallsOptions& options,
                                                    const Progress& progress) {
  std::unique_ptr<TwoBalls> balls(new TwoBalls);
  HemisphereOptions body;
  body.nodes = options.nodes;
  auto prepared = HemisphereBody::prepare(body, progress);
  if (!prepared) return std::unexpected(prepared.error());
  balls->body_ = std::move(*prepared);
  balls->other_ = std::make_unique<PatchContact>(
      balls->body_->compliance(), balls->body_->touchable(), balls->body_->material());
  const auto cells = cap_cells(kHemisphereRadius, ringed_disc(options.reach, options.rings));
  for (std::size_t b = 0; b < 2; ++b)
    for (ContactCell cell : cells) {
      if (b == 1) {
        cell.position.y() *= -1.0;
        cell.normal.y() *= -1.0;
      }
      cell.direction = -cell.normal;
      balls->cells_[b].push_back(cell);
    }
  return balls;
}

TwoBallsAnswer TwoBalls::press(double approach, double friction, double way) {
  std::array<ContactSolution, 2> solutions;
  std::array<ContactResponse, 2> responses;
  const std::array<TissueContact*, 2> tissues = {&body_->contact(), other_.get()};
  std::array<std::unique_ptr<SharedSolve>, 2> solves;
  std::vector<IslandBody> bodies;
  for (std::size_t b = 0; b < 2; ++b) {
    solves[b] = tissues[b]->share(cells_[b], 0, solutions[b], responses[b]);
    bodies.push_back({solves[b].get(), b == 0 ? Mat3(Mat3::Identity()) : upside_down(), 0});
  }
  std::vector<Joint> joints;
  for (std::size_t k = 0; k < cells_[0].size(); ++k) {
    const ContactCell& cell = cells_[0][k];
    // Both surfaces fall away from the tangential plane, within a cell by as much again on average.
    const double within = cell.area / (2.0 * std::numbers::pi * 2.0 * kHemisphereRadius);
    const double apart = 2.0 * (kHemisphereRadius - cell.position.z() + within);
    Joint joint;
    joint.ends = {Joint::End{0, static_cast<int>(k)}, Joint::End{1, static_cast<int>(k)}};
    joint.direction = -Vec3::UnitZ();
    joint.depth = approach - apart;
    joint.friction = friction;
    joint.displacement = way * Vec3::UnitX();
    joints.push_back(joint);
  }
  TwoBallsAnswer answer;
  answer.island = island_.solve(bodies, joints, forces_);
  Vec3 lower = Vec3::Zero(), upper = Vec3::Zero();
  double square = 0.0;
  for (std::size_t k = 0; k < joints.size(); ++k) {
    lower += solutions[0].forces[k];
    upper += upside_down() * solutions[1].forces[k];
    const double push = -solutions[0].forces[k].z();
    square += push * cells_[0][k].position.head<2>().squaredNorm();
    const Vec3 moved =
        body_->contact().cell_displacements()[k] - upside_down() * other_->cell_displacements()[k];
    answer.greatest_overlap =
        std::max(answer.greatest_overlap, joints[k].depth - moved.dot(joints[k].direction));
  }
  answer.force = -lower.z();
  answer.drag = lower.x();
  answer.radius = answer.force > 0.0 ? std::sqrt(2.5 * square / answer.force) : 0.0;
  answer.unbalanced = (lower + upper).norm() / std::max(lower.norm(), upper.norm());
  return answer;
}

}  // namespace viscera
