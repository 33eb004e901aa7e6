// What a scene says of tools that are held.
#pragma once

#include <filesystem>
#include <optional>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

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

/// Null: the path moves the tip.
const HapticDescription* haptic_of(const InstrumentDescription& instrument);
/// Whether some instrument is held.
bool holds_tools(const SceneDescription& scene);

FeatureKeys held_tools_keys();

}  // namespace viscera
