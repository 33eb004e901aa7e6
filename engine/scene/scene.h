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
#include "engine/scene/interval.h"
#include "engine/scene/region.h"
#include "kernels/base/types.h"
#include "kernels/heat/electrode.h"
#include "kernels/hive/hyperelastic_model.h"
#include "kernels/hive/prony.h"
#include "kernels/smoke/smoke_passes.h"

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

/// What an organ answers forces with: its precomputed compliance (GPAFF), or hives about
/// whatever touches it (LPAFF).
enum class Response { kGlobal, kLocal };

/// How held tools feel tissue beyond small, slow strains.
struct MaterialDescription {
  HyperelasticModel model = HyperelasticModel::kLinear;
  bool relaxes = false;          ///< by the tissue's Prony series
  std::vector<PronyTerm> prony;  ///< or by this one
};

struct OrganDescription {
  std::string name;
  OrganGeometry geometry;
  std::string tissue;                    ///< a tissue of assets/tissues.json
  std::optional<double> youngs_modulus;  ///< overrides the tissue's [Pa]
  std::optional<double> poisson_ratio;
  MaterialDescription material;
  Pose pose;
  std::vector<Region> fixed;  ///< union; the surface inside it doesn't move
  std::string formulation = "galerkin";
  Response response = Response::kGlobal;
  Resolution resolution;
  DisplacementStorage displacement_storage = DisplacementStorage::kSingle;
  bool deformable = true;  ///< false: scenery; no nodes, no contact
  bool sags = true;        ///< a change of gravity moves it, if it is deformable
  bool stiffens = true;    ///< and shrinks where it coagulates
  bool spared = false;     ///< burning it is a mistake of the trainee's, which reports count
  Extras extras;           ///< what features' own keys say

  /// Where its frame stands at this time [s].
  Pose pose_at(double time) const;
};

// --- links --------------------------------------------------------------------------------------

/// Springs between two organs' surfaces, or between one and the ground: a ligament, a gallbladder's
/// bed. Without tension where both organs stand undeformed at their poses.
struct LinkDescription {
  static constexpr const char* kGround = "ground";

  std::string name;
  std::array<std::string, 2> between;  ///< organs; at most one of them kGround, which never moves
  Region region;                       ///< sphere or box that holds both ends; world, organs at
                                       ///< their poses
  double stiffness = 0.0;              ///< of all springs together, in every direction [N/m]
};

// --- instruments --------------------------------------------------------------------------------

enum class InstrumentKind { kProbe, kGrasper, kHook, kSpatula };

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
};

/// The nodes that travel with a haptic tool's tip (kernels/hive).
struct HiveDescription {
  /// What moves its edge: the body's precomputed field, the half-space's, nothing.
  enum class Periphery { kCoupled, kBoussinesq, kFixed };

  double radius = 0.0;  ///< of the influence region on the surface [m]; 0: from the tip's size
  int nodes = 0;        ///< 0: as many as a tick has time for
  std::optional<Periphery> periphery;  ///< none: coupled where the organ has a global response
  bool paper = false;  ///< the published equations in place of the ones that converge
};

/// A tool that is held: its tip goes where a device's does, and forces go back, at 1 kHz.
struct HapticDescription {
  enum class Device { kSimulated, kRecorded, kNetwork };
  /// How firmly the modelled hand holds a simulated device.
  enum class Grip { kLoose, kMedium, kFirm };

  Device device = Device::kSimulated;
  std::filesystem::path recording;  ///< absolute, or relative to the working folder
  int port = 18944;                 ///< of the network device: TCP, OpenIGTLink's own
  Grip grip = Grip::kMedium;
  double coupling_stiffness = 0.0;  ///< between device and tool [N/m]; 0: the servo's default
  HiveDescription hive;
};

struct InstrumentDescription {
  std::string name;
  InstrumentKind kind = InstrumentKind::kProbe;
  TipDescription tip;
  Vec3 trocar = Vec3::Zero();              ///< pivot point in the wall that the shaft passes [m]
  double shaft_radius = 2.5e-3;            ///< [m]
  double roll = 0.0;                       ///< about the shaft; 0: hook and jaws point down [rad]
  double grip_limit = 6.0;                 ///< greatest force that a closed jaw holds [N]
  double grip_radius = 4e-3;               ///< radius of the patch that a closed jaw holds [m]
  double friction = 0.0;                   ///< Coulomb's coefficient between the tip and tissue
  CurrentMode mode = CurrentMode::kBlend;  ///< of the generator of a hook or spatula
  std::vector<InstrumentKey>
      path;  ///< at least one, times ascending; where the hand goes, if haptic
  std::optional<HapticDescription> haptic;  ///< none: the path moves the tip
  Extras extras;
};

/// True for a hook that carries current at some time.
bool carries_current(const InstrumentDescription& tool);

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

// --- smoke --------------------------------------------------------------------------------------

/// A hook whose burns give smoke, by its name, or a place that gives smoke steadily.
struct EmitterDescription {
  std::string instrument;          ///< empty: a place
  Vec3 position = Vec3::Zero();    ///< [m]
  Vec3 direction = Vec3::UnitZ();  ///< unit
  double radius = 1.5e-3;          ///< of the ball [m]
  double rate = 0.0;               ///< of smoke [kg/s]
  double particles = 1000.0;       ///< [1/s]
  double speed = 0.12;             ///< of the jet [m/s]
  double excess = 60.0;            ///< over the gas [K]
  Interval when;
};

enum class SmokeLook { kMarch, kSprites };

struct SmokeDescription {
  std::string name;
  Box domain;           ///< [m]
  double voxel = 2e-3;  ///< of the written volume [m]
  int max_particles = 25000;
  double spacing = 3e-3;  ///< support radius of the particles' kernels [m]
  Laplacian laplacian = Laplacian::kPairwise;
  double lifetime = 20.0;        ///< of a particle [s]
  double particle_mass = 1e-10;  ///< of one that a burn gives off [kg]
  SmokeLook look = SmokeLook::kMarch;
  std::vector<EmitterDescription> emitters;  ///< empty: every hook that burns in the domain
};

struct InletDescription {
  Vec3 position = Vec3::Zero();     ///< [m]
  Vec3 direction = -Vec3::UnitZ();  ///< unit
  double radius = 3e-3;             ///< [m]
  double flow = 0.0;                ///< [m3/s]
  Interval when;
};

struct LeakDescription {
  Vec3 position = Vec3::Zero();  ///< [m]
  double radius = 3e-3;          ///< [m]
};

struct EvacuatorDescription {
  std::string instrument;        ///< draws at its tip; empty: at `position`
  Vec3 position = Vec3::Zero();  ///< [m]
  double radius = 5e-3;          ///< within which particles are taken [m]
  double flow = 0.0;             ///< [m3/s]
  Interval when;
};

struct GasDescription {
  double pressure = 1600.0;     ///< over atmosphere [Pa]
  double temperature = 310.15;  ///< [K]
  int cells = 32;               ///< along the longest side; 0: the gas stands still
  std::optional<Box> domain;    ///< none: what holds all smoke volumes [m]
  double cavity = 3e-3;         ///< volume of the whole cavity [m3]
  std::vector<InletDescription> inlets;
  std::vector<LeakDescription> leaks;
  std::vector<EvacuatorDescription> evacuators;

  /// CO2 as an ideal gas at this temperature and this pressure over atmosphere [kg/m3].
  double density() const;
};

// --- heat ---------------------------------------------------------------------------------------

/// What is published of burns like the one that a scene makes.
struct PublishedLesion {
  double least_depth = 0.0, most_depth = 0.0, least_width = 0.0, most_width = 0.0;  ///< [m]
  std::string source;
};

struct HeatDescription {
  double voxel = 0.5e-3;  ///< of the bricks in which heat spreads [m]
  std::string lesion_of;  ///< a hook whose first burn is measured; empty: none is
  std::optional<PublishedLesion> published;  ///< beside that
};

// --- gravity ------------------------------------------------------------------------------------

/// How the table lies at one time; both angles 0: level, the patient on the back.
struct TableKey {
  double time = 0.0;       ///< [s]
  double head_up = 0.0;    ///< about the patient's x axis: the head rises over the feet [rad]
  double left_down = 0.0;  ///< about the table's long axis: the left side sinks [rad]
};

/// Gravity in the world's frame, which is the patient's and turns with the table. Organs have their
/// rest shapes under the gravity in which they were imaged: only what it differs from that moves
/// them.
struct GravityDescription {
  double acceleration = 9.81;            ///< [m/s2]
  Vec3 rest_direction = -Vec3::UnitZ();  ///< unit, of gravity while the organs were imaged
  std::vector<TableKey> table;           ///< times ascending; none: level

  /// False: gravity is always the one in which the organs were imaged.
  bool changes() const;
};

// --- the whole ----------------------------------------------------------------------------------

struct SceneDescription {
  std::filesystem::path file;  ///< where it came from
  std::string source;  ///< hash of all that it says, overrides and defaults included; "": no file's
  std::string name;
  std::string title;       ///< one line for people
  double duration = 10.0;  ///< [s]
  std::uint64_t seed = 1;
  std::vector<OrganDescription> organs;
  std::vector<LinkDescription> links;
  std::vector<InstrumentDescription> instruments;
  std::optional<CameraDescription> camera;  ///< none: nothing can be rendered
  LightDescription light;
  std::vector<SmokeDescription> smoke;
  GasDescription gas;
  HeatDescription heat;
  std::optional<GravityDescription> gravity;  ///< none: organs weigh nothing
  Extras extras;
};

}  // namespace viscera
