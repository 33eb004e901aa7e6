// Any body, prepared as an organ is and pressed as an organ is: nodes, compliance, contact, drawn
// surface.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/verification/bodies.h"
#include "kernels/contact/deformation.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

struct BodyToPress {
  TriangleSurface surface;  ///< closed; also what is drawn [m]
  IsotropicMaterial material;
  SpacingField spacing;
  std::function<bool(const Vec3&)> is_fixed, is_touchable;
  std::string formulation = "galerkin";
};

/// Loads and what they did.
struct PressedAnswer {
  Vec3 force = Vec3::Zero();        ///< on the body, all loads together [N]
  std::vector<Vec3> displacements;  ///< of the drawn vertices [m]
  bool converged = false;
  double smallest_eigenvalue = 1.0;  ///< of the touching cells' compliance over its largest
  double lifted = 0.0;               ///< ContactSolution::lifted
};

/// Prepared once, pressed many times; not copied, since its parts point at each other.
class PressedBody {
 public:
  /// Fails as the formulation does, or where its name isn't known.
  static Result<std::unique_ptr<PressedBody>> prepare(BodyToPress wanted, const Progress& progress);
  PressedBody(const PressedBody&) = delete;
  PressedBody& operator=(const PressedBody&) = delete;

  /// Cells as a tool lays them.
  PressedAnswer press(std::span<const ContactCell> cells);
  /// Known forces on cells [N].
  PressedAnswer load(std::span<const ContactCell> cells, std::span<const Vec3> forces);
  /// The places of the surface for which `is_pinned` holds, each at a node, are moved by this, and
  /// nothing is finer than nodes: what pinning nodes inside a tool does in any method. Not
  /// converged where there is no such place.
  PressedAnswer pin(const std::function<bool(const Vec3&)>& is_pinned, const Vec3& displacement);

  /// Of the drawn vertices, under the loads of `response` and the near fields of `solution` about
  /// the cells, whose forces it holds [m].
  std::vector<Vec3> displacements(const ContactSolution& solution, const ContactResponse& response,
                                  std::span<const ContactCell> cells) const;
  /// Of an answer, at a place on the surface: between the drawn vertices about it [m].
  Vec3 displacement_at(const PressedAnswer& answer, const Vec3& place) const;

  const Formulation& formulation() const { return *formulation_; }
  const IsotropicMaterial& material() const { return material_; }
  const TriangleSurface& surface() const { return body_.surface; }
  const PointCloud& cloud() const { return body_.cloud; }
  const SurfaceCompliance& compliance() const { return compliance_; }
  const TouchableSurface& touchable() const { return touch_; }
  PatchContact& contact() { return *contact_; }
  const PreparationFigures& figures() const { return figures_; }
  double prepare_s() const { return prepare_s_; }  ///< nodes, matrices, compliance; all of it [s]
  /// What stays for running: compliance, touchable and drawn surface.
  std::size_t memory_bytes() const;

 private:
  PressedBody() = default;
  const Formulation* formulation_ = nullptr;
  IsotropicMaterial material_;
  NodedBody body_;
  std::unique_ptr<ShapeFunctions> fields_;
  SurfacePlaces places_;
  TouchableSurface touch_;
  DrawnSurface drawn_;
  SurfaceCompliance compliance_;
  std::unique_ptr<PatchContact> contact_;
  std::unique_ptr<SurfaceTree> tree_;
  PreparationFigures figures_;
  double prepare_s_ = 0.0;
};

/// The even spacing that gives a body at most this many nodes, and hardly fewer [m]. Fails where
/// none is found.
Result<double> even_spacing_for(const TriangleSurface& surface, std::size_t nodes,
                                const Progress& progress);

}  // namespace viscera
