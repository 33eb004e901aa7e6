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
  double mass = 0.0;
  for (std::size_t node = 0; node < nodes.masses.size(); ++node) {
    mass += nodes.masses[node];
    rigid.centre += nodes.masses[node] * (nodes.positions[node] + of(u, node));
    rigid.shift += nodes.masses[node] * of(way, node);
  }
  rigid.centre /= mass;
  rigid.shift /= mass;
  Vec3 spin = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
  for (std::size_t node = 0; node < nodes.masses.size(); ++node) {
    const Vec3 arm = nodes.positions[node] + of(u, node) - rigid.centre;
    spin += nodes.masses[node] * arm.cross(Vec3(of(way, node)));
    inertia += nodes.masses[node] * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
  rigid.turn = inertia.ldlt().solve(spin);
  return rigid;
}

VectorX gone_by(const FreeNodes& nodes, const VectorX& u, const VectorX& way, bool rigidly) {
  const RigidWay rigid = rigid_part(nodes, u, way);
  const double angle = rigid.turn.norm();
  const Mat3 rotation = angle > 0.0
                            ? Eigen::AngleAxisd(angle, rigid.turn / angle).toRotationMatrix()
                            : Mat3(Mat3::Identity());
  VectorX next = u;
  for (std::size_t node = 0; node < nodes.masses.size(); ++node) {
    const Vec3 arm = nodes.positions[node] + of(u, node) - rigid.centre;
    Vec3 moved = rotation * arm - arm + rigid.shift;
    if (!rigidly) moved += of(way, node) - rigid.shift - rigid.turn.cross(arm);
    next.segment<3>(static_cast<Eigen::Index>(3 * node)) += moved;
  }
  return next;
}

}  // namespace viscera
