// The elastic energy of a body at finite strain, over the same points, consistent gradients and
// dilatation cells as its linear stiffness.
//
// Tissue is stable neo-Hookean [Smith2018]. With F the deformation gradient and J its determinant,
//   W = mu/2 (|F|^2 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2
// acts point by point with the part of lambda that the linear body has pointwise; the averaged part
// acts on the change of volume projected on the polynomials psi_k of each cell c:
//   averaged/2 sum_c sum_k theta_ck^2,  theta_ck = sum_q w psi_k(y_q) (J_q - 1).
// It is finite where tissue is turned inside out, so that it comes back. Fibres add theirs
// (fibre_law.h). The hold keeps the
// quadratic form that it has in the linear body (Nitsche's), in the frame of what holds it. At rest
// the Hessian is the linear stiffness, unless the body was imaged under its weight: then the energy
// is that from the shape without stress (unloaded_shape.h), less what it is in the image and less
// the work of the weight there, so that the imaged shape is at rest with an energy of 0.
//
// Evaluating it is bound by memory, so points are kept in packs of four, with all nodes that one of
// the four reaches, and their gradients in single precision: 4e-7 of a gradient of displacements
// within some spacings, which is what they act on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/base/types.h"
#include "kernels/finite/continuation.h"
#include "kernels/finite/finite_layout.h"
#include "kernels/finite/hold_rows.h"
#include "kernels/finite/pulled_tissue.h"
#include "kernels/finite/relaxation.h"
#include "kernels/finite/tissue_change.h"
#include "kernels/paff/block_matrix.h"
#include "kernels/paff/elastic_region.h"

namespace viscera {

/// What resists change of strain within a step of dt: it adds (time mu / dt) |E - E_before|^2, time
/// being the ratio of viscosity to shear modulus.
struct Viscosity {
  double over_step = 0.0;          ///< time / dt; 0: none
  std::span<const double> before;  ///< Strains at the step's start
};

/// Tissue that has stiffened and shrunk, as FiniteBody::changed lays it out. With s the factor of
/// its moduli, e its shrinkage and g = 1 / (1 - e): the energy pointwise is that of g F, and what
/// is averaged acts on g^3 (1 + D) - 1, D being the projected change of volume; both times s / g^3,
/// the share of volume that is left without stress. Of small strains that is what elastic_region.h
/// adds to a stiffness.
struct ChangedTissue {
  /// Of a pack's points: g, and s / g^3.
  struct Pack {
    std::array<double, 4> growth, factor;
  };
  std::vector<Pack> packs;  ///< empty: nothing has changed
};

/// What a tangent that only preconditions may have otherwise.
struct TangentChange {
  double shear = 1.0;      ///< as if mu were so many times as great
  bool pointwise = false;  ///< as if all of lambda acted point by point: half as many entries
};

/// The second derivative of the energy at each point, for a body's tangent_times; the tissue's
/// change outlives it.
struct PointTangents {
  std::unique_ptr<float[]> packs;
  std::span<const ChangedTissue::Pack> changed;
};

/// The constant part, shared between simulations and threads.
class FiniteBody {
 public:
  /// `region`: all points of the body (GalerkinSystem::region). `hold`: what its hold adds to the
  /// stiffness (GalerkinSystem::hold). Fails where a group of points reaches over 65,535 nodes.
  /// `unloaded`: from the imaged shape to the one without stress (3 N); empty: they are the same.
  /// `weight`: the nodes' that acts in the image [N] (3 N); empty: what keeps the body at rest
  /// there.
  static Result<FiniteBody> create(const ElasticRegion& region, const SymmetricBlockMatrix& hold,
                                   std::span<const double> unloaded = {},
                                   std::span<const double> weight = {});

  /// What a call works in; one a thread that calls.
  struct Workspace {
    std::vector<std::vector<double>> forces;  ///< of each piece's nodes: a component's four lanes
    std::vector<double> energies;             ///< of each piece
  };

  /// `change`: at the points of the region that it was created from. Factors below 1 count as 1,
  /// shrinkages below 0 or above a half as these, and so do those that are no numbers (as none).
  /// `swelling`: length that all of it has gained over length besides, over -1.
  ChangedTissue changed(const TissueChange& change, double swelling = 0.0) const;

  /// Elastic energy [J] of displacements (3 N, node-major) [m]; its derivative [N] is added to
  /// `gradient` unless that is empty. The same bits for any number of threads.
  double energy(std::span<const double> displacements, std::span<double> gradient,
                Workspace& workspace, const Viscosity& viscosity = {},
                const ChangedTissue& changed = {}, const Overstress& overstress = {}) const;

  /// Of that what its hold alone has; of a body that was imaged under its weight, from where it is
  /// unloaded.
  double hold_energy(std::span<const double> displacements, std::span<double> gradient) const;
  /// All but the hold and the weight under which it was imaged.
  FiniteLayout layout() const;

  /// The memory goes on by a step that ended at these displacements; what it does in the next.
  Overstress relax(std::span<const double> displacements, const ChangedTissue& changed,
                   std::span<const SteppedTerm> terms, TissueMemory& memory) const;
  bool fits(const TissueMemory& memory, std::size_t terms) const;  ///< its sizes
  /// What the tissue of a body remembers that goes on as this one.
  TissueMemory continued(const FiniteBody& before, const TissueMemory& memory, std::size_t terms,
                         const Continuation& continuation) const;

  /// Deformation gradients averaged over the cells about each node                          (N)
  std::vector<Mat3> mean_gradients(std::span<const double> displacements) const;

  /// Of each point in the order of the region that it was created from, as of sound tissue.  (Q)
  std::vector<PointDeformation> deformations(std::span<const double> displacements) const;
  /// Of the same points, without stress [m3]                                                (Q)
  std::vector<double> point_volumes() const;
  LawModuli moduli() const { return {mu_, lambda_, averaged_}; }

  /// From where it has no stress.
  Strains strains(std::span<const double> displacements) const;

  /// The second derivative [N/m], exact; indefinite under strong compression.
  SymmetricBlockMatrix tangent(std::span<const double> displacements,
                               const TangentChange& change = {}) const;
  /// What the same is made of at each point, of what has had all the time to relax.
  PointTangents point_tangents(std::span<const double> displacements) const {
    return point_tangents(displacements, kUnchanged);
  }
  PointTangents point_tangents(std::span<const double> displacements,
                               const ChangedTissue& changed) const;
  PointTangents point_tangents(std::span<const double>, ChangedTissue&&) const = delete;
  /// It times some vectors, without putting it together; (3 N) x (any). In single precision; the
  /// same bits for any number of threads, and however many vectors a machine's registers hold at
  /// once (`in_pairs`: two on any).
  MatrixX tangent_times(const PointTangents& tangents, const MatrixX& directions,
                        bool in_pairs = false) const;

  std::size_t nodes() const { return nodes_; }
  std::size_t points() const { return points_; }
  std::size_t cells() const { return cell_begin_.size() - 1; }
  double volume() const;  ///< without stress [m3]
  /// From the imaged shape to that without stress [m]; empty: they are the same              (3 N)
  std::span<const double> unloaded() const { return unloaded_; }
  /// That acts where it isn't what keeps the imaged shape at rest [N]; empty: it is.          (3 N)
  std::span<const double> weight() const {
    return rests_as_imaged_ ? std::span<const double>() : image_forces_;
  }
  /// Of the body so deformed [m3].
  double volume(std::span<const double> displacements) const;
  std::size_t memory_bytes() const;

 private:
  FiniteBody() = default;
  static const ChangedTissue kUnchanged;
  static constexpr std::size_t kLanes = 4;
  /// Numbers of the points of a pack.
  using Lane = std::array<double, kLanes>;
  /// Cells that are summed by one thread, with numbers of their own for the nodes they reach.
  struct Piece {
    std::size_t first_cell = 0, last_cell = 0;
    std::vector<int> nodes;
  };
  struct CellPoints;
  struct CellView;
  struct TangentView;
  /// Of a pack's points: fibre_law.h with moduli over the relative modulus, which the weights have.
  struct FibrePack {
    std::array<Lane, 3> direction;
    Lane quarter, bend;
  };

  void add_pack(const ElasticRegion& region, std::span<const std::size_t> points, Piece& piece,
                std::vector<int>& number);
  void find_means(const ElasticRegion& region, std::span<const std::size_t> points,
                  std::span<const std::size_t> cell_begin);
  void unload(std::span<const double> unloaded, std::span<const double> weight);
  /// Displacements from where it has no stress; `room` holds them where these are others.
  std::span<const double> from_unloaded(std::span<const double> displacements,
                                        std::vector<double>& room) const;
  double energy_unloaded(std::span<const double> displacements, std::span<double> gradient,
                         Workspace& workspace, const Viscosity& viscosity,
                         const ChangedTissue& changed, const Overstress& overstress) const;
  TissueMemory memory_at_rest(std::size_t terms) const;
  /// Visits pack, lane and point of the region of each point.
  template <class Visit>
  void each_point(const Visit& visit) const {
    std::size_t i = 0;
    for (std::size_t pack = 0; pack < weights_.size(); ++pack)
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        if (weights_[pack][lane] > 0.0) visit(pack, lane, order_[i++]);
  }
  CellPoints points_of(std::size_t cell, std::span<const ChangedTissue::Pack> changed) const;
  CellView view(std::size_t cell, const Viscosity& viscosity, const ChangedTissue& changed,
                const Overstress& overstress) const;
  double relax_pack(std::size_t pack, const Strains& strains, const ChangedTissue& changed,
                    std::span<const SteppedTerm> terms, TissueMemory& memory, Overstress& sums,
                    std::array<double, 4>& theta) const;
  static double add_cell(const CellView& cell, const double* displacements, double* scratch,
                         double* forces);
  SymmetricBlockMatrix pointwise_at_rest(double shear) const;
  void add_hold(SymmetricBlockMatrix& tangent) const;
  TangentView tangent_view(std::size_t cell, const PointTangents& tangents) const;
  static void find_tangent(const TangentView& cell, const double* displacements);
  template <class In>
  static void add_tangent(const TangentView& cell, const float* directions, float* scratch,
                          float* forces);
  static void add_tangent_in_pairs(const TangentView& cell, const float* directions, float* scratch,
                                   float* forces);
  static void add_tangent_in_fours(const TangentView& cell, const float* directions, float* scratch,
                                   float* forces);
  /// How many vectors at once, and by what: the same digits by both.
  struct TangentPass {
    std::size_t vectors = 0;
    void (*add)(const TangentView&, const float*, float*, float*) = nullptr;
  };
  static TangentPass tangent_pass(bool in_pairs);
  void hold_times(const MatrixX& directions, MatrixX& product) const;
  static double add_averaged(const CellView& cell, const double* dilatation, double* derivative);
  static void find_strains(const CellView& cell, const double* displacements, double* strains);
  static void find_deformations(const CellView& cell, const double* displacements, double* found);
  std::vector<double> gathered(const Piece& piece, std::span<const double> displacements) const;
  double add_piece(const Piece& piece, std::span<const double> displacements, bool with_forces,
                   const Viscosity& viscosity, const ChangedTissue& changed,
                   const Overstress& overstress, std::vector<double>& forces) const;
  void add_hold(std::span<const double> displacements, std::span<double> gradient, double& energy,
                const Overstress& overstress) const;
  /// Visits the nodes of one of a pack's points: number of the piece, gradient.
  template <class Visit>
  void each_node(std::size_t pack, std::size_t lane, const Visit& visit) const {
    for (std::size_t e = begin_[pack]; e < begin_[pack + 1]; ++e) {
      const std::array<float, 3 * kLanes>& g = gradients_[e];
      const Vec3 gradient(g[lane], g[kLanes + lane], g[2 * kLanes + lane]);
      if (!gradient.isZero(0.0)) visit(entry_nodes_[e], gradient);
    }
  }
  FibrePack fibre_pack(const ElasticRegion& region, std::span<const std::size_t> points) const;
  Vec3 fibre_direction(std::size_t pack, std::size_t lane) const {
    const std::array<Lane, 3>& a = fibres_[pack].direction;
    return {a[0][lane], a[1][lane], a[2][lane]};
  }
  Mat3 gradient_at(std::size_t pack, std::size_t lane, const Piece& piece,
                   std::span<const double> displacements) const;

  std::size_t nodes_ = 0;
  double mu_ = 0.0, lambda_ = 0.0, averaged_ = 0.0;  // [Pa]
  std::vector<Piece> pieces_;
  std::size_t points_ = 0;
  std::vector<std::size_t> order_;          // of the region's points, as packs have them      (Q)
  std::vector<std::size_t> cell_begin_{0};  // packs of each cell                          (C + 1)
  /// Volumes times relative modulus, and volumes [m3]; 0 of what fills up a pack         (packs)
  std::vector<Lane> weights_, volumes_;
  std::vector<std::array<Lane, 4>> psi_;    // [m^-1.5]; empty: nothing is averaged        (packs)
  std::vector<FibrePack> fibres_;           // empty: there are none                       (packs)
  std::vector<std::size_t> begin_{0};       // entries of each pack                    (packs + 1)
  std::vector<std::uint16_t> entry_nodes_;  // numbers of the piece                      (entries)
  /// Along x of the four points, along y, along z [1/m]                                 (entries)
  std::vector<std::array<float, 3 * kLanes>> gradients_;
  HoldRows hold_;
  std::vector<double> unloaded_;      // empty: it has no stress in the image [m]           (3 N)
  std::vector<double> image_forces_;  // of the energy, in the image [N]                    (3 N)
  double image_energy_ = 0.0;         // [J]
  bool rests_as_imaged_ = true;
  /// Gradients averaged over each cell [1/m], of all nodes that it reaches.
  std::vector<std::size_t> mean_begin_{0};
  std::vector<int> mean_nodes_;
  std::vector<Vec3> means_;
  /// Share of each cell in the mean gradient of a node: rows are nodes.
  std::vector<std::size_t> share_begin_{0};
  std::vector<int> share_cells_;
  std::vector<double> shares_;
};

}  // namespace viscera
