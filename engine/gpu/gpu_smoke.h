// The passes of smoke on the GPU: the twins of kernels/smoke's bin, viscosity, integrate, collide
// and splat, in the same order, with the same parameters.
//
// From start() to finish() the particles stay on the device. What SmokeVolume decides by (the box
// of the particles, their greatest speed, which cells hold some, how many are trapped) comes back
// as a few words. The gas lives on the CPU: where there is one, positions come back in each
// substep, and its velocities go up. At the end of a step all
// particles come back, because the mass book, outlets and emission are the CPU's.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
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
#include "kernels/base/result.h"
#include "kernels/smoke/step_passes.h"

namespace viscera {

/// Serves any number of volumes, one after another; buffers are as large as the greatest needs. One
/// thread.
class GpuSmoke final : public SmokePasses {
 public:
  /// Fails where the kernels don't compile, or bind more buffers than the device has. Works in
  /// `context`, which start() and splat() make current; null: in the current one, which then has to
  /// stay current for as long as this lives.
  static Result<std::unique_ptr<GpuSmoke>> create(GpuLimits limits = GpuLimits::of_device(),
                                                  std::shared_ptr<EglContext> context = nullptr);
  ~GpuSmoke() override;

  /// False where a buffer would be larger than the limits or the memory allow.
  bool start(SmokeParticles& particles) override;
  void exchange(float cell, ViscosityParameters parameters) override;
  void integrate(IntegrateParameters parameters, std::span<const SwirlWave> waves,
                 SurroundingGas* gas) override;
  /// The deposited mass of the counts is left to finish().
  CollideCounts collide(SurfaceCells& cells, const SurfaceMeeting& meeting,
                        std::span<const SmokeCapsule> capsules,
                        CollideParameters parameters) override;
  float greatest_speed() override;
  std::uint64_t isolated() const override;
  std::optional<double> finish(SmokeParticles& particles, std::vector<SmokeFate>& fates) override;
  bool splat(const SmokeParticles& particles, SplatParameters& parameters,
             SmokeGrid& grid) override;
  const std::string& trouble() const override { return watch_.trouble(); }
  std::size_t memory_bytes() const override { return around_.capacity() * sizeof(Float4); }

  /// Splats the particles that are on the device. The sums stay there; read_splat() fetches them.
  bool splat_here(SplatParameters& parameters);
  void read_splat(const SplatParameters& parameters, SmokeGrid& grid);

  /// Marks "box", "bin", "viscosity", "integrate", "collide" and "splat" as these end; null: none.
  void time_with(PassTimer* timer) { timer_ = timer; }
  /// Copies of what is on the device, for tests.
  SmokeParticles read_particles();
  std::vector<Float4> read_accelerations();
  std::vector<std::uint32_t> read_cell_begin();
  const BinParameters& grid() const { return grid_; }
  std::size_t bytes() const;  ///< on the device

 private:
  struct Particles {
    Buffer positions, velocities, masses, ids;
  };
  GpuSmoke(GpuLimits limits, std::shared_ptr<EglContext> context)
      : watch_("smoke on the GPU", std::move(context)),
        limits_(limits),
        queue_(limits.groups_per_axis) {}
  Result<void> load_kernels();
  bool reserve(Buffer& buffer, std::size_t bytes, const char* what);
  bool upload(const SmokeParticles& particles);
  bool upload_surfaces(const SurfaceCells& cells, std::span<const SmokeCapsule> capsules);
  void clear(const Buffer& buffer, std::size_t words);
  void survey();
  void sort(float cell);
  std::vector<std::uint32_t> cells_of_pace(const BinParameters& grid, float fastest);
  std::size_t particle_groups() const;
  void add_and_blur(const SplatParameters& parameters);
  void mark(const char* name);
  void skip();

  GpuWatch watch_;  // first made, last destroyed: it holds the context
  GpuLimits limits_;
  ComputeQueue queue_;
  PassTimer* timer_ = nullptr;
  Program clear_, box_, amounts_, count_, mark_, scatter_, gather_, scan_blocks_, scan_totals_,
      scan_add_, density_, pairs_, paper_, integrate_, collide_, splat_add_, splat_fold_,
      splat_blur_, splat_resolve_;

  std::size_t particles_ = 0;
  double mass_before_ = 0.0;  // at start() [kg]
  Particles now_, sorted_;
  Buffer accelerations_, strengths_, fates_, counters_, extent_;
  Buffer places_, slots_, counts_, cell_begin_, totals_, occupied_;
  Buffer waves_, gas_;
  Buffer surface_begin_, surface_entries_, triangles_, capsules_near_, capsules_;
  Buffer sums_, amounts_cells_, blurred_cells_, splat_weights_;
  Buffer density_cells_, temperature_cells_, velocity_cells_;
  Buffer bin_pass_, viscosity_pass_, integrate_pass_, collide_pass_, splat_pass_;
  BinParameters grid_;
  /// Box and speed of the particles as they are; nothing: they have changed since.
  struct Survey {
    Eigen::AlignedBox3f box;
    float speed = 0.0f;
  };
  std::optional<Survey> survey_;
  std::vector<Float4> around_;                     // velocity of the gas; w: of its eddies
  mutable std::optional<std::uint64_t> isolated_;  // as read
};

}  // namespace viscera
