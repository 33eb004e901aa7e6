// What the targets of recordings share.
#pragma once

#include "haptics/devices/recording.h"
#include "kernels/base/result.h"

namespace viscera::fuzz {

HapticRecording small_recording(std::size_t samples);

bool is_recording(const Result<HapticRecording>& recording);

}  // namespace viscera::fuzz
