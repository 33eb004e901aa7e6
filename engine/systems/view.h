// From the world to what the renderer sees: read-only.
#pragma once

#include <optional>

#include "engine/render/view.h"
#include "engine/scene/scene.h"
#include "engine/systems/key_frames.h"
#include "engine/world.h"

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

/// Density grids of the smoke volumes that hold particles, for pictures and volumes on disk.
void splat_smoke(World& world);

/// Mean transmittance of the smoke from the lens to a disc about the tip that burns, or the worst
/// of all tips; nothing where there is no instrument. Smoke as of the last splat_smoke().
std::optional<double> sight_of_tips(const World& world, const CameraView& camera);

/// Makes the normals that an organ lacks (OrganState::normals_fit).
void make_normals(const OrganModel& model, OrganState& state);

/// Spans into the world, whose organs get the normals that they lack: valid until its next step.
/// Smoke as of the last splat_smoke().
FrameView make_view(World& world, const SceneDescription& scene, const Endoscope& endoscope,
                    std::uint64_t picture);

}  // namespace viscera
