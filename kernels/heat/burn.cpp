#include "kernels/heat/burn.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace viscera {
namespace {

constexpr double kRimRadius = 2.0;  // of the core's radius

// The kernel (1 - r^2 / R^2)^2 moved along a segment: its mean over the segment at one point. With
// the point at distance d from the segment's line and t measured along it from the foot of the
// perpendicular, a = 1 - d^2 / R^2, the integrand is the polynomial (a - t^2 / R^2)^2 on
// |t| <= R sqrt(a), so the integral is exact: the trace doesn't depend on how a path was cut.
class SweptKernel {
 public:
  SweptKernel(const Vec3& begin, const Vec3& end, double radius)
      : begin_(begin), length_((end - begin).norm()), radius_(radius) {
    if (length_ > 0.0) direction_ = (end - begin) / length_;
    const double volume = 32.0 * std::numbers::pi / 105.0 * radius * radius * radius;
    normalisation_ = 1.0 / volume;
  }

  // Integrates to 1 over space [1/m3].
  double operator()(const Vec3& point) const {
    const Vec3 offset = point - begin_;
    const double inverse_square = 1.0 / (radius_ * radius_);
    // Shorter than a thousandth of the radius, the division by the length would only amplify
    // rounding.
    if (length_ < 1e-3 * radius_) {
      const double a = 1.0 - offset.squaredNorm() * inverse_square;
      return a > 0.0 ? a * a * normalisation_ : 0.0;
    }
    const double foot = offset.dot(direction_);
    const double a = 1.0 - (offset - foot * direction_).squaredNorm() * inverse_square;
    if (a <= 0.0) return 0.0;
    const double reach = radius_ * std::sqrt(a);
    const double from = std::max(-foot, -reach);
    const double to = std::min(length_ - foot, reach);
    if (from >= to) return 0.0;
    const auto primitive = [&](double t) {
      const double q = t * t * inverse_square;
      return t * (a * a - q * (2.0 / 3.0 * a - q / 5.0));
    };
    return (primitive(to) - primitive(from)) / length_ * normalisation_;
  }

  double distance(const Vec3& point) const {
    const Vec3 offset = point - begin_;
    const double along = std::clamp(offset.dot(direction_), 0.0, length_);
    return (offset - along * direction_).norm();
  }

 private:
  Vec3 begin_, direction_ = Vec3::Zero();
  double length_, radius_, normalisation_;
};

struct Deposit {
  BrickField::Index brick;
  int voxel;
  double weight;
};

}  // namespace

double deposit_burn(BrickField& damage, const Vec3& previous_position, const Vec3& rest_position,
                    double power, double dt, const BurnParameters& parameters) {
  const double energy = power * dt;
  const bool usable = std::isfinite(energy) && power > 0.0 && dt > 0.0 && parameters.radius > 0.0 &&
                      parameters.energy_per_volume > 0.0 && previous_position.allFinite() &&
                      rest_position.allFinite();
  if (!usable) return 0.0;

  const double voxel = damage.voxel();
  const double radius = std::max(parameters.radius, voxel);
  const double reach = kRimRadius * radius;
  const SweptKernel core(previous_position, rest_position, radius);
  const SweptKernel rim(previous_position, rest_position, reach);

  // Bricks that the swept rim can reach: those in its bounding box whose ball about the centre
  // touches the capsule.
  const Vec3 low = previous_position.cwiseMin(rest_position).array() - reach;
  const Vec3 high = previous_position.cwiseMax(rest_position).array() + reach;
  const BrickField::Index first = BrickField::brick_of(damage.voxel_of(low));
  const BrickField::Index last = BrickField::brick_of(damage.voxel_of(high));
  const double brick_edge = BrickField::kEdge * voxel;
  const double brick_reach = reach + 0.5 * std::numbers::sqrt3 * brick_edge;

  std::vector<Deposit> deposits;
  double sum = 0.0;
  for (int bz = first.z(); bz <= last.z(); ++bz) {
    for (int by = first.y(); by <= last.y(); ++by) {
      for (int bx = first.x(); bx <= last.x(); ++bx) {
        const BrickField::Index brick(bx, by, bz);
        const Vec3 middle = (brick.cast<double>().array() + 0.5) * brick_edge;
        if (rim.distance(middle) > brick_reach) continue;
        for (int i = 0; i < BrickField::kVoxels; ++i) {
          const BrickField::Index local(i % BrickField::kEdge,
                                        i / BrickField::kEdge % BrickField::kEdge,
                                        i / (BrickField::kEdge * BrickField::kEdge));
          const Vec3 centre = damage.centre(brick * BrickField::kEdge + local);
          const double weight =
              (1.0 - parameters.rim_share) * core(centre) + parameters.rim_share * rim(centre);
          if (weight <= 0.0) continue;
          deposits.push_back({brick, i, weight});
          sum += weight;
        }
      }
    }
  }

  // Weights are scaled to their sum over voxels, not to the integral: the energy is then conserved
  // exactly, and the few per cent of midpoint error don't show as a pulse when the ball moves.
  const double voxel_capacity = parameters.energy_per_volume * voxel * voxel * voxel;
  double absorbed = 0.0;
  for (const Deposit& deposit : deposits) {
    float& value = damage.brick(damage.ensure(deposit.brick))[deposit.voxel];
    const double share = energy * deposit.weight / sum;
    const double room = (1.0 - value) * voxel_capacity;
    const double taken = std::min(share, room);
    absorbed += taken;
    value = std::min(1.0f, static_cast<float>(value + taken / voxel_capacity));
  }
  return absorbed;
}

}  // namespace viscera
