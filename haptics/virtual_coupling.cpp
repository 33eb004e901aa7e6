#include "haptics/virtual_coupling.h"

#include <Eigen/LU>

namespace viscera {

VirtualCoupling::VirtualCoupling(const CouplingSettings& settings) : settings_(settings) {}

void VirtualCoupling::reset(const Vec3& device) {
  state_.tool = state_.asked_at = device;
  state_.stretch = state_.force = Vec3::Zero();
  state_.stiffness = Mat3::Zero();
}

// (S + (K + B/dt) I) e = S (device - asked_at) - F + B/dt e'
Vec3 VirtualCoupling::stretch(const Vec3& device, double dt) const {
  const double damper = settings_.damping / dt;
  Mat3 left = state_.stiffness;
  left.diagonal().array() += settings_.stiffness + damper;
  return left.inverse() *
         (state_.stiffness * (device - state_.asked_at) - state_.force + damper * state_.stretch);
}

Vec3 VirtualCoupling::predict(const Vec3& device, double dt) const {
  return device - stretch(device, dt);
}

Vec3 VirtualCoupling::settle(const Vec3& device, const Vec3& asked_at, const TactileForce& tissue,
                             double dt) {
  state_.asked_at = asked_at;
  state_.force = tissue.force;
  state_.stiffness = tissue.stiffness;
  const Vec3 next = stretch(device, dt);
  const Vec3 force = settings_.stiffness * next + settings_.damping / dt * (next - state_.stretch);
  state_.stretch = next;
  state_.tool = device - next;
  return -force;
}

double VirtualCoupling::energy() const {
  return 0.5 * settings_.stiffness * state_.stretch.squaredNorm();
}

}  // namespace viscera
