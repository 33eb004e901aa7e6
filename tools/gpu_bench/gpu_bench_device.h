// What all parts of `viscera_gpu_bench` start and end with.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "engine/gpu/egl_context.h"
#include "engine/gpu/memory_bandwidth.h"
#include "kernels/base/result.h"

namespace viscera {

struct BenchDevice {
  std::unique_ptr<EglContext> context;  ///< current
  MemoryBandwidth memory;
};

/// Opens this machine's GL device and measures its memory on so many megabytes; prints both.
Result<BenchDevice> open_bench_device(int window_mb, int repeats);

/// Whole or not at all.
Result<void> write_bench_json(const std::string& path, const nlohmann::ordered_json& report);

}  // namespace viscera
