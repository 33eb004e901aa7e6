// What the renderer sees of the world: read-only, filled once a picture by the engine
// (engine/run/view.cpp). The renderer knows nothing of organs' models or of smoke's particles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/tissues.h"
#include "kernels/base/types.h"
#include "kernels/heat/heat_bricks.h"
#include "kernels/points/surface.h"
#include "kernels/smoke/smoke_optics.h"

namespace viscera {

class Buffer;

/// A surface that shaders deformed and left on the GPU, in the renderer's own context.
struct DeviceSurface {
  const Buffer* positions = nullptr;  ///< three floats a vertex; null: not on the GPU
  const Buffer* normals = nullptr;    ///< likewise
  std::size_t first_vertex = 0;       ///< of the organ, in both
};

/// One organ's drawn surface. Spans stay valid while the picture is drawn.
struct OrganView {
  std::uint32_t id = 0;  ///< stable over the run: the renderer keeps buffers by it
  std::string name;
  const TriangleSurface* rest = nullptr;  ///< organ frame [m]; another one where it was cut
  std::span<const Vec3f> positions;       ///< deformed vertices, organ frame [m]     (V)
  std::span<const Vec3f> normals;         ///< deformed unit normals, organ frame     (V)
  std::span<const float> depths;          ///< of cuts' walls below the skin [m]; empty: whole (V)
  DeviceSurface device;                   ///< where given, drawn in place of the two above
  std::uint64_t surface_version = 0;      ///< raised when positions or normals changed
  Pose pose;
  TissueLook look;
  const HeatBricks* burn = nullptr;  ///< what heat made of it, rest frame; null: nothing
  std::uint64_t burn_version = 0;    ///< raised when `burn` changed
  double temperature =
      std::numeric_limits<double>::quiet_NaN();  ///< of its surface [K]; NaN: unknown
};

/// One instrument: a shaft from the tip through the trocar, and a working end drawn by kind.
struct InstrumentView {
  enum class Kind {
    kProbe,
    kGrasper,
    kHook,
    kSpatula,
    kScalpel,
    kScissors,
    kClipApplier,
    kBag,
    kClip,  ///< `tip` is its middle, its bars lie along `shaft_direction` and part along the side
    kMesh
  };
  std::uint32_t id = 0;
  std::string name;
  Kind kind = Kind::kProbe;
  Vec3 tip = Vec3::Zero();               ///< [m]
  Vec3 shaft_direction = Vec3::UnitZ();  ///< unit, from the tip towards the trocar
  Vec3 side_direction =
      Vec3::UnitX();             ///< unit, across the shaft: where the hook bends, the jaws open
  double shaft_radius = 2.5e-3;  ///< [m]
  double shaft_length = 0.3;     ///< [m]
  double tip_radius = 1.5e-3;    ///< [m]
  /// Of a scalpel's edge, from the tip along the shaft; of scissors' blades, to the hinge; of a
  /// clip's bars, as wide as the tip [m].
  double blade_length = 0.0;
  double mouth_radius = 0.0, sack_depth = 0.0;  ///< of a bag; the mouth is open by `jaw` [m]
  double jaw = 1.0;  ///< 0 closed ... 1 open; of a clip: between its bars [m]
  bool energised = false;
  const TriangleSurface* mesh = nullptr;  ///< kMesh: shaft along +z, tip at the origin [m]
};

/// Half of a strand of connective tissue between two organs: a thread that tapers from its foot on
/// one of them to where its other half goes on, or to where it tore.
struct StrandHalf {
  Vec3f foot = Vec3f::Zero();   ///< world [m]
  float foot_radius = 0.0f;     ///< [m]
  Vec3f reach = Vec3f::Zero();  ///< from the foot to the end, world [m]
  float end_radius = 0.0f;      ///< [m]
  Vec3f bend = Vec3f::Zero();   ///< by which the end lies aside of a straight reach, world [m]
  float seed = 0.0f;            ///< tells strands apart, in [0, 1)
  float charred = 0.0f;         ///< 0 ... 1
};

/// What a bed's bonds look like.
struct BedView {
  std::uint32_t id = 0;  ///< stable over the run
  std::string name;
  std::span<const StrandHalf> halves;
};

/// One smoke volume on a dense grid of cell centres, x fastest. Volumes may overlap: what they hold
/// adds up.
struct SmokeView {
  enum class Look {
    kMarch,    ///< light marched through the density
    kSprites,  ///< one textured square a particle, as in [De2006]
  };
  Look look = Look::kMarch;
  Box domain;  ///< [m]
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::span<const float> density;      ///< smoke mass per volume [kg/m3]          (nx ny nz)
  std::span<const float> temperature;  ///< excess over the gas [K]; empty: unknown (nx ny nz)
  double background = 0.0;             ///< smoke mixed evenly into the whole cavity [kg/m3]
  SmokeOptics optics;
  // For sprites alone; positions are relative to the domain's least corner.
  std::span<const Vec3f> particles;        ///< [m]                                           (n)
  std::span<const float> particle_radii;   ///< to which a particle's smoke has spread [m]    (n)
  std::span<const float> particle_masses;  ///< [kg]                                          (n)
};

struct CameraView {
  Vec3 position = Vec3::Zero();  ///< lens [m]
  Vec3 forward = Vec3::UnitY();  ///< unit view direction (after the optics' angle)
  Vec3 up = Vec3::UnitZ();       ///< unit, square to forward
  double distance = 0.1;         ///< of what the shaft points at, from the lens [m]
  double field_of_view = 1.2;    ///< vertical [rad]
  bool round_mask = true;
  double barrel = 0.18;            ///< distortion per square of the picture's height; the
                                   ///< rim of the field of view stays where it is
  bool automatic_exposure = true;  ///< half way to a middle tone, as camera heads do
  double exposure = 1.0;           ///< factor besides
};

struct FrameView {
  CameraView camera;
  double light_intensity = 1.0;      ///< 1 exposes tissue at 10 cm well
  Vec3 light_colour = Vec3::Ones();  ///< linear RGB
  std::vector<OrganView> organs;
  std::vector<InstrumentView> instruments;
  std::vector<BedView> beds;
  std::vector<SmokeView> smoke;
  double gas_temperature = 310.15;  ///< [K]
  std::uint64_t frame = 0;          ///< number of the picture: seeds jitter
};

}  // namespace viscera
