#include "kernels/finite/rigid_way.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace viscera {
namespace {

auto of(const VectorX& values, std::size_t node) {
  return values.segment<3>(static_cast<Eigen::Index>(3 * node));
}

}  // namespace

RigidWay rigid_part(const FreeNodes& nodes, const VectorX& u, const VectorX& way) {
  RigidWay rigid;
  double sum = 0.0;
  for (const int number : nodes.nodes) {
    const auto node = static_cast<std::size_t>(number);
    const double mass = nodes.masses[node];
    sum += mass;
    rigid.centre += mass * (nodes.positions[node] + of(u, node));
    rigid.shift += mass * of(way, node);
  }
  rigid.centre /= sum;
  rigid.shift /= sum;
  Vec3 spin = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
  for (const int number : nodes.nodes) {
    const auto node = static_cast<std::size_t>(number);
    const double mass = nodes.masses[node];
    const Vec3 arm = nodes.positions[node] + of(u, node) - rigid.centre;
    spin += mass * arm.cross(Vec3(of(way, node)));
    inertia += mass * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
  rigid.turn = inertia.ldlt().solve(spin);
  return rigid;
}

void go_by(const FreeNodes& nodes, const VectorX& u, const VectorX& way, bool rigidly,
           VectorX& next) {
  const RigidWay rigid = rigid_part(nodes, u, way);
  const double angle = rigid.turn.norm();
  const Mat3 rotation = angle > 0.0
                            ? Eigen::AngleAxisd(angle, rigid.turn / angle).toRotationMatrix()
                            : Mat3(Mat3::Identity());
  for (const int number : nodes.nodes) {
    const auto node = static_cast<std::size_t>(number);
    const Vec3 arm = nodes.positions[node] + of(u, node) - rigid.centre;
    Vec3 moved = rotation * arm - arm + rigid.shift;
    if (!rigidly) moved += of(way, node) - rigid.shift - rigid.turn.cross(arm);
    next.segment<3>(static_cast<Eigen::Index>(3 * node)) = of(u, node) + moved;
  }
}

}  // namespace viscera
