// What a device lets kernels do, and whether it still does what it is asked.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "engine/gpu/egl_context.h"
#include "kernels/base/result.h"

namespace viscera {

/// What the device lets one dispatch do; smaller ones are for tests.
struct GpuLimits {
  std::size_t block_bytes = 0;      ///< of a storage buffer that a kernel sees
  std::size_t groups_per_axis = 0;  ///< of a dispatch
  static GpuLimits of_device();
};

/// Fails where a kernel may bind fewer storage buffers than `most`; `who` asks: "smoke on the GPU".
Result<void> check_bindings(const std::string& who, int most);

/// Watches a device for one who computes there. The first thing that goes wrong stays until
/// begin().
class GpuWatch {
 public:
  /// `context` null: the current one.
  GpuWatch(std::string who, std::shared_ptr<EglContext> context)
      : context_(std::move(context)), who_(std::move(who)) {}

  const std::shared_ptr<EglContext>& context() const { return context_; }
  void make_current() const {
    if (context_) context_->make_current();
  }
  /// Makes the context current and forgets all that was wrong.
  void begin();
  /// Notes why; false, so that it can be returned.
  bool fail(const std::string& why);
  /// False where the device has failed since begin().
  bool is_well();
  /// Notes where a storage buffer of so many bytes is larger than the device binds.
  bool fits(std::size_t bytes, const GpuLimits& limits, const char* what);
  /// "smoke on the GPU: out of memory"; empty: none.
  const std::string& trouble() const { return trouble_; }

 private:
  std::shared_ptr<EglContext> context_;
  std::string who_, trouble_;
};

}  // namespace viscera
