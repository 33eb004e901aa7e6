// The hemisphere of the reference, prepared as an organ is and pressed as an organ is: nodes,
// compliance, contact, drawn surface.
#pragma once

#include <memory>
#include <string>

#include "engine/verification/hemisphere_reference.h"
#include "engine/verification/pressed_body.h"

namespace viscera {

/// Size and stiffness: those of the paper's test body [De2006] fig. 5.
inline constexpr double kHemisphereRadius = 25e-3;  // [m]
inline constexpr double kHemisphereModulus = 10e3;  // [Pa]

struct HemisphereOptions {
  std::string formulation = "galerkin";
  double poisson_ratio = 0.45;
  std::size_t nodes = 1100;      ///< at most; a few per cent fewer
  double fine_zone = 0.0;        ///< above 0: nodes are finest within this distance of the axis on
                                 ///< the dome, over R; 0: equally spaced everywhere. What is finer
                                 ///< than nodes is the near field's part, so that grading gains
                                 ///< little with the linear basis
  double coarsest = 0.2;         ///< spacing far from the fine zone, over R
  double touchable_zone = 0.75;  ///< touchable within this distance of the axis on the dome, over
                                 ///< R; 1 or more: everywhere, base included. Loads are spread over
                                 ///< about 0.35 R at 1,000 nodes and should stay inside
};

/// Loads on the pole and what they did.
struct HemisphereAnswer {
  double force = 0.0;               ///< on the body, down the axis [N]
  std::vector<Vec3> displacements;  ///< of the drawn vertices [m]
  bool converged = false;
  double smallest_eigenvalue = 1.0;  ///< of the touching cells' compliance over its largest
};

/// A load whose forces are known, ready for place_displacements and deform_drawn_surface.
struct HemispherePressure {
  std::vector<ContactCell> cells;
  std::vector<Vec3> forces;            ///< on the cells [N]
  std::vector<NearField> near_fields;  ///< of the cells
  ContactResponse response;
};

/// Prepared once, pressed many times; not copied, since its parts point at each other.
class HemisphereBody {
 public:
  /// Finds the spacing that gives the wanted number of nodes, then prepares. Fails as the
  /// formulation does, or where its name isn't known.
  static Result<std::unique_ptr<HemisphereBody>> prepare(const HemisphereOptions& options,
                                                         const Progress& progress);
  HemisphereBody(const HemisphereBody&) = delete;
  HemisphereBody& operator=(const HemisphereBody&) = delete;

  HemisphereAnswer press(HemisphereContact contact, double a_over_R, int rings);
  /// As stuck contact, but by moving the surface nodes within a of the axis: as finite elements do
  /// whose mesh knows nothing of the contact.
  HemisphereAnswer press_pinned(double a_over_R);

  /// 1 + 3 rings (rings + 1) cells that press as one tool of radius a (kernels/contact/
  /// cell_pattern.h), moved down as a whole. `tilt` [rad] turns the patch off the pole. Not for
  /// `press`.
  static std::vector<ContactCell> cells(HemisphereContact contact, double poisson_ratio,
                                        double a_over_R, int rings, double tilt);
  /// The smooth pressure about the pole, each cell's force split between the nodes and the near
  /// field as a tool's is (kernels/contact/near_field.h). Within the touchable zone.
  HemispherePressure pressure(double a_over_R) const;

  /// Relative L2 distance of displacements of the drawn vertices from the profile, over the area of
  /// the dome.
  double profile_error(const std::vector<Vec3>& displacements,
                       const HemisphereProfile& reference) const;

  const Formulation& formulation() const { return body_->formulation(); }
  const IsotropicMaterial& material() const { return body_->material(); }
  const TriangleSurface& surface() const { return body_->surface(); }
  const PointCloud& cloud() const { return body_->cloud(); }
  const SurfaceCompliance& compliance() const { return body_->compliance(); }
  const TouchableSurface& touchable() const { return body_->touchable(); }
  PatchContact& contact() { return body_->contact(); }
  const PreparationFigures& figures() const { return body_->figures(); }
  /// Nodes, matrices, compliance; all of it [s].
  double prepare_s() const { return body_->prepare_s(); }
  double finest_spacing() const { return finest_; }  ///< asked for [m]
  std::size_t memory_bytes() const { return body_->memory_bytes(); }

 private:
  HemisphereBody() = default;

  std::unique_ptr<PressedBody> body_;
  std::vector<double> dome_areas_;  // of the vertices; 0 on the base
  double finest_ = 0.0;
};

}  // namespace viscera
