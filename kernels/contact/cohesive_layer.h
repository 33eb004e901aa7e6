// A layer of tissue that holds two surfaces together: bonds side by side, each of which yields and
// parts by a law of its own (cohesive_law.h). Forces between the bodies act on cells of their
// surfaces, which lie as far apart as nodes do; bonds lie closer, and open as the cells about them
// have come apart. So a layer parts bond by bond though no body can open from one to the next.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/types.h"
#include "kernels/contact/cohesive_law.h"
#include "kernels/contact/yielding_joints.h"

namespace viscera {

/// What of each cell's opening a bond has; a bond's shares sum to 1.
struct BondShares {
  std::vector<std::uint32_t> begin{0};  ///< of each bond in the next two        (bonds + 1)
  std::vector<std::uint32_t> cells;
  std::vector<double> values;
  std::size_t bonds() const { return begin.size() - 1; }
};

/// Shares by which fields that are linear along the surface are taken as they are: moving least
/// squares over the cells within `radius`, in the plane across each bond's `normal`. A bond with
/// too few cells about it has the nearest one's opening. `joins(bond, cell)`: whether a cell counts
/// for a bond; a bond for which none does has no shares. None given: all do.
BondShares bond_shares(std::span<const Vec3> bonds, std::span<const Vec3> normals,
                       std::span<const Vec3> cells, double radius,
                       const std::function<bool(std::size_t, std::size_t)>& joins = {});

struct CohesiveLayer {
  CohesiveLaw law;
  std::vector<double> areas;  ///< of each bond [m2]
  BondShares shares;
  std::size_t cells = 0;
  /// Over the layer's edge a film may lie, which its outermost bonds hold, too: its law counts a
  /// length of edge where `law` counts an area (N/m, N/m2, J/m).
  CohesiveLaw film;
  std::vector<double> edges;  ///< length of edge of each bond [m]; empty: there is no film

  double edge(std::size_t bond) const { return edges.empty() ? 0.0 : edges[bond]; }
  /// Of a bond that has been open so far at most [m]: force over opening [N/m].
  double stiffness(std::size_t bond, double opened) const;
  /// ... what has gone into parting it [J].
  double spent(std::size_t bond, double opened) const;
};

/// The length of edge that each bond stands for: as wide as it is itself, where over a third of
/// what lies around it, in the plane across its `normal`, has no bond within `radius`; else 0.
std::vector<double> layer_edges(std::span<const Vec3> bonds, std::span<const Vec3> normals,
                                std::span<const double> areas, double radius);

/// What has parted a bond, where force hasn't.
inline constexpr std::uint8_t kPartedByHeat = 1;
inline constexpr std::uint8_t kPartedByCut = 2;  ///< the tissue at one of its ends has gone

/// What has become of a layer's bonds.
struct BondStates {
  std::vector<double> opened;           ///< how far each has been open at most [m]     (bonds)
  std::vector<std::uint8_t> parted_by;  ///< kPartedByHeat ...; 0: nothing but force    (bonds)
  static constexpr auto fields() {
    using B = BondStates;
    return std::tuple(field("opened", &B::opened), field("parted_by", &B::parted_by));
  }
};
static_assert(fields_cover<BondStates>());

BondStates whole_bonds(const CohesiveLayer& layer);
/// Neither force nor heat nor a cut has parted it.
bool holds(const CohesiveLayer& layer, const BondStates& states, std::size_t bond);

/// A layer within a step. Bonds soften as far as the step opens them, and no farther: what a
/// search only tried leaves nothing.
class LayerInStep final : public YieldingJoints {
 public:
  /// Both outlive it. Joints are the cells that some bond still holds, in their order.
  LayerInStep(const CohesiveLayer& layer, const BondStates& before);

  /// The layer's cells that are joints, ascending.
  const std::vector<std::size_t>& joined() const { return joined_; }

  const MatrixX& softness() const override { return softness_; }
  bool follow(std::span<const Vec3> apart) override;

  /// How far its bonds have come in this step.
  BondStates after() const;

 private:
  void assemble();
  double left_of(std::size_t bond) const;  // of its stiffness, as open as it is in this step

  const CohesiveLayer& layer_;
  const BondStates& before_;
  std::vector<std::size_t> joined_;
  std::vector<int> joint_of_;   // of each cell; -1: none
  std::vector<double> opened_;  // of each bond, in this step
  std::vector<double> left_;    // as softness_ has them
  MatrixX softness_;
};

}  // namespace viscera
