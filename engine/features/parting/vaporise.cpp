// Tissue that heat has taken: what has left as vapour is gone.
//
// Of a voxel of heat that share of its mass is left which hasn't boiled off or turned to fumes: so
// much of its place, as it shrinks about what it has lost. Where less than half is left there is
// none, and a wall comes.
#include <array>
#include <cmath>

#include "engine/features/cautery/cautery.h"
#include "engine/features/parting/parting.h"

namespace viscera {
namespace {

/// So much must be gone for another body to be asked for: a ball 1 mm wide [m3].
constexpr double kNoticed = 0.5e-9;

/// What is left about a voxel of heat, in it and its neighbours: by quadratic B-splines over the
/// middles of voxels, so that walls don't show these. Where there was no tissue at rest it goes on
/// as beside it.
class Left {
 public:
  Left(const Bioheat& heat, const BrickIndex& voxel) : voxel_(voxel) {
    const HeatBricks& bricks = heat.bricks();
    const ThermalTissue& tissue = heat.tissue();
    for (int n = 0; n < kWide * kWide * kWide; ++n) {
      const BrickIndex at = voxel + BrickIndex(n % kWide, n / kWide % kWide, n / (kWide * kWide)) -
                            BrickIndex::Constant(kWide / 2);
      const auto i = static_cast<std::size_t>(n);
      tissue_[i] = bricks.tissue_at(at);
      left_[i] = mass_left(tissue, bricks.water_at(at), bricks.charred_at(at));
    }
  }

  struct At {
    double left = 1.0;    ///< of its mass; 1 where there is no tissue about it
    double tissue = 0.0;  ///< the share of it that was
  };
  /// At a place less than kReach from the middle, by its place from there in voxels.
  At at(const Vec3& place) const {
    std::array<int, 3> nearest;
    std::array<std::array<double, 3>, 3> spline;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double along = place[static_cast<Eigen::Index>(axis)];
      const double round = std::floor(along + 0.5), off = along - round;
      nearest[axis] = static_cast<int>(round) + kWide / 2;
      spline[axis] = {0.5 * (0.5 - off) * (0.5 - off), 0.75 - off * off,
                      0.5 * (0.5 + off) * (0.5 + off)};
    }
    double sum = 0.0, weights = 0.0;
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
          const auto n = static_cast<std::size_t>(
              ((nearest[2] + z - 1) * kWide + nearest[1] + y - 1) * kWide + nearest[0] + x - 1);
          const double weight = spline[0][static_cast<std::size_t>(x)] *
                                spline[1][static_cast<std::size_t>(y)] *
                                spline[2][static_cast<std::size_t>(z)];
          sum += weight * tissue_[n] * left_[n];
          weights += weight * tissue_[n];
        }
    return weights > 0.0 ? At{sum / weights, weights} : At{};
  }
  const BrickIndex& voxel() const { return voxel_; }
  static constexpr double kReach = 1.5;  ///< of a voxel's spline [voxels]

 private:
  static constexpr int kWide = 5;
  BrickIndex voxel_;
  std::array<double, kWide * kWide * kWide> left_, tissue_;
};

/// Around the middle of that voxel, as far as its spline reaches; how much tissue that was [m3].
double take(const Left& left, double edge, TissueShare& gone) {
  const Vec3 middle = (left.voxel().cast<double>().array() + 0.5) * edge;
  const auto voxel_below = [&](const Vec3& place) -> TissueShare::Voxel {
    return (place / gone.voxel()).array().floor().cast<int>();
  };
  const double reach = Left::kReach * edge;
  const TissueShare::Voxel low = voxel_below(middle - Vec3::Constant(reach + gone.voxel()));
  const TissueShare::Voxel high = voxel_below(middle + Vec3::Constant(reach));
  double less = 0.0;
  for (int z = low.z(); z <= high.z(); ++z)
    for (int y = low.y(); y <= high.y(); ++y)
      for (int x = low.x(); x <= high.x(); ++x) {
        const TissueShare::Voxel voxel(x, y, z);
        const Vec3 from = (gone.middle(voxel) - middle) / edge;
        if (!(from.cwiseAbs().maxCoeff() < Left::kReach)) continue;
        const Left::At here = left.at(from);
        less += here.tissue * gone.limit(voxel, here.left);
      }
  return less * gone.voxel() * gone.voxel() * gone.voxel();
}

}  // namespace

void take_vaporised(World& world, const FrameContext&) {
  Pool<OrganCut>& organs = world.all<OrganCut>();
  for (std::size_t o = 0; o < organs.size(); ++o) {
    const OrganBurn* burn = world.find<OrganBurn>(organs.owner(o));
    if (!burn) continue;
    OrganCut& cut = organs[o];
    const double edge = burn->heat.options().voxel;
    for (const Vapour& vapour : burn->heat.vapour())
      cut.vaporised +=
          take(Left(burn->heat, burn->heat.bricks().voxel_of(vapour.position)), edge, cut.gone);
    if (cut.vaporised - cut.vaporised_asked > kNoticed) cut.changed = true;
  }
}

}  // namespace viscera
