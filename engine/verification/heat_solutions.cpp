#include "engine/verification/heat_solutions.h"

#include <cmath>
#include <numbers>

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;

template <class Body>
void for_bricks(Bioheat& heat, const Box& box, const Body& body) {
  const HeatBricks& bricks = heat.bricks();
  const BrickIndex low = BrickField::brick_of(bricks.voxel_of(box.min()));
  const BrickIndex high = BrickField::brick_of(bricks.voxel_of(box.max()));
  for (int z = low.z(); z <= high.z(); ++z)
    for (int y = low.y(); y <= high.y(); ++y)
      for (int x = low.x(); x <= high.x(); ++x)
        if (HeatBrick* brick = heat.bricks().warm_up({x, y, z})) body(*brick);
}

}  // namespace

ThermalTissue plain_tissue() {
  ThermalTissue tissue;
  tissue.perfusion = 0.0;
  tissue.metabolic_heat = 0.0;
  tissue.conductivity_slope = 0.0;
  tissue.coagulation.frequency = 0.0;
  tissue.collagen.frequency = 0.0;
  tissue.pyrolysis.frequency = 0.0;
  return tissue;
}

double diffusivity(const ThermalTissue& tissue) {
  return tissue.conductivity / heat_capacity(tissue, 1.0);
}

double gaussian_pulse(const ThermalTissue& tissue, double energy, double width, double r,
                      double t) {
  const double square = width * width + 2.0 * diffusivity(tissue) * t;
  const double drained = std::exp(-tissue.perfusion * water::kBloodDensity * water::kBloodHeat * t /
                                  heat_capacity(tissue, 1.0));
  return energy / (heat_capacity(tissue, 1.0) * std::pow(2.0 * kPi * square, 1.5)) *
         std::exp(-r * r / (2.0 * square)) * drained;
}

double gaussian_source(const ThermalTissue& tissue, double power, double width, double r,
                       double t) {
  const double now = std::sqrt(2.0 * (width * width + 2.0 * diffusivity(tissue) * t));
  const double start = std::numbers::sqrt2 * width;
  const double strength = power / (4.0 * kPi * tissue.conductivity);
  if (r < 1e-6 * width) return strength * 2.0 / std::sqrt(kPi) * (1.0 / start - 1.0 / now);
  return strength / r * (std::erf(r / start) - std::erf(r / now));
}

double point_source(const ThermalTissue& tissue, double power, double r, double t) {
  return power / (4.0 * kPi * tissue.conductivity * r) *
         std::erfc(r / std::sqrt(4.0 * diffusivity(tissue) * t));
}

double perfused_reach(const ThermalTissue& tissue) {
  return std::sqrt(tissue.conductivity /
                   (tissue.perfusion * water::kBloodDensity * water::kBloodHeat -
                    tissue.metabolic_heat * tissue.metabolic_slope));
}

BoilingFront::BoilingFront(const ThermalTissue& tissue, double wall_excess, double body)
    : wall(wall_excess),
      boiling(water::kBoiling - body),
      dry(tissue.dry_conductivity / heat_capacity(tissue, 0.0)),
      wet(diffusivity(tissue)) {
  // What reaches the front through the dry tissue less what leaves it into the wet boils water.
  const double latent = tissue.density * tissue.water_fraction * water::kLatentHeat;
  const auto surplus = [&](double l) {
    const double m = l * std::sqrt(dry / wet);
    const double in = tissue.dry_conductivity * (wall - boiling) * std::exp(-l * l) /
                      (std::erf(l) * std::sqrt(kPi * dry));
    const double out =
        tissue.conductivity * boiling * std::exp(-m * m) / (std::erfc(m) * std::sqrt(kPi * wet));
    return in - out - latent * l * std::sqrt(dry);
  };
  double low = 1e-6, high = 3.0;
  for (int i = 0; i < 100; ++i) {
    lambda = 0.5 * (low + high);
    (surplus(lambda) > 0.0 ? low : high) = lambda;
  }
}

double BoilingFront::position(double t) const {
  return 2.0 * lambda * std::sqrt(dry * t);
}

double BoilingFront::excess(double x, double t) const {
  if (x < position(t))
    return wall - (wall - boiling) * std::erf(x / std::sqrt(4.0 * dry * t)) / std::erf(lambda);
  return boiling * std::erfc(x / std::sqrt(4.0 * wet * t)) /
         std::erfc(lambda * std::sqrt(dry / wet));
}

void heat_gaussian(Bioheat& heat, const Vec3& centre, double width, double power) {
  const Vec3 reach = Vec3::Constant(5.0 * width);
  const double h = heat.options().voxel;
  const auto below = [&](double x) { return 0.5 * std::erf(x / (std::numbers::sqrt2 * width)); };
  for_bricks(heat, Box(centre - reach, centre + reach), [&](HeatBrick& brick) {
    for (int i = 0; i < BrickField::kVoxels; ++i) {
      const Vec3 at = heat.bricks().centre(brick, i) - centre;
      double share = 1.0;
      for (int axis = 0; axis < 3; ++axis)
        share *= below(at[axis] + 0.5 * h) - below(at[axis] - 0.5 * h);
      if (share > 1e-12) heat.heat_voxel(brick, i, power * share);
    }
  });
}

void set_excess(Bioheat& heat, const Box& box, const std::function<double(const Vec3&)>& excess) {
  for_bricks(heat, box, [&](HeatBrick& brick) {
    brick.warm->altered = true;
    for (int i = 0; i < BrickField::kVoxels; ++i)
      brick.warm->excess[i] = brick.geometry->fraction[i] > 0.0f
                                  ? static_cast<float>(excess(heat.bricks().centre(brick, i)))
                                  : 0.0f;
  });
}

double tissue_volume(const Bioheat& heat) {
  double voxels = 0.0;
  for (std::size_t b = 0; b < heat.bricks().count(); ++b)
    for (const float fraction : heat.bricks().brick(b).geometry->fraction) voxels += fraction;
  return voxels * heat.voxel_volume();
}

void heat_evenly(Bioheat& heat, double energy, double dt) {
  const double density = energy / (dt * tissue_volume(heat));
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
    HeatBrick& brick = heat.bricks().brick(b);
    for (int i = 0; i < BrickField::kVoxels; ++i)
      heat.heat_voxel(brick, i, density * brick.geometry->fraction[i] * heat.voxel_volume());
  }
}

void hold_layer(Bioheat& heat, int axis, int layer, double excess) {
  constexpr int kEdge = HeatBricks::kEdge;
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
    HeatBrick& brick = heat.bricks().brick(b);
    const int local = layer - kEdge * brick.index[axis];
    if (!brick.warm || local < 0 || local >= kEdge) continue;
    brick.warm->altered = true;
    for (int i = 0; i < BrickField::kVoxels; ++i) {
      const int along[] = {i % kEdge, i / kEdge % kEdge, i / (kEdge * kEdge)};
      if (along[axis] == local) brick.warm->excess[i] = static_cast<float>(excess);
    }
  }
}

}  // namespace viscera
