// A body at finite strain on the GPU: what a quasi-Newton step asks for most, its energy with the
// forces on its nodes, and what its factor makes of forces. Kernels lie beside the CPU's
// (kernels/finite/finite_energy.comp, dense_inverse.comp). No run computes there yet: it is
// measured
// (`viscera_gpu_bench finite`).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/compute.h"
#include "engine/gpu/gpu_limits.h"
#include "engine/gpu/pass_timer.h"
#include "engine/gpu/program.h"
#include "engine/gpu/read_back.h"
#include "kernels/base/result.h"
#include "kernels/finite/finite_body.h"
#include "kernels/finite/finite_energy.h"

namespace viscera {

class GpuFiniteBody {
 public:
  /// Needs a current context, and nothing of `body` afterwards. Fails where it has fibres, and
  /// where the device can't.
  static Result<std::unique_ptr<GpuFiniteBody>> create(const FiniteBody& body, GpuLimits limits);

  /// For the energies that follow: tissue that has stiffened and shrunk, what resists change.
  void set(const ChangedTissue& changed, const Viscosity& viscosity);

  /// As FiniteBody::energy without its hold: energy [J], and its derivative [N] added to `gradient`
  /// (3 N).
  Result<double> energy(std::span<const double> displacements, std::span<double> gradient);

  std::size_t bytes() const { return bytes_; }
  /// From now on notes how long each pass takes; null: no more. Whoever asks starts and finishes
  /// it.
  void time_with(PassTimer* timer) { timer_ = timer; }

 private:
  explicit GpuFiniteBody(GpuLimits limits) : queue_(limits.groups_per_axis) {}

  void mark(const char* name) {
    if (timer_ != nullptr) timer_->mark(name);
  }

  ComputeQueue queue_;
  PassTimer* timer_ = nullptr;
  Program cells_kernel_, nodes_kernel_;
  FiniteEnergyParameters parameters_;
  std::size_t nodes_ = 0, cells_ = 0, bytes_ = 0;
  Buffer cell_begin_, cell_origin_, pack_begin_, entry_nodes_, gradients_, weights_, psi_;
  Buffer node_begin_, node_entries_;
  Buffer pass_, change_, before_, displacements_, stress_, energies_, forces_;
  std::unique_ptr<ReadBack> read_back_;
};

/// y = A x, A dense and symmetric, in half precision: its greatest entry, which the caller takes
/// out of it, is near 1.
class GpuInverse {
 public:
  /// `columns`: n x n. Needs a current context.
  static Result<std::unique_ptr<GpuInverse>> create(std::span<const float> columns, std::size_t n,
                                                    GpuLimits limits);
  /// n numbers each.
  Result<void> apply(std::span<const double> x, std::span<double> y);
  std::size_t bytes() const { return matrix_.size(); }

 private:
  explicit GpuInverse(GpuLimits limits) : queue_(limits.groups_per_axis) {}

  ComputeQueue queue_;
  Program kernel_;
  std::size_t size_ = 0, padded_ = 0;
  Buffer matrix_, vector_, product_;
  std::unique_ptr<ReadBack> read_back_;
};

}  // namespace viscera
