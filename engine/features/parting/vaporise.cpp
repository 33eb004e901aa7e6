// Tissue that heat has taken: what has left as vapour is gone.
//
// Of a voxel of heat that share of its mass is left which hasn't boiled off or turned to fumes: so
// much of its place, as it shrinks about what it has lost. Where less than half is left there is
// none, and a wall comes.
#include <array>

#include "engine/features/cautery/cautery.h"
#include "engine/features/parting/parting.h"

namespace viscera {
namespace {

/// So much must be gone for another body to be asked for: a ball 1 mm wide [m3].
constexpr double kNoticed = 0.5e-9;

/// What is left about a voxel of heat, in it and its neighbours; linear between their middles.
/// Where there was no tissue at rest it goes on as beside it.
class Left {
 public:
  Left(const Bioheat& heat, const BrickIndex& voxel) : voxel_(voxel) {
    const HeatBricks& bricks = heat.bricks();
    const ThermalTissue& tissue = heat.tissue();
    for (std::size_t n = 0; n < left_.size(); ++n) {
      const BrickIndex at = voxel +
                            BrickIndex(static_cast<int>(n % 3), static_cast<int>(n / 3 % 3),
                                       static_cast<int>(n / 9)) -
                            BrickIndex::Ones();
      tissue_[n] = bricks.tissue_at(at);
      left_[n] = mass_left(tissue, bricks.water_at(at), bricks.charred_at(at));
    }
  }

  struct At {
    double left = 1.0;    ///< of its mass; 1 where there is no tissue about it
    double tissue = 0.0;  ///< the share of it that was
  };
  /// At a place less than a voxel from the middle, by its place from there in voxels.
  At at(const Vec3& place) const {
    std::array<int, 3> low;
    std::array<double, 3> share;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = place[axis] < 0.0 ? 0 : 1;
      share[axis] = place[axis] - (low[axis] - 1);
    }
    double sum = 0.0, weights = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      std::size_t n = 0;
      double weight = 1.0;
      for (int axis = 2; axis >= 0; --axis) {
        const int up = corner >> axis & 1;
        n = 3 * n + static_cast<std::size_t>(low[axis] + up);
        weight *= up ? share[axis] : 1.0 - share[axis];
      }
      sum += weight * tissue_[n] * left_[n];
      weights += weight * tissue_[n];
    }
    return weights > 0.0 ? At{sum / weights, weights} : At{};
  }
  const BrickIndex& voxel() const { return voxel_; }

 private:
  BrickIndex voxel_;
  std::array<double, 27> left_, tissue_;
};

/// Around the middle of that voxel, less than its edge away; how much tissue that was [m3].
double take(const Left& left, double edge, TissueShare& gone) {
  const Vec3 middle = (left.voxel().cast<double>().array() + 0.5) * edge;
  const auto voxel_below = [&](const Vec3& place) -> TissueShare::Voxel {
    return (place / gone.voxel()).array().floor().cast<int>();
  };
  const TissueShare::Voxel low = voxel_below(middle - Vec3::Constant(edge + gone.voxel()));
  const TissueShare::Voxel high = voxel_below(middle + Vec3::Constant(edge));
  double less = 0.0;
  for (int z = low.z(); z <= high.z(); ++z)
    for (int y = low.y(); y <= high.y(); ++y)
      for (int x = low.x(); x <= high.x(); ++x) {
        const TissueShare::Voxel voxel(x, y, z);
        const Vec3 from = (gone.middle(voxel) - middle) / edge;
        if (!(from.cwiseAbs().maxCoeff() < 1.0)) continue;
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
