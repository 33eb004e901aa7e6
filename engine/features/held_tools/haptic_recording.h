// Recordings of haptic devices as files, CSV or HDF5 by their extension.
#pragma once

#include <filesystem>

#include "engine/io/cache_file.h"
#include "haptics/devices/recording.h"
#include "kernels/base/result.h"

namespace viscera {

/// Writes `.csv` or `.h5`; another extension is refused. CSV, which other programs may write too:
///
///   # viscera haptic recording 1
///   # device simulated
///   # dt_s 0.001
///   # work_space_m -0.127 -0.089 -0.0635 0.127 0.089 0.0635
///   # peak_force_N 8.5                  (and the other limits, in the order of DeviceLimits)
///   time_s,x_m,y_m,z_m,qw,qx,qy,qz,buttons,sample,connected,fx_N,fy_N,fz_N
///   0,0,0,0.02,1,0,0,0,0,1,1,0,0,0
///   # end 1
///
/// with the shortest digits that read back to the same numbers. HDF5 is the sealed container of the
/// caches (cache_file.h), which knows when a byte is missing.
Result<void> save_recording(const std::filesystem::path& file, const HapticRecording& recording);

/// Refuses, with file and line or row: what isn't such a file, is truncated, holds a number that is
/// missing or not finite, an orientation that is none, or time that doesn't rise.
Result<HapticRecording> load_recording(const std::filesystem::path& file);

/// What the sealed container of such a file holds.
Result<HapticRecording> recording_of(CacheData data);

}  // namespace viscera
