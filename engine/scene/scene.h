// A scene as its author describes it: what the scene file says, checked and converted to SI, before
// anything is built from it. Times in seconds of the scene's clock, which starts at 0.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/scene/extras.h"
#include "engine/scene/region.h"
#include "engine/scene/step_rate.h"
#include "kernels/base/types.h"
#include "kernels/hive/hyperelastic_model.h"
#include "kernels/hive/prony.h"
#include "kernels/paff/fibres.h"

namespace viscera {

// --- organs -------------------------------------------------------------------------------------

/// A generated organ: a recipe of assets/organs, or one of the built-in bodies "sphere",
/// "hemisphere" (flat base at z = 0, pole up) and "block".
struct RecipeGeometry {
  std::string recipe;
  std::uint64_t seed = 1;
  double edge = 0.0;             ///< wanted triangle edge of the drawn surface [m]; 0: the recipe's
  std::optional<int> triangles;  ///< or an exact number of triangles
  double radius = 0.0;           ///< of sphere, hemisphere [m]
  Vec3 size = Vec3::Zero();      ///< of block [m]
  double scale = 1.0;            ///< applied to the recipe's own size
};

/// Wrapping of a surface that isn't closed, manifold and in one piece (engine/organ/wrap.h).
struct WrapDescription {
  double voxel = 0.0;  ///< of the grid of distances [m]
  double close = 0.0;  ///< gaps up to this width are closed everywhere [m]; 0: two voxels
};

/// An imported surface: OBJ, STL, PLY, glTF, GLB; closed, or wrapped.
struct FileGeometry {
  std::filesystem::path file;  ///< as found: absolute, or relative to the working folder
  double unit = 1.0;           ///< metres per unit of the file
  bool recentre = false;       ///< move the bounding box's centre to the origin
  double edge = 0.0;           ///< refine the drawn surface to this edge [m]; 0: as it is
  std::optional<WrapDescription> wrap;
};

using OrganGeometry = std::variant<RecipeGeometry, FileGeometry>;

struct Resolution {
  double spacing = 8e-3;   ///< greatest node spacing [m]
  double finest = 3e-3;    ///< least, in the fine part of the surface [m]
  double gradient = 0.25;  ///< growth of the spacing per distance from there
  /// Union; the fine part of the surface lies in it. Empty: it follows from where tools come.
  std::vector<Region> fine = {};
};

/// An extra of organs whose frames leave their poses: how far, at a time [s].
struct FrameMotion {
  std::function<Vec3(double time)> displacement;  ///< world [m]
};

/// How the displacement of the visible nodes under forces is kept; what gives the forces stays
/// single.
enum class DisplacementStorage { kSingle, kHalf };

/// What an organ answers forces with: its precomputed compliance (GPAFF), its energy at finite
/// strain (kernels/finite), or hives about whatever touches it (LPAFF). Auto: finite where
/// what acts on it strains it far (engine/organ/reach.h) and the energy knows all that the scene
/// says of it, else linear.
enum class Response { kAuto, kLinear, kFinite, kLocal };

/// How tissue at finite strain moves.
struct FiniteDescription {
  bool quasi_static = false;   ///< every step goes to equilibrium, without mass and viscosity
  double viscous_time = 0.02;  ///< viscosity over shear modulus [s]
  int iterations = 2;          ///< quasi-Newton steps a frame
  double time_step = StepRate().step();  ///< as the scene's [s]
};

/// How held tools feel tissue beyond small, slow strains.
struct MaterialDescription {
  HyperelasticModel model = HyperelasticModel::kLinear;
  bool relaxes = false;          ///< by the tissue's Prony series
  std::vector<PronyTerm> prony;  ///< or by this one
  std::optional<Fibres> fibres;  ///< in place of the tissue's; in the organ's frame
};

/// Where a part of an organ lies: a layer under all of the surface.
struct CapsulePart {
  double thickness = 0.0;  ///< [m]
};
/// A body of assets/organs.
struct RecipePart {
  std::string name;
  std::uint64_t seed = 1;
};
/// A label of a map.
struct LabelPart {
  std::filesystem::path file;
  std::int32_t label = 0;
};
/// Everywhere: moduli as whole numbers; 0: not known.
struct ModulusMapPart {
  std::filesystem::path file;
  double unit = 1.0;  ///< [Pa]
};

/// Tissue within an organ with a modulus, a density or fibres of its own; in the organ's frame.
struct PartDescription {
  std::variant<CapsulePart, Region, RecipePart, LabelPart, ModulusMapPart> where;
  std::optional<double> youngs_modulus;  ///< [Pa]; none: as what it lies in
  std::optional<double> density;         ///< [kg/m3]; likewise
  std::optional<Fibres> fibres;          ///< likewise
};

struct OrganDescription {
  std::string name;
  OrganGeometry geometry;
  std::string tissue;                    ///< a tissue of assets/tissues.json
  std::optional<double> youngs_modulus;  ///< overrides the tissue's [Pa]
  std::optional<double> poisson_ratio;
  MaterialDescription material;
  std::vector<PartDescription> parts;  ///< later ones over earlier ones
  Pose pose;
  std::vector<Region> fixed;  ///< union; the surface inside it doesn't move
  bool free = false;          ///< nothing holds it: it falls, slides and comes to rest
  std::string formulation = "galerkin";
  Response response = Response::kAuto;
  FiniteDescription finite;
  Resolution resolution;
  DisplacementStorage displacement_storage = DisplacementStorage::kSingle;
  bool deformable = true;  ///< false: scenery; no nodes, no contact
  Extras extras;           ///< what features' own keys say

  /// Where its frame stands at this time [s].
  Pose pose_at(double time) const;
};

// --- instruments --------------------------------------------------------------------------------

enum class InstrumentKind {
  kProbe,
  kGrasper,
  kHook,
  kSpatula,
  kScalpel,
  kScissors,
  kClipApplier,
  kBag
};

/// Whether monopolar current goes through such an instrument where its pedal asks for it.
constexpr bool conducts(InstrumentKind kind) {
  return kind == InstrumentKind::kHook || kind == InstrumentKind::kSpatula ||
         kind == InstrumentKind::kScissors;
}

/// How far each blade of scissors swings from the shaft's axis, fully open [rad]: 25 degrees.
inline constexpr double kScissorsOpen = 0.4363;

struct TipDescription {
  enum class Shape { kPoint, kSphere, kCapsule, kMesh };
  Shape shape = Shape::kSphere;
  double radius = 1.5e-3;      ///< sphere, capsule [m]; a point has none
  double length = 0.0;         ///< of the capsule's axis, along the shaft from the tip [m]
  std::filesystem::path file;  ///< mesh, shaft along +z, tip at the origin, as found
  double unit = 1e-3;
};

/// One key frame; values between keys are interpolated (position and jaw: monotone cubic
/// [Fritsch1980]).
struct InstrumentKey {
  double time = 0.0;        ///< [s]
  Vec3 tip = Vec3::Zero();  ///< [m]
  double power = 0.0;       ///< electrical power while the hook touches [W]; held, not interpolated
  double jaw = 1.0;         ///< 0 closed ... 1 open
  bool blade = false;       ///< the trigger of a knife between its jaws; held, not interpolated
};

struct InstrumentDescription {
  std::string name;
  InstrumentKind kind = InstrumentKind::kProbe;
  TipDescription tip;
  Vec3 trocar = Vec3::Zero();    ///< pivot point in the wall that the shaft passes [m]
  double shaft_radius = 2.5e-3;  ///< [m]
  double roll = 0.0;             ///< about the shaft; 0: hook and jaws point down [rad]
  double grip_limit = 6.0;       ///< greatest force that a closed jaw holds [N]
  double grip_radius = 4e-3;     ///< radius of the patch that a closed jaw holds [m]
  double friction = 0.0;         ///< Coulomb's coefficient between the tip and tissue
  std::vector<InstrumentKey>
      path;  ///< at least one, times ascending; where the hand goes, if haptic
  Extras extras;
};

// --- picture ------------------------------------------------------------------------------------

struct CameraKey {
  double time = 0.0;           ///< [s]
  Vec3 tip = Vec3::Zero();     ///< lens [m]
  Vec3 target = Vec3::Zero();  ///< a point on the shaft's axis beyond the lens [m]
  double roll = 0.0;           ///< about the axis [rad]
};

struct CameraDescription {
  double optics = 0.0;  ///< angle between the shaft's axis and the view: 0 or 30 deg [rad]
  double field_of_view = 1.2217;  ///< vertical [rad]
  std::vector<CameraKey> path;    ///< at least one
  bool round_mask = true;
};

struct LightDescription {
  double intensity = 1.0;              ///< relative to a lens light that exposes 10 cm well
  double colour_temperature = 5600.0;  ///< [K]
};

// --- the whole ----------------------------------------------------------------------------------

struct SceneDescription {
  std::filesystem::path file;  ///< where it came from
  std::string source;  ///< hash of all that it says, overrides and defaults included; "": no file's
  std::string name;
  std::string title;       ///< one line for people
  double duration = 10.0;  ///< [s]
  StepRate steps;
  std::uint64_t seed = 1;
  std::vector<OrganDescription> organs;
  std::vector<InstrumentDescription> instruments;
  std::optional<CameraDescription> camera;  ///< none: nothing can be rendered
  LightDescription light;
  Extras extras;
};

/// Of the scene and of all its organs.
void set_steps(SceneDescription& scene, const StepRate& steps);

}  // namespace viscera
