// Tissue below a tool, about the tool's axis: finite strains of a deep, flat body, total
// Lagrangian.
//
// Axisymmetric four-node elements on a graded grid in the half-plane (r, z), four points each;
// dilatation as its mean over the element (hyperelastic.h). Unknowns are displacements of the
// grid's nodes. The tool presses on rings of the surface: each a pressure, even over the ring,
// whose conjugate is the ring's mean displacement, as with a tool's cells. (Prescribing the surface
// node by node instead gives rings of infinite strain at its kinks, so that the answer drifts as
// the grid is refined.) Free surface beyond, held far away.
//
// About its axis a body has a tenth of the unknowns that it has in space, so that a Newton step
// with elements finer than the contact fits in a haptic tick; in space, the nodes of a hive of 80
// leave one ring under a tool.
//
// Everything is in units of the pattern's radius (lengths) and of the shear modulus (stresses), so
// that the grid grows with the pressed patch and nothing is computed anew when it does.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/types.h"
#include "kernels/hive/hyperelastic_model.h"

namespace viscera {

/// Rows r and depths z of the grid's nodes, ascending from 0; the last of each are held.
struct AxialGrid {
  std::vector<double> radii, depths;
  /// About `nodes` of them, for rings that end at these radii.
  static AxialGrid graded(std::span<const double> ring_ends, int nodes);
};

class AxialTissue {
 public:
  static constexpr int kMostRings = 7;
  using RingVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostRings, 1>;
  using RingMatrix =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostRings, kMostRings>;

  /// What the tissue does near a state, to first order: with changes dv of the rings' displacement
  /// and dp of the outward loads on them,
  ///   reaction(v + dv) = reaction + stiffness dv - cross^T dp   (force downwards that holds v)
  ///   lateral(v + dv)  = lateral + cross dv + yield dp          (outward displacement of the
  ///   rings)
  /// in which the residual of the state is made good.
  struct Linearisation {
    RingVector reaction, lateral;
    RingMatrix stiffness, cross, yield;
    static constexpr auto fields() {
      return std::tuple(
          field("reaction", &Linearisation::reaction), field("lateral", &Linearisation::lateral),
          field("stiffness", &Linearisation::stiffness), field("cross", &Linearisation::cross),
          field("yield", &Linearisation::yield));
    }
  };

  /// Takes all memory. The first ring begins on the axis, each where the last one ends.
  AxialTissue(AxialGrid grid, std::span<const double> ring_ends, HyperelasticModel model,
              double lambda_over_mu);

  int rings() const { return static_cast<int>(shares_.size()); }
  int nodes() const { return columns_ * rows_; }
  int unknowns() const { return unknowns_; }

  /// Undeformed.
  void reset() noexcept;

  /// About the present state, with these outward loads on the rings and what these grow by as the
  /// ring moves outwards. False: not positive (the tissue is about to give way), or not finite.
  bool linearise(const RingVector& load, const RingVector& load_slope) noexcept;
  const Linearisation& linearisation() const { return linear_; }

  /// Moves the state by a Newton step: rings by dv, with loads changed by dp; by less where nodes
  /// would go farther than `farthest`. Returns how far they would have gone; what was gone is
  /// `share` of that.
  double advance(const RingVector& dv, const RingVector& dp, double farthest,
                 double& share) noexcept;

  RingVector displacement() const noexcept { return -mean(1); }   ///< of the rings, downwards
  RingVector lateral() const noexcept { return mean(0); }         ///< of the rings, outwards
  double energy() const noexcept { return energy_; }              ///< of the last linearise()
  double least_volume() const noexcept { return least_volume_; }  ///< J there, over all points

  /// Displacements of all nodes, (r, z) each, z upwards, depth after depth of a radius.
  std::span<double> state() noexcept { return u_; }
  std::span<const double> state() const noexcept { return u_; }
  /// For tests: the internal forces of the state on all of them.
  std::span<const double> forces() const noexcept { return residual_; }

 private:
  struct Point {
    std::array<double, 4> by_r, by_z, over_r;  ///< of the four shape functions
    double weight;                             ///< volume
  };
  struct Element {
    std::array<int, 4> nodes;
    std::array<Point, 4> points;
    double volume;
  };

  int dof(int node, int component) const { return 2 * node + component; }
  double& band(int row, int column) {
    return band_[static_cast<std::size_t>(column * (width_ + 1) + row - column)];
  }
  void assemble() noexcept;
  void add_element(const Element& element) noexcept;
  void hold(int at) noexcept;

  HyperelasticModel model_;
  double lambda_;
  int columns_, rows_, width_, unknowns_ = 0, sides_;
  std::vector<Element> elements_;
  struct Share {
    int node;
    double weight;
  };
  RingVector mean(int component) const noexcept;

  std::vector<std::vector<Share>> shares_;  ///< of each ring: nodes of the surface in its mean
  std::vector<int> held_;
  std::vector<double> u_, residual_, band_;
  std::vector<double> solved_;  ///< by pressures, by loads, of the residual    (dofs x sides)
  std::vector<double> step_;
  RingMatrix lift_;  ///< displacement down per outward load
  RingVector free_;  ///< displacement down by which the residual is made good
  Linearisation linear_;
  double energy_ = 0.0, least_volume_ = 1.0;
};
static_assert(fields_cover<AxialTissue::Linearisation>());

}  // namespace viscera
