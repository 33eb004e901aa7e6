// From the world to what the renderer, volumes on disk and measures of sight see. Looking changes
// nothing of the world: what has to be made for it is kept beside it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/render/view.h"
#include "engine/scene/scene.h"
#include "engine/simulation/key_frames.h"
#include "engine/simulation/world.h"
#include "kernels/smoke/splat.h"

namespace viscera {

/// The endoscope of a scene: its path and optics.
class Endoscope {
 public:
  explicit Endoscope(const CameraDescription& description);
  /// At `time` [s]: the optics look `optics` away from the shaft's axis, downwards at roll 0.
  CameraView at(double time) const;

 private:
  CameraDescription description_;
  KeyFrames tip_, target_, roll_;
};

/// Linear RGB of a black body, relative to 5600 K, its greatest component 1.
Vec3 light_colour(double temperature_kelvin);

/// A smoke volume as it is shown.
struct ShownSmoke {
  SmokeGrid grid;      ///< without cells: no smoke has been there
  SmokeOptics optics;  ///< of its density
  // Where particles are drawn as sprites:
  std::vector<Vec3f> particle_places;  ///< from the domain's least corner [m]  (n)
  std::vector<float> particle_radii;   ///< [m]  (n)
};

/// The world's smoke volumes on grids, one each, and behind them the fog of its gas where there is
/// any; memory in `shown` is used again. Fog's density is that of smoke which takes as much light.
void splat_smoke(const World& world, std::vector<ShownSmoke>& shown);

/// Mean transmittance of the smoke from the lens to a disc about the tip that burns, or the worst
/// of all tips; nothing where there is no instrument. `smoke`: as of splat_smoke().
std::optional<double> sight_of_tips(const World& world, std::span<const ShownSmoke> smoke,
                                    const CameraView& camera);

/// The same to all of what the view shows at the distance that it points at.
double sight_of_view(const World& world, std::span<const ShownSmoke> smoke,
                     const CameraView& camera);

/// Normals of drawn surfaces. Most frames don't ask for them, so organs don't always have them
/// (OrganState::normals_fit): then they are made here, once a shape.
class ShownNormals {
 public:
  /// Of the world's organ at this place, unit, organ frame (V); valid until it is asked again. Of
  /// one that lies on the GPU those at rest.
  std::span<const Vec3f> of(const World& world, std::size_t organ);

 private:
  struct Made {
    bool fits = false;
    std::uint64_t version = 0;  ///< of the shape
    std::vector<Vec3f> normals;
  };
  std::vector<Made> made_;
};

/// What is made of one world so that it can be seen.
struct Shown {
  std::vector<ShownSmoke> smoke;
  ShownNormals normals;
  std::vector<std::vector<StrandHalf>> strands;  ///< of each bed
};

/// Spans into the world and into `shown`: valid until the world's next step. Smoke is that of
/// `shown`, as the last splat_smoke() left it.
FrameView make_view(const World& world, Shown& shown, const SceneDescription& scene,
                    const Endoscope& endoscope, std::uint64_t picture);

}  // namespace viscera
