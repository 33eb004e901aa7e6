#include "engine/gpu/memory_bandwidth.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/gpu/compute.h"
#include "engine/gpu/device_kernels.h"
#include "engine/gpu/gpu_deformation.h"
#include "engine/gpu/kernels.h"
#include "engine/gpu/pass_timer.h"

namespace viscera {

namespace {

constexpr std::size_t kVector = 4 * sizeof(float);
constexpr int kWarmUps = 2;

}  // namespace

Result<MemoryBandwidth> measure_memory_bandwidth(std::size_t bytes, std::size_t window,
                                                 int repeats) {
  const GpuLimits limits = GpuLimits::of_device();
  window = std::min(window, limits.block_bytes) / kVector * kVector;
  const std::size_t vectors = std::min(bytes, window) / kVector;
  if (vectors == 0 || repeats < 1) return failure("bandwidth: nothing to read");
  Result<Program> read = load_kernel("read_bandwidth.comp", "READ");
  if (!read) return std::unexpected(read.error());
  Result<Program> copy = load_kernel("read_bandwidth.comp", "COPY");
  if (!copy) return std::unexpected(copy.error());

  while (glGetError() != GL_NO_ERROR) {
  }
  Buffer source, target;
  source.allocate(window);
  const std::size_t most_groups = (vectors + kBandwidthGroup - 1) / kBandwidthGroup;
  target.allocate(std::max(vectors, most_groups * kBandwidthGroup) * kVector);
  // Written once: memory that nobody has touched may not exist yet.
  const float value = 1.0f;
  glClearNamedBufferData(source.id(), GL_R32F, GL_RED, GL_FLOAT, &value);
  glClearNamedBufferData(target.id(), GL_R32F, GL_RED, GL_FLOAT, &value);
  if (glGetError() != GL_NO_ERROR) {
    return failure("bandwidth: " + std::to_string(window) + " bytes were refused");
  }

  ComputeQueue queue(limits.groups_per_axis);
  PassTimer timer;
  std::size_t at = 0;
  const auto median_seconds = [&](Program& program, std::size_t groups) {
    std::vector<double> seconds;
    program.set("count", static_cast<int>(vectors));
    for (int i = -kWarmUps; i < repeats; ++i) {
      if ((at + vectors) * kVector > window) at = 0;
      program.set("first", static_cast<int>(at));
      at += vectors;
      timer.start();
      queue.dispatch(program, groups, {{0, &source}}, {{1, &target}});
      timer.mark("read");
      const double took = timer.finish()[0].seconds;
      if (i >= 0) seconds.push_back(took);
    }
    std::nth_element(seconds.begin(), seconds.begin() + repeats / 2, seconds.end());
    return std::max(seconds[static_cast<std::size_t>(repeats / 2)], 1e-9);
  };
  MemoryBandwidth found;
  found.bytes = vectors * kVector;
  found.window = window;
  for (const std::size_t vectors_a_thread : {1, 4, 16, 64}) {
    const std::size_t groups = std::max<std::size_t>(most_groups / vectors_a_thread, 1);
    const auto size = static_cast<double>(vectors * kVector);
    found.read = std::max(found.read, size / median_seconds(*read, groups));
    found.copy = std::max(found.copy, 2.0 * size / median_seconds(*copy, groups));
  }
  return found;
}

}  // namespace viscera
