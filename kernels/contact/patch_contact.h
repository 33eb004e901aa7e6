// Contact on a body whose compliance was prepared (tissue_contact.h): loads of cells are spread
// over the surface's places, and what is finer than these is added in closed form (near_field.h).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kernels/contact/near_modulus.h"
#include "kernels/contact/stiffness_update.h"
#include "kernels/contact/tissue_contact.h"
#include "kernels/contact/touchable_surface.h"
#include "kernels/contact/touched_compliance.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

struct DrawnSurface;
struct HalfColumns;

/// The surface, the compliance and the fields they stand on outlive it.
class PatchContact : public TissueContact {
 public:
  PatchContact(const SurfaceCompliance& compliance, const TouchableSurface& surface,
               const IsotropicMaterial& material);

  /// For draw(); and where displacements of places are kept in half precision, these. Both outlive
  /// it.
  void draw_on(const DrawnSurface& drawn, const HalfColumns* half);

  TissueAbilities abilities() const override;
  bool touchable(const Vec3& place) const override;

  bool fits(const State& state) const override;
  std::size_t memory_bytes() const;  ///< of the state, what is made from it, and anchors; about

  /// sigma = spread_factor() * (local spacing at the cell), but no less than half the radius of a
  /// wide cell's disc; where it comes from: see the source.
  static double spread_factor();
  /// The narrowest of them over the radius of a cell.
  static double narrowest_bell();

  /// What they do to every place and to each other. Wherever a later solve's last cells are these,
  /// with `backing`, they cost a product with the other cells' weights.
  void anchor(std::span<const ContactCell> cells) override;

  /// Its compliance, and the near field about each cell by the tissue there. Only for a symmetric
  /// compliance.
  void stiffen(std::shared_ptr<const StiffnessUpdate> update) override;
  const StiffnessUpdate* update() const override { return update_.get(); }

  /// Displacements of all places under the last solve's forces, as the function of that name
  /// (deformation.h) gives them from its response, up to round-off of the sums. While the same
  /// patch stays where it is, the columns of its cells are put together, a few a call, and then
  /// replace those of the places under it where that is fewer to read.
  void place_displacements(std::vector<float>& displacements);
  void place_displacements(const ContactResponse& response,
                           std::vector<float>& displacements) override;
  void draw(std::span<const float> displacements, std::span<const ContactCell> cells,
            const ContactSolution& solution, std::vector<Vec3f>& positions) const override;
  std::vector<Vec3> beside_places(std::size_t begin, std::size_t end) const override;

 protected:
  /// Weights, and `response_` as the body's part alone; then what is finer than places.
  void couple_places();
  void couple_nearby();
  std::size_t moving_cells() const;  ///< of the last see_places: those before the anchors
  /// Of the last see_places' moving cells: touchable places under them, ascending (m), and each
  /// cell's share of them as coefficients x basis.
  const std::vector<int>& touched() const { return touched_; }
  const MatrixX& coefficients() const { return coefficients_; }  ///< cells x r
  const MatrixX& basis() const { return basis_; }                ///< r x m
  /// They are too many to be those of a tool or two, or those of bodies that touch, and have no
  /// basis: coefficients() is the identity, and place_shares() are the shares, by cell.
  bool spread_out() const { return spread_out_; }
  /// A touched place, by its index among them, and its share of a cell's load.
  struct PlaceShare {
    int touched = 0;
    double share = 0.0;
  };
  const std::vector<std::vector<PlaceShare>>& place_shares() const { return place_shares_; }
  /// S C S^T by these shares, of one component of C on the touched places; cells x cells.
  MatrixX coupled_apart(const Eigen::MatrixXf& block) const;
  const TouchableSurface& surface() const { return surface_; }
  const DrawnSurface& drawn() const { return *drawn_; }
  void make_response() override;
  void drop_response() override;
  MatrixX taken_by_update(std::size_t begin, std::size_t end) const override;
  std::span<const double> moduli_by_update() const override;

 private:
  struct Anchors;

  bool ends_in_anchors(std::span<const Place> places) const;
  void couple_anchors();
  void places_changed() override;
  void spread_forces(std::span<const Vec3> forces, ContactResponse& response) override;
  NearField any_near_field() const override;
  void make_columns();
  static double bell_of(const Place& cell);  ///< [spacings of nodes]
  void spread_cells(std::span<const Place> places);
  void gather_compliance();
  const Eigen::MatrixXf& block(std::size_t part) const;
  double stiffness_about(const Vec3& position, const std::vector<LoadShare>& shares) const;
  void take_off_blocks();
  Mat3 near_between(std::size_t k, std::size_t l) const;
  bool see_each_other(std::size_t k, std::size_t l) const;  ///< through tissue
  void compress_weights();
  void list_place_shares();
  void couple_cells();
  std::optional<Mat3> near_pair(std::size_t k, std::size_t l) const;
  const std::vector<std::optional<Mat3>>& near_pairs(std::size_t moving);

  IsotropicMaterial material_of(double stiffness) const;
  void take_off_columns(std::span<const double> weights, float* columns) const;

  const SurfaceCompliance& compliance_;
  const TouchableSurface& surface_;
  IsotropicMaterial material_;
  const DrawnSurface* drawn_ = nullptr;
  const HalfColumns* half_ = nullptr;
  std::shared_ptr<const StiffnessUpdate> update_;

  std::shared_ptr<const Anchors> anchors_;

  // What follows from the state's places.
  bool anchored_ = false;             // the last cells are the anchors
  std::vector<double> stiffness_;     // of the tissue about each cell, over sound tissue's
  std::vector<NearModulus> modulus_;  // of sound tissue about each; empty: one everywhere
  std::vector<int> touched_;          // touchable places under the cells, ascending (m)
  std::vector<int> local_of_;         // touchable place -> index in touched_, or -1
  std::vector<std::vector<LoadShare>> spread_;  // per cell
  MatrixX weights_;                             // S: cells x m
  MatrixX basis_, coefficients_;                // S ~ coefficients (cells x r) basis (r x m)
  bool spread_out_ = false;                     // they have no basis: coefficients are the identity
  std::vector<std::vector<PlaceShare>> place_shares_;  // S, by cell
  // C on touched places: as prepared, and, where an update has taken something off, without that.
  TouchedCompliance prepared_;
  TouchedCompliance::Parts block_;
  // Of an update: V^T of the touched places, by component (rank x m), and the near field of sound
  // tissue between moving cells k and l <= k, at k (k + 1) / 2 + l.
  std::array<Eigen::MatrixXf, 3> modes_;
  std::vector<Mat3> sound_near_;
  // Near fields between the cells of before, at k (k + 1) / 2 + l; nothing: they don't see each
  // other. Many cells stay where they are as others come and go.
  struct NearPairs {
    std::vector<Place> places;
    std::vector<std::optional<Mat3>> pairs;
    bool anchored = false;  // the last of them are anchors: of these no pairs
  };
  NearPairs near_known_;
  std::vector<float> cell_columns_;  // C S^T: rows x (3 cells), where the patch has stayed
  std::size_t columns_made_ = 0;     // of those that count as built
};

}  // namespace viscera
