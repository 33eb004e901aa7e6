// What pre-processing computes for one organ: constant, shared by its instances, kept in the cache.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

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

/// What acts on an organ, in the organ's frame: where instruments may press it (places along their
/// paths, with how far the tissue may have moved when they come by), where links pull at it, and
/// whether gravity does.
struct Reach {
  struct Attachment {
    Region region;  ///< world, with room for the spreading of the load
    Pose pose;      ///< of the organ in that world
  };
  std::vector<Vec3> points;  ///< [m]
  double radius = 0.0;       ///< touchable within this distance of a point [m]
  std::vector<Attachment> attachments;
  bool sags = false;  ///< under gravity that changes; places its whole body in reach of a force
  std::vector<Vec3> burns;   ///< where hooks pass with current; tissue near may coagulate [m]
  double burn_radius = 0.0;  ///< within this distance of one [m]

  bool covers(const Vec3& x) const;
  bool may_burn(const Vec3& x) const;
};

/// Immutable. All geometry in the organ's own frame.
struct OrganModel {
  TriangleSurface surface;            ///< drawn surface at rest
  std::vector<Vec3f> rest_positions;  ///< the same, as the state holds it
  std::vector<Vec3f> rest_normals;
  Box rest_bounds;
  std::vector<std::string>
      notes;  ///< how a wrapped surface differs from its file, what can't change

  // Deformable organs only (cloud empty otherwise):
  PointCloud cloud;
  IsotropicMaterial material;
  SurfaceCompliance compliance;  ///< its touchable square alone where `half_columns` holds all
  HalfColumns half_columns;      ///< empty: displacements are kept in single precision
  /// Displacements of the places of the surface per change of gravity along x, y and z [m per
  /// m/s2]; empty: it doesn't sag.                                                     (3 places x
  /// 3)
  std::vector<float> sag;
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
  std::size_t memory_bytes() const;
};

struct PrepareOptions {
  std::filesystem::path assets;
  bool use_cache = true;
};

/// Cache key of an organ: a hash of everything that goes into its model.
Result<std::string> organ_key(const OrganDescription& organ, const Tissue& tissue,
                              const Reach& reach, const PrepareOptions& options);

/// Asked about an organ's surface as soon as it is known, before anything is computed from it.
using SurfaceInspection = std::function<Result<void>(const TriangleSurface&)>;

/// Loads the model from the cache or computes and stores it. `warnings` gets what a person should
/// know (a broken cache that was rebuilt, a cache that could not be written).
Result<std::shared_ptr<const OrganModel>> prepare_organ(const OrganDescription& organ,
                                                        const Tissue& tissue, const Reach& reach,
                                                        const PrepareOptions& options,
                                                        const SurfaceInspection& inspect,
                                                        const Progress& progress,
                                                        std::vector<std::string>& warnings);

/// What preparation would build and cost, without factoring anything.
struct OrganPlan {
  std::size_t triangles = 0, nodes = 0, surface_nodes = 0, places = 0, touchable_places = 0;
  std::size_t memory_bytes = 0;       ///< of the prepared model
  std::size_t preparation_bytes = 0;  ///< peak while preparing
  double prepare_s = 0.0;             ///< expected on this machine's kind, no cache
  bool cached = false;
  TriangleSurface surface;
  PointCloud cloud;
  std::vector<std::string> notes;  ///< of the surface
};
Result<OrganPlan> plan_organ(const OrganDescription& organ, const Tissue& tissue,
                             const Reach& reach, const PrepareOptions& options);
/// The same for a surface that is there already; the organ's geometry isn't read, nor the cache.
Result<OrganPlan> plan_surface(TriangleSurface surface, const OrganDescription& organ,
                               const Reach& reach);

}  // namespace viscera
