#include "engine/verification/heat_case.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace viscera {
namespace {

constexpr double kCooked = 0.2;      // Omega of the half-cooked tissue
constexpr double kDepth = 0.2e-3;    // of the source's middle, and of the surface over z = 0 [m]
constexpr double kWidth = 0.5e-3;    // of the source [m]
constexpr double kPower = 15.0;      // [W]
constexpr float kLeastHarm = 1e-3f;  // below which differences are absolute

double edge_of(int edge_bricks, const Bioheat& heat) {
  return edge_bricks * HeatBricks::kEdge * heat.options().voxel;
}

// What isn't a number is worst.
void keep_worse(double& most, double a, double b, double scale) {
  const double off = std::abs(a - b) / scale;
  if (std::isnan(off) || off > most) most = off;
}

}  // namespace

HeatCase::HeatCase(int edge_bricks, std::shared_ptr<HeatPasses> passes, HeatReturn fields)
    : heat_(ThermalTissue{}, BioheatOptions{}, [](const Vec3& p) { return p.z() - kDepth; }) {
  const double edge = edge_of(edge_bricks, heat_);
  middle_ = Vec3(0.5 * edge, 0.5 * edge, -kDepth);
  const Box box(Vec3(0.0, 0.0, -edge + 1e-6), Vec3(edge - 1e-6, edge - 1e-6, 0.0));
  set_excess(heat_, box, [](const Vec3& p) {
    return 12.0 + 8.0 * std::sin(2e3 * p.x()) * std::sin(3e3 * p.y()) + 5.0 * std::sin(1e3 * p.z());
  });
  for (std::size_t b = 0; b < heat_.bricks().count(); ++b)
    heat_.bricks().brick(b).coagulation.fill(static_cast<float>(kCooked));
  heat_.compute_on(std::move(passes), fields);
}

void HeatCase::heat_middle() {
  heat_gaussian(heat_, middle_, kWidth, kPower);
}

double lesion_edge_error(double voxel, double dt, std::shared_ptr<HeatPasses> passes) {
  const ThermalTissue tissue = plain_tissue();
  BioheatOptions options;
  options.voxel = voxel;
  options.cooling.coefficient = 0.0;
  Bioheat heat(tissue, options);
  heat.compute_on(std::move(passes), HeatReturn::kWhenAsked);
  constexpr double kSourceWidth = 1e-3, kSourcePower = 0.7, kTime = 3.0;
  const int steps = static_cast<int>(std::lround(kTime / dt));
  for (int step = 0; step < steps; ++step) {
    heat_gaussian(heat, Vec3::Zero(), kSourceWidth, kSourcePower);
    heat.step(dt);
  }
  heat.fetch();
  double error = 0.0;
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
    const HeatBrick& brick = heat.bricks().brick(b);
    if (!brick.warm) continue;
    for (int i = 0; i < BrickField::kVoxels; ++i) {
      const double r = heat.bricks().centre(brick, i).norm();
      const double exact = gaussian_source(tissue, kSourcePower, kSourceWidth, r, kTime);
      if (exact < 15.0 || exact > 35.0) continue;
      error = std::max(error, std::abs(brick.warm->excess[i] - exact) / exact);
    }
  }
  return error;
}

HeatDifference heat_difference(const Bioheat& a, const Bioheat& b) {
  HeatDifference difference;
  if (a.bricks().count() != b.bricks().count()) return difference;
  double greatest = 1e-12;
  for (std::size_t n = 0; n < a.bricks().count(); ++n) {
    const HeatBrick& p = a.bricks().brick(n);
    const HeatBrick& q = b.bricks().brick(n);
    if (p.index != q.index || !p.warm != !q.warm || p.harmed != q.harmed) return {};
    for (int i = 0; i < BrickField::kVoxels; ++i) {
      if (p.warm) {
        greatest = std::max<double>(greatest, std::abs(p.warm->excess[i]));
        keep_worse(difference.excess, p.warm->excess[i], q.warm->excess[i], 1.0);
      }
      keep_worse(difference.water, p.water[i], q.water[i], 1.0);
      keep_worse(difference.charred, p.charred[i], q.charred[i], 1.0);
      for (const auto field :
           {&BrickTissue::dose, &BrickTissue::coagulation, &BrickTissue::collagen}) {
        const float harm = (p.*field)[i];
        keep_worse(difference.damage, harm, (q.*field)[i], std::max(kLeastHarm, harm));
      }
    }
  }
  difference.same_bricks = true;
  difference.excess /= greatest;
  return difference;
}

}  // namespace viscera
