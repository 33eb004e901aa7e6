// What pre-processing computes for one organ: constant, shared by its instances, kept in the cache.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/organ/prepared_shape.h"
#include "engine/organ/reach.h"
#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/progress.h"
#include "kernels/base/result.h"
#include "kernels/contact/deformation.h"
#include "kernels/contact/half_columns.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/contact/stiffness_update.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

class FiniteSolver;

/// Immutable, and stays where it is made: its drawn surface points at its triangles. All geometry
/// in the organ's own frame.
struct OrganModel {
  OrganModel() = default;
  OrganModel(const OrganModel&) = delete;
  OrganModel& operator=(const OrganModel&) = delete;

  TriangleSurface surface;            ///< drawn surface at rest
  std::vector<Vec3f> rest_positions;  ///< the same, as the state holds it
  std::vector<Vec3f> rest_normals;
  Box rest_bounds;
  /// How a wrapped surface differs from its file, what can't change.
  std::vector<std::string> notes;

  // Deformable organs only (cloud empty otherwise):
  PointCloud cloud;
  std::shared_ptr<const ShapeFunctions> fields;  ///< while it is prepared
  IsotropicMaterial material;
  SurfaceCompliance compliance;  ///< its touchable square alone where `half_columns` holds all
  HalfColumns half_columns;      ///< empty: displacements are kept in single precision
  /// Displacements of the places of the surface per change of gravity along x, y and z [m per
  /// m/s2]; empty: it doesn't sag.                                              (3 places x 3)
  std::vector<float> sag;
  /// The same per way of each hold that moves [m per m]; empty: none does, or at finite strain.
  ///                                                                    (3 places x 3 holds)
  std::vector<float> hold_ways;
  /// Of tissue at finite strain; null: it is linear. `compliance` is then that of the body at rest,
  /// this one that of a step, both with columns when they are asked for.
  std::shared_ptr<const FiniteSolver> finite;
  SurfaceCompliance step_compliance;
  std::vector<Vec3> energy_points;  ///< of its energy, at rest [m]
  MatrixX hold_loads;  ///< as FiniteResponse::moved_holds                        (3 N x 3 holds)
  ChangeableRegion changeable;  ///< tissue that may coagulate; empty: none may, or none is followed
  SurfacePlaces places;
  TouchableSurface touchable;
  DrawnSurface drawn;
  double finest_spacing = 0.0;  ///< least node spacing [m]
  PreparationFigures figures;

  std::string key;  ///< of the cache
  double prepare_s = 0.0;
  bool cache_hit = false;

  bool deformable() const { return cloud.size() > 0; }
  bool in_half_precision() const { return half_columns.rows > 0; }
  /// Displacement components of the places of the surface.
  std::size_t displacement_rows() const {
    return in_half_precision() ? half_columns.rows : compliance.rows();
  }
  /// What keeping displacements in half precision saves [bytes]; negative where the touchable
  /// square, kept besides, is more than half of it all. 0 in single precision.
  std::ptrdiff_t saved_bytes() const;
  bool touchable_anywhere() const { return !compliance.touchable.empty(); }
  /// Of its columns: what was prepared, and what has been made since, by whoever shares the model.
  ColumnFigures column_figures() const;
  std::size_t memory_bytes() const;
};

/// Loads the model from the cache or computes and stores it, from what its plan began (null: it
/// wasn't planned). `warnings` gets what a person should know (a broken cache that was rebuilt, a
/// cache that could not be written).
Result<std::shared_ptr<const OrganModel>> prepare_organ(
    const OrganDescription& organ, const Tissue& tissue, const PreparedShape& shape,
    const BodyDemand& demand, std::shared_ptr<OrganModel> begun, const PrepareOptions& options,
    const Progress& progress, std::vector<std::string>& warnings);

}  // namespace viscera
