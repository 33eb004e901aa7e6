#include "engine/run/move_to_gpu.h"

#include <fmt/format.h>

#include <functional>
#include <memory>

#include "engine/features/cautery/cautery.h"
#include "engine/features/deformation/deformation.h"
#include "engine/features/deformation/gpu_surfaces.h"
#include "engine/features/smoke/smoke.h"
#include "engine/gpu/gpu_smoke.h"
#include "kernels/base/stopwatch.h"

namespace viscera {
namespace {

/// Organs go to the GPU where the run computes there. Where that fails, only a run that asked for
/// it does too.
Result<void> move_organs_to_gpu(World& world, const ComputeDevice& device, Backend asked,
                                RunReport& report) {
  if (device.decision.backend != Backend::kGpu) return {};
  const Stopwatch watch;
  auto surfaces = GpuSurfaces::create(device.context, world);
  if (!surfaces) {
    if (asked == Backend::kGpu) return std::unexpected(surfaces.error());
    report.backend = name_of(Backend::kCpu);
    report.backend_reason = "auto: " + device.context->device() + " refused the organs";
    report.warnings.push_back(surfaces.error().text());
    return {};
  }
  const std::shared_ptr<GpuSurfaces> made = *std::move(surfaces);
  if (!made) {
    report.skipped.push_back({"deformation on the GPU", "no organ can be touched"});
    return {};
  }
  world.all<GpuOrgans>().add(kWhole, {made});
  const std::vector<std::string>& refusals = made->refusals();
  report.warnings.insert(report.warnings.end(), refusals.begin(), refusals.end());
  report.gpu = GpuReport{.device = device.context->device(),
                         .start_s = device.start_s + watch.seconds(),
                         .organs = made->organs(),
                         .bytes = made->bytes(),
                         .passes = {}};
  return {};
}

/// And a part of what happens in it, likewise: `move` takes it there and says of how many things,
/// which is `count` of the report.
Result<void> move_part_to_gpu(const char* part, const ComputeDevice& device, Backend asked,
                              RunReport& report, std::size_t GpuReport::*count,
                              const std::function<Result<std::size_t>()>& move) {
  if (report.backend != name_of(Backend::kGpu)) return {};
  const Stopwatch watch;
  device.context->make_current();
  const Result<std::size_t> moved = move();
  if (!moved) {
    if (asked == Backend::kGpu) return std::unexpected(moved.error());
    report.warnings.push_back(fmt::format("{}: {} stays on the CPU", moved.error().text(), part));
    return {};
  }
  if (*moved == 0) return {};
  if (!report.gpu)
    report.gpu =
        GpuReport{.device = device.context->device(), .start_s = device.start_s, .passes = {}};
  report.gpu->start_s += watch.seconds();
  (*report.gpu).*count = *moved;
  return {};
}

Result<std::size_t> move_smoke(World& world, const std::shared_ptr<EglContext>& context) {
  if (!world.has<SmokeBody>()) return 0;
  auto made = GpuSmoke::create(GpuLimits::of_device(), context);
  if (!made) return std::unexpected(made.error());
  const std::shared_ptr<SmokePasses> passes = *std::move(made);
  for (SmokeBody& smoke : world.all<SmokeBody>()) smoke.volume.compute_on(passes);
  return world.all<SmokeBody>().size();
}

}  // namespace

Result<void> move_world_to_gpu(World& world, const ComputeDevice& device, Backend asked,
                               RunReport& report) {
  if (auto moved = move_organs_to_gpu(world, device, asked, report); !moved) return moved;
  if (auto moved = move_part_to_gpu("smoke", device, asked, report, &GpuReport::smoke_volumes,
                                    [&] { return move_smoke(world, device.context); });
      !moved)
    return moved;
  return move_part_to_gpu("heat", device, asked, report, &GpuReport::heat_organs,
                          [&] { return move_heat_to_gpu(world, device.context); });
}

}  // namespace viscera
