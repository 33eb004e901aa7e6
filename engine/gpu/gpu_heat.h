// The passes of heat on the GPU: the twins of kernels/heat/bioheat_passes, with the same numbers.
//
// A warm brick has a slot on the device, where its fields stay from the step in which it got warm
// until it is let go. Up go new bricks, those that somebody wrote to, this step's sources, and the
// table of bricks and neighbours where it has changed; which bricks there are is the CPU's affair
// (Bioheat), which decides by what each step brings back: a brick's sums, its greatest temperature
// and those along its sides, and the vapour of those that gave any. Fields come when fetched, and
// only those that have changed.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/compute.h"
#include "engine/gpu/egl_context.h"
#include "engine/gpu/gpu_limits.h"
#include "engine/gpu/pass_timer.h"
#include "engine/gpu/program.h"
#include "engine/gpu/read_back.h"
#include "kernels/base/result.h"
#include "kernels/heat/heat_device.h"
#include "kernels/heat/heat_passes.h"

namespace viscera {

/// Serves one organ. One thread.
class GpuHeat final : public HeatPasses {
 public:
  /// Fails where the kernels don't compile, or bind more buffers than the device has. Works in
  /// `context`, which start() and fetch() make current; null: in the current one, which then has to
  /// stay current for as long as this lives.
  static Result<std::unique_ptr<GpuHeat>> create(GpuLimits limits = GpuLimits::of_device(),
                                                 std::shared_ptr<EglContext> context = nullptr);
  /// For another organ, with the same kernels.
  std::unique_ptr<GpuHeat> another() const;
  ~GpuHeat() override;

  /// False where a buffer would be larger than the limits or the memory allow.
  bool start(std::span<HeatBrick* const> warm, const HeatModel& model) override;
  HeatFlows prepare() override;
  HeatFlows rates() override;
  void advance(double dt) override;
  void advance_stage(const SuperStage& stage, int j, double dt) override;
  void settle(double dt) override;
  bool finish(bool fields) override;
  bool fetch(std::span<HeatBrick* const> bricks) override;
  const std::string& trouble() const override { return watch_.trouble(); }

  /// Marks "upload", "rates", "advance", "settle" and "read back" as these end; null: none.
  void time_with(PassTimer* timer) { timer_ = timer; }
  std::size_t bytes() const;                                 ///< on the device
  std::size_t uploaded_bricks() const { return uploaded_; }  ///< whose fields went up, so far
  std::size_t fetched_bytes() const { return fetched_; }     ///< of fields that came back, so far

 private:
  struct Kernels {
    Program prepare, rates, advance, stage, settle;
  };
  /// A brick's place in the buffers of fields.
  struct Slot {
    bool used = false, seen = false;
    std::uint32_t stale = 0;  // fields that are newer here than on the CPU
    std::shared_ptr<const BrickGeometry> geometry;
    int place = 0;  // of its geometry
  };
  /// Numbers from 0 on, the lowest that are free first.
  class Numbers {
   public:
    int take();
    void give(int number);
    std::size_t count() const { return count_; }

   private:
    std::vector<int> free_;  // descending
    std::size_t count_ = 0;
  };
  struct Range {
    std::size_t first = 0, count = 0;
  };

  GpuHeat(GpuLimits limits, std::shared_ptr<EglContext> context)
      : watch_("heat on the GPU", std::move(context)),
        limits_(limits),
        queue_(limits.groups_per_axis) {}
  Result<void> load_kernels();
  bool reserve(Buffer& buffer, std::size_t bytes, bool keep, const char* what);
  bool reserve_slots();
  void free_unseen();
  void assign_slots();
  void upload_geometry(const Slot& slot);
  void upload_fields(HeatBrick& brick, bool fresh);
  void upload_table();
  HeatFlows read_flows();
  void read_vapour(double volume, std::span<const std::uint32_t> vapours);
  Range slots_of(std::span<HeatBrick* const> bricks, std::uint32_t stale) const;
  void mark(const char* name);

  GpuWatch watch_;  // first made, last destroyed: it holds the context
  GpuLimits limits_;
  ComputeQueue queue_;
  PassTimer* timer_ = nullptr;
  std::shared_ptr<Kernels> kernels_;

  std::span<HeatBrick* const> warm_;  // from start() to finish()
  Range active_;                      // their slots
  HeatParameters parameters_{};
  bool first_ = true;  // substep of the step
  std::vector<Slot> slots_;
  Numbers slot_numbers_, places_;   // of slots; of geometries, 0 being BrickGeometry::whole()
  std::vector<HeatEntry> entries_;  // as uploaded
  Buffer table_, excess_, water_, charred_, dose_, coagulation_, collagen_, source_, geometry_;
  Buffer before_, rate_, conductivity_, inverse_capacity_, living_, first_rate_, older_;
  Buffer flows_, sums_, lost_, pass_;
  std::unique_ptr<ReadBack> read_back_;  // for fields
  std::size_t uploaded_ = 0, fetched_ = 0;
};

}  // namespace viscera
