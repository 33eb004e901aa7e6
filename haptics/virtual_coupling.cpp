#include "haptics/virtual_coupling.h"

#include <Eigen/LU>

namespace viscera {

VirtualCoupling::VirtualCoupling(const CouplingSettings& settings, double dt)
    : settings_(settings), dt_(dt) {}

void VirtualCoupling::reset(const Vec3& device) {
  tool_ = asked_at_ = device;
  stretch_ = force_ = Vec3::Zero();
  stiffness_ = Mat3::Zero();
}

// (S + (K + B/dt) I) e = S (device - asked_at) - F + B/dt e'
Vec3 VirtualCoupling::stretch(const Vec3& device) const {
  const double damper = settings_.damping / dt_;
  Mat3 left = stiffness_;
  left.diagonal().array() += settings_.stiffness + damper;
  return left.inverse() * (stiffness_ * (device - asked_at_) - force_ + damper * stretch_);
}

Vec3 VirtualCoupling::predict(const Vec3& device) const {
  return device - stretch(device);
}

Vec3 VirtualCoupling::settle(const Vec3& device, const Vec3& asked_at, const TactileForce& tissue) {
  asked_at_ = asked_at;
  force_ = tissue.force;
  stiffness_ = tissue.stiffness;
  const Vec3 next = stretch(device);
  const Vec3 force = settings_.stiffness * next + settings_.damping / dt_ * (next - stretch_);
  stretch_ = next;
  tool_ = device - next;
  return -force;
}

double VirtualCoupling::energy() const {
  return 0.5 * settings_.stiffness * stretch_.squaredNorm();
}

}  // namespace viscera
