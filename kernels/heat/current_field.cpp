#include "kernels/heat/current_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
/// How far heating is followed: a tenth of the power is left beyond.
constexpr double kReach = 6.0, kLeastReach = 3e-3;  // of the radius; [m]
/// Samples along a voxel's edge near the disc, at least and at most, and away from it.
constexpr int kLeastFine = 4, kMostFine = 8, kCoarse = 2;
constexpr double kFinePerRadius = 8.0;
constexpr double kNear = 2.5;  // of the radius
/// Thickness of a shell under the disc, over the distance of samples: none must be empty.
constexpr double kShellPerSample = 1.2;
/// A shell without tissue would stop all current; some always creeps along surfaces.
constexpr double kLeastShare = 1e-3;
/// Conductance of a dried shell that sparks cross, over the wet one's. [R]
constexpr double kSparkShare = 0.1;

}  // namespace

CurrentField::CurrentField(Bioheat& heat, const Vec3& point, const Vec3& outward, double radius,
                           double gap)
    : point_(point), outward_(outward) {
  const double h = heat.options().voxel;
  const double reach = std::max(kReach * radius, kLeastReach);
  const double last = std::atan(std::sqrt(std::pow(reach / radius, 2) - 1.0));
  const int fine = std::clamp(static_cast<int>(std::ceil(kFinePerRadius * h / radius)), kLeastFine,
                              kMostFine);
  shells_ = std::clamp(static_cast<int>(last * radius * fine / (kShellPerSample * h)), 2, kMostShells);
  shell_ = last / shells_;
  const double edge = HeatBricks::kEdge * h;
  const BrickIndex low = ((point.array() - reach) / edge).floor().cast<int>();
  const BrickIndex high = ((point.array() + reach) / edge).floor().cast<int>();
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const Vec3 least = Vec3(x, y, z) * edge;
        const Vec3 nearest = point.cwiseMax(least).cwiseMin((least.array() + edge).matrix());
        if ((nearest - point).norm() > reach) continue;
        if (HeatBrick* brick = heat.bricks().warm_up({x, y, z})) 
          collect(*brick, heat, radius, reach, fine);
      }
    }
  }
  const double whole = 2.0 * kPi * radius * heat.tissue().electric_conductivity;
  conduct(radius, whole, gap);
  far_ = (0.5 * kPi - last) / whole;
}

void CurrentField::conduct(double radius, double whole, double gap) {
  std::array<double, kMostShells> wet{};
  for (const Voxel& voxel : voxels_) {
    for (int s = 0; s < shells_; ++s) {
      tissue_[s] += static_cast<double>(voxel.conductivity) * voxel.share[s] / shell_;
      wet[s] += static_cast<double>(voxel.if_wet) * voxel.share[s] / shell_;
    }
  }
  // How thick the dried layers are under the middle of the disc, where zeta is the depth over the radius.
  double dried = 0.0;
  for (int s = 0; s < shells_; ++s) {
    const double thick = radius * (std::tan((s + 1) * shell_) - std::tan(s * shell_));
    if (wet[s] > 0.0) dried += thick * (1.0 - tissue_[s] / wet[s]);
  }
  // Sparks fail gradually: not everywhere is the layer equally thick.
  const double sparks = gap > 0.0 ? kSparkShare * std::clamp(2.0 * (1.0 - dried / gap), 0.0, 1.0) : 0.0;
  near_ = 0.0;
  for (int s = 0; s < shells_; ++s) {
    conductance_[s] = std::max({tissue_[s], sparks * wet[s], kLeastShare * whole});
    near_ += shell_ / conductance_[s];
  }
}

void CurrentField::collect(HeatBrick& brick, const Bioheat& heat, double radius, double reach,
                           int fine) {
  const double h = heat.options().voxel, body = heat.options().body;
  for (int i = 0; i < BrickField::kVoxels; ++i) {
    const float fraction = brick.geometry->fraction[i];
    if (fraction <= 0.0f) continue;
    const Vec3 centre = heat.bricks().centre(brick, i) - point_;
    if (centre.norm() > reach + h) continue;
    Voxel voxel{&brick, i, 0.0f, 0.0f, {}};
    const int samples = centre.norm() < kNear * radius + h ? fine : kCoarse;
    const double part = h / samples;
    const double weight = fraction * part * part * part;
    for (int s = 0; s < samples * samples * samples; ++s) {
      const Vec3 at = centre +
                      ((Vec3(s % samples, s / samples % samples, s / (samples * samples)).array() +
                        0.5) * part - 0.5 * h).matrix();
      // Oblate coordinates about the disc, lengths over its radius.
      const double depth = at.dot(outward_) / radius;
      const double square = at.squaredNorm() / (radius * radius);
      const double t = square - 1.0;
      const double root = std::sqrt(t * t + 4.0 * depth * depth);
      const double zeta_square = 0.5 * (t + root);
      // At the rim the field is without bound, but its integral isn't.
      const double gradient = 1.0 / (radius * radius * (1.0 + zeta_square) *
                                     std::max(root, 0.5 * part / radius));
      const double u = std::atan(std::sqrt(std::max(0.0, zeta_square)));
      if (u > shells_ * shell_) continue;
      // Shared by the two nearest shells, so that nothing jumps as the disc moves; the outermost halves
      // have one.
      const double place = std::clamp(u / shell_ - 0.5, 0.0, shells_ - 1.0);
      const int shell = std::min(static_cast<int>(place), shells_ - 2);
      const double upper = place - shell, amount = weight * gradient;
      voxel.share[shell] += static_cast<float>((1.0 - upper) * amount);
      voxel.share[shell + 1] += static_cast<float>(upper * amount);
    }
    if (*std::max_element(voxel.share.begin(), voxel.share.end()) <= 0.0f) continue;
    const double kelvin = body + static_cast<double>(brick.warm->excess[i]);
    voxel.if_wet = static_cast<float>(electric_conductivity(heat.tissue(), 1.0, kelvin));
    voxel.conductivity =
        static_cast<float>(electric_conductivity(heat.tissue(), brick.water[i], kelvin));
    voxels_.push_back(voxel);
  }
}

CurrentField::Heating CurrentField::heat_with(Bioheat& heat, double current, double hottest,
                                              double dt) const {
  const ThermalTissue& tissue = heat.tissue();
  Heating given;
  for (int s = 0; s < shells_; ++s)
    given.sparks += current * current * shell_ / conductance_[s] * (1.0 - tissue_[s] / conductance_[s]);
  for (const Voxel& voxel : voxels_) {
    double power = 0.0;
    for (int s = 0; s < shells_; ++s) {
      const double slope = current / conductance_[s];
      power += static_cast<double>(voxel.conductivity) * voxel.share[s] * slope * slope;
    }
    const HeatBrick& brick = *voxel.brick;
    const double volume = brick.geometry->fraction[voxel.index] * heat.voxel_volume();
    const double water = brick.water[voxel.index] * tissue.density * tissue.water_fraction * volume;
    const double kelvin =
        heat.options().body + static_cast<double>(brick.warm->excess[voxel.index]);
    // What is on its way already counts; water must boil first. Beyond that nothing is left to warm but
    // char: a voxel that dries and chars within the step mustn't get what it would have held wet.
    const double room =
        heat.voxel_capacity(brick, voxel.index) * std::max(0.0, water::kBoiling - kelvin) +
        water * water::kLatentHeat +
        heat_capacity(tissue, 0.0, 1.0) * volume * (hottest - std::max(kelvin, water::kBoiling)) -
        static_cast<double>(brick.warm->source[voxel.index]) * heat.voxel_volume() * dt;
    const double taken = std::clamp(room / dt, 0.0, power);
    if (taken > 0.0) heat.heat_voxel(*voxel.brick, voxel.index, taken);
    given.tissue += taken;
    given.sparks += power - taken;
  }
  return given;
}

}  // namespace viscera
