#include "kernels/heat/current_field.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/heat/heat_room.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
/// How far heating is followed: a tenth of the power is left beyond.
constexpr double kReach = 6.0, kLeastReach = 3e-3;  // of the radius; [m]
/// A shell without tissue would stop all current; some always creeps along surfaces.
constexpr double kLeastShare = 1e-3;
/// Conductance of a dried shell that sparks cross, over the wet one's. [R]
constexpr double kSparkShare = 0.1;
/// What a voxel may take before the field follows: of the heat that would boil all its water away.
constexpr double kBite = 0.1;

using Shares = DiscField::Shares;
constexpr int kShells = DiscField::kMostShells;

double reach_of(double radius) {
  return std::max(kReach * radius, kLeastReach);
}

VISCERA_WIDE void add_up(const std::vector<Shares>& shares, const std::vector<double>& conductivity,
                         const std::vector<double>& if_wet, double* tissue, double* wet) {
  double by_tissue[kShells] = {}, by_wet[kShells] = {};
  for (std::size_t v = 0; v < shares.size(); ++v) {
    const double c = conductivity[v], w = if_wet[v];
    for (int s = 0; s < kShells; ++s) {
      const auto share = static_cast<double>(shares[v][s]);
      by_tissue[s] += c * share;
      by_wet[s] += w * share;
    }
  }
  std::memcpy(tissue, by_tissue, sizeof by_tissue);
  std::memcpy(wet, by_wet, sizeof by_wet);
}

VISCERA_WIDE void find_drive(const std::vector<Shares>& shares,
                             const std::vector<double>& conductivity,
                             const std::vector<double>& if_wet, const double* slope,
                             const double* spark, double* drive) {
  double by_shell[kShells], by_spark[kShells];
  std::memcpy(by_shell, slope, sizeof by_shell);
  std::memcpy(by_spark, spark, sizeof by_spark);
  for (std::size_t v = 0; v < shares.size(); ++v) {
    double squares[4] = {}, sparks[4] = {};
    for (int s = 0; s < kShells; s += 4) {
      for (int l = 0; l < 4; ++l) {
        const auto share = static_cast<double>(shares[v][s + l]);
        squares[l] += share * by_shell[s + l];
        sparks[l] += share * by_spark[s + l];
      }
    }
    drive[v] = conductivity[v] * ((squares[0] + squares[1]) + (squares[2] + squares[3])) +
               if_wet[v] * ((sparks[0] + sparks[1]) + (sparks[2] + sparks[3]));
  }
}

}  // namespace

CurrentField::CurrentField(Bioheat& heat, const Vec3& point, const Vec3& outward, double radius,
                           double gap, double dt)
    : disc_(point, outward, radius, reach_of(radius), heat.options().voxel),
      point_(point),
      outward_(outward),
      voxel_(heat.options().voxel),
      gap_(gap),
      dt_(dt),
      whole_(2.0 * kPi * radius * heat.tissue().electric_conductivity),
      bite_(kBite * heat.voxel_volume() * heat.tissue().density * heat.tissue().water_fraction *
            water::kLatentHeat) {
  const double reach = reach_of(radius), edge = HeatBricks::kEdge * heat.options().voxel;
  const BrickIndex low = ((point.array() - reach) / edge).floor().cast<int>();
  const BrickIndex high = ((point.array() + reach) / edge).floor().cast<int>();
  std::vector<BrickIndex> near;
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const Vec3 least = Vec3(x, y, z) * edge;
        const Vec3 nearest = point.cwiseMax(least).cwiseMin((least.array() + edge).matrix());
        if ((nearest - point).norm() <= reach) near.emplace_back(x, y, z);
      }
    }
  }
  const std::vector<HeatBrick*> bricks = heat.bricks().warm_up(near);
  std::vector<Voxels> found(bricks.size());
  parallel_for_each_index(bricks.size(), 1,
                          [&](std::size_t b) { found[b] = collect(*bricks[b], heat); });
  for (const Voxels& voxels : found) {
    voxels_.state.insert(voxels_.state.end(), voxels.state.begin(), voxels.state.end());
    voxels_.shares.insert(voxels_.shares.end(), voxels.shares.begin(), voxels.shares.end());
  }
  double struck = 0.0;
  for (const Voxel& voxel : voxels_.state) struck += voxel.struck;
  for (Voxel& voxel : voxels_.state) voxel.struck = struck > 0.0 ? voxel.struck / struck : 0.0;
  conductivity_.resize(voxels_.state.size());
  if_wet_.resize(voxels_.state.size());
  drive_.resize(voxels_.state.size());
  far_ = (0.5 * kPi - disc_.last()) / whole_;
  follow(heat.tissue());
}

void CurrentField::follow(const ThermalTissue& tissue) {
  for (std::size_t v = 0; v < voxels_.state.size(); ++v) {
    const Voxel& voxel = voxels_.state[v];
    const double boiled = voxel.taken - voxel.to_boil;
    const double kelvin = boiled < 0.0 ? voxel.kelvin + voxel.taken / voxel.capacity
                                       : std::max(voxel.kelvin, water::kBoiling);
    const double water = boiled < 0.0            ? voxel.water
                         : boiled < voxel.latent ? voxel.water * (1.0 - boiled / voxel.latent)
                                                 : 0.0;
    if_wet_[v] = electric_conductivity(tissue, 1.0, kelvin);
    conductivity_[v] =
        voxel.taken < voxel.room ? electric_conductivity(tissue, water, kelvin) : 0.0;
  }
  conduct();
}

void CurrentField::conduct() {
  // Conductances of a unit of u: by tissue alone, if it were wet, and with sparks [S].
  std::array<double, kMostShells> tissue{}, wet{}, with_sparks{}, slope{}, spark{};
  const double shell = disc_.shell();
  add_up(voxels_.shares, conductivity_, if_wet_, tissue.data(), wet.data());
  // How thick the dried layers are under the middle of the disc, where zeta is the depth over the
  // radius.
  double dried = 0.0;
  for (int s = 0; s < disc_.shells(); ++s) {
    const double thick = disc_.radius() * (std::tan((s + 1) * shell) - std::tan(s * shell));
    if (wet[s] > 0.0) dried += thick * (1.0 - tissue[s] / wet[s]);
    tissue[s] /= shell;
    wet[s] /= shell;
  }
  // Sparks fail gradually: not everywhere is the layer equally thick.
  const double crossed =
      gap_ > 0.0 ? kSparkShare * std::clamp(2.0 * (1.0 - dried / gap_), 0.0, 1.0) : 0.0;
  near_ = outside_ = 0.0;
  for (int s = 0; s < disc_.shells(); ++s) {
    with_sparks[s] = std::max({tissue[s], crossed * wet[s], kLeastShare * whole_});
    near_ += shell / with_sparks[s];
    slope[s] = 1.0 / (with_sparks[s] * with_sparks[s]);
    // Sparks through a dried layer heat that layer.
    const double between = shell / with_sparks[s] * (1.0 - tissue[s] / with_sparks[s]);
    if (wet[s] > 0.0)
      spark[s] = between / (wet[s] * shell);
    else
      outside_ += between;
  }
  find_drive(voxels_.shares, conductivity_, if_wet_, slope.data(), spark.data(), drive_.data());
}

/// Of the voxel with this middle, if it were all tissue: the outermost layer, as far as the disc
/// reaches, blurred over a voxel so that it doesn't matter where the voxels are.
double CurrentField::struck_share(const Vec3& centre) const {
  const Vec3 from = centre - point_;
  const double depth = -from.dot(outward_);
  const double aside = (from + depth * outward_).norm();
  return std::max(0.0, 1.0 - std::abs(depth / voxel_ - 0.5)) *
         std::clamp((disc_.radius() - aside) / voxel_ + 0.5, 0.0, 1.0);
}

CurrentField::Voxels CurrentField::collect(HeatBrick& brick, const Bioheat& heat) const {
  Voxels voxels;
  std::array<Shares, HeatBricks::kEdge> shares;
  for (int row = 0; row < BrickField::kVoxels; row += HeatBricks::kEdge) {
    if (!disc_.share_row(heat.bricks().centre(brick, row), shares)) continue;
    for (int x = 0; x < HeatBricks::kEdge; ++x) {
      const int i = row + x;
      const float fraction = brick.geometry->fraction[i];
      Shares& share = shares[static_cast<std::size_t>(x)];
      if (fraction <= 0.0f || *std::max_element(share.begin(), share.end()) <= 0.0f) continue;
      for (float& one : share) one *= fraction;
      Voxel voxel{};
      voxel.brick = &brick;
      voxel.index = i;
      voxel.fraction = fraction;
      const HeatRoom room = heat_room(heat, brick, i);
      voxel.kelvin = room.kelvin;
      voxel.water = brick.water[i];
      voxel.capacity = room.capacity;
      voxel.to_boil = room.to_boil;
      voxel.latent = room.latent;
      voxel.room = room.room;
      // Of other tips, or of this one at other places.
      voxel.taken = heat_taken(heat, brick, i, dt_);
      voxel.struck = fraction * struck_share(heat.bricks().centre(brick, i));
      voxels.state.push_back(voxel);
      voxels.shares.push_back(share);
    }
  }
  return voxels;
}

double CurrentField::lasts(double current, double sparks) const {
  double most = 0.0;  // power that a voxel takes, over what of it is tissue [W]
  const double square = current * current;
  for (std::size_t v = 0; v < drive_.size(); ++v) {
    const Voxel& voxel = voxels_.state[v];
    most = std::max(most, (drive_[v] * square + voxel.struck * sparks) / voxel.fraction);
  }
  return most > 0.0 ? bite_ / most : dt_;
}

CurrentField::Heating CurrentField::heat_with(Bioheat& heat, double current, double time,
                                              double sparks) {
  Heating given;
  const double square = current * current * time, struck = sparks * time;
  given.gas = square * outside_;
  double landed = 0.0;
  for (std::size_t v = 0; v < drive_.size(); ++v) {
    Voxel& voxel = voxels_.state[v];
    const double by_sparks = voxel.struck * struck, energy = drive_[v] * square + by_sparks;
    landed += by_sparks;
    const double left = std::max(0.0, voxel.room - voxel.taken), taken = std::min(left, energy);
    if (taken > 0.0) {
      heat.heat_voxel(*voxel.brick, voxel.index, taken / dt_);
      given.sparks += taken * (by_sparks / energy);
    }
    // Full to the last bit: the sum's rounding mustn't decide whether it still conducts.
    voxel.taken = energy < left ? voxel.taken + taken : std::max(voxel.taken, voxel.room);
    given.tissue += taken;
    given.gas += energy - taken;
  }
  given.gas += struck - landed;  // rounding, and all of it where no tissue lies under the spot
  return given;
}

}  // namespace viscera
