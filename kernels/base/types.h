// Scalars, small vectors and ranges used everywhere. SI units inside the program: metres, newtons,
// pascals, seconds, kelvin; a name carries a unit only where it departs from that.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>

namespace viscera {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec3f = Eigen::Vector3f;
using Vec4 = Eigen::Vector4d;
using Mat3 = Eigen::Matrix3d;
using Quaternion = Eigen::Quaterniond;
using VectorX = Eigen::VectorXd;
using MatrixX = Eigen::MatrixXd;

/// An axis-aligned box; empty until something is put in.
using Box = Eigen::AlignedBox3d;

/// A rigid placement: world = orientation * local + position [m].
struct Pose {
  Vec3 position = Vec3::Zero();
  Quaternion orientation = Quaternion::Identity();

  Vec3 to_world(const Vec3& local) const { return orientation * local + position; }
  Vec3 to_local(const Vec3& world) const { return orientation.conjugate() * (world - position); }
  Vec3 direction_to_world(const Vec3& local) const { return orientation * local; }
  Vec3 direction_to_local(const Vec3& world) const { return orientation.conjugate() * world; }
};

}  // namespace viscera
