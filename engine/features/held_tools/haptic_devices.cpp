#include "engine/features/held_tools/haptic_devices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/features/held_tools/haptic_recording.h"
#include "haptics/devices/network_device.h"
#include "haptics/devices/recording.h"
#include "haptics/devices/simulated_device.h"

namespace viscera {
namespace {

/// The path is handed on in samples so far apart [s].
constexpr double kSample = 0.01;
/// Back from a path's end to its beginning [m/s], and at least so long [s].
constexpr double kWayBack = 0.1, kPause = 0.5;

double strength_of(HapticDescription::Grip grip) {
  switch (grip) {
    case HapticDescription::Grip::kLoose:
      return 0.0;
    case HapticDescription::Grip::kMedium:
      return 0.5;
    case HapticDescription::Grip::kFirm:
      return 1.0;
  }
  return 0.5;
}

/// The device's frame, turned as the scene's, its work space about the middle of the path.
Pose placement_of(const InstrumentDescription& instrument, const Box& work_space) {
  Box path;
  for (const InstrumentKey& key : instrument.path) path.extend(key.tip);
  return {path.center() - work_space.center(), Quaternion::Identity()};
}

Result<void> check_path(const InstrumentDescription& instrument, const DeviceLimits& limits,
                        const Pose& placement) {
  for (std::size_t k = 0; k < instrument.path.size(); ++k) {
    const Vec3 at = placement.to_local(instrument.path[k].tip);
    if (limits.work_space.contains(at)) continue;
    const Vec3 size = 1e3 * limits.work_space.sizes();
    return failure(fmt::format(
        "path/{}/tip_mm: {:.0f} mm outside the device's work space, expected a path that fits into "
        "{:.0f} x {:.0f} x {:.0f} mm",
        k, 1e3 * limits.work_space.exteriorDistance(at), size.x(), size.y(), size.z()));
  }
  return {};
}

/// The instrument's movement in the device's frame, again and again until `seconds`.
HandPath hand_path(const std::vector<InstrumentKey>& keys, const KeyFrames& path,
                   const Pose& placement, double seconds) {
  HandPath hand;
  hand.sampled = true;
  const double first = keys.front().time, last = keys.back().time;
  const double back = std::max(kPause, (keys.back().tip - keys.front().tip).norm() / kWayBack);
  for (double begin = 0.0; begin <= seconds; begin += last + back) {
    const auto samples = static_cast<int>(std::ceil((last - first) / kSample));
    for (int i = 0; i <= samples; ++i) {
      const double time = std::min(last, first + i * kSample);
      hand.keys.push_back(
          {begin + time, {placement.to_local(path.at(time)), Quaternion::Identity()}, 0});
    }
  }
  return hand;
}

Result<OpenedDevice> open_recorded(const InstrumentDescription& instrument) {
  auto recording = load_recording(haptic_of(instrument)->recording);
  if (!recording) return std::unexpected(recording.error());
  OpenedDevice opened;
  opened.placement = placement_of(instrument, recording->limits.work_space);
  opened.device = std::make_unique<RecordedDevice>(std::move(*recording));
  return opened;
}

Result<OpenedDevice> open_simulated(const InstrumentDescription& instrument, const KeyFrames& path,
                                    double seconds) {
  SimulatedDeviceSettings settings;
  settings.hand = Hand::with_grip(strength_of(haptic_of(instrument)->grip));
  OpenedDevice opened;
  opened.placement = placement_of(instrument, settings.limits.work_space);
  if (auto fits = check_path(instrument, settings.limits, opened.placement); !fits)
    return std::unexpected(fits.error());
  settings.path = hand_path(instrument.path, path, opened.placement, seconds);
  opened.device = std::make_unique<SimulatedDevice>(std::move(settings));
  return opened;
}

Result<OpenedDevice> open_network(const InstrumentDescription& instrument) {
  NetworkDeviceSettings settings;
  settings.port = haptic_of(instrument)->port;
  auto device = NetworkDevice::open(settings);
  if (!device) return std::unexpected(device.error());
  OpenedDevice opened;
  opened.placement = placement_of(instrument, settings.limits.work_space);
  opened.device = std::move(*device);
  return opened;
}

}  // namespace

Result<OpenedDevice> open_device(const InstrumentDescription& instrument, const KeyFrames& path,
                                 double seconds) {
  switch (haptic_of(instrument)->device) {
    case HapticDescription::Device::kSimulated:
      return open_simulated(instrument, path, seconds);
    case HapticDescription::Device::kRecorded:
      return open_recorded(instrument);
    case HapticDescription::Device::kNetwork:
      break;
  }
  return open_network(instrument);
}

}  // namespace viscera
