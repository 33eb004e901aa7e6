// A run's ground truth: what each picture is made of, as one OpenEXR file of many channels.
#pragma once

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/io/exr_file.h"
#include "engine/io/file_worker.h"
#include "engine/render/pass_images.h"
#include "engine/render/view.h"
#include "kernels/base/result.h"

namespace viscera {

enum class Pass {
  kBeauty,
  kClean,
  kScattered,
  kTransmittance,
  kLightTransmittance,
  kDepth,
  kLabels,
  kTemperature
};

/// Passes by their names ("light_transmittance"); one that isn't known is refused with the list.
Result<std::set<Pass>> passes_of(const std::vector<std::string>& names);

/// What a picture's file says of it besides pixels.
struct PassContext {
  std::string scene;
  std::string labels;       ///< JSON: which body each label is
  std::string camera;       ///< JSON: the pinhole
  double time = 0.0;        ///< [s]
  bool with_smoke = false;  ///< the scene has smoke: beauty brings `scattered` with it
};
PassContext pass_context(const FrameView& view, std::string scene, double time, bool with_smoke);

/// Channels and header of a picture. Colours and transmittances are halves, depth and temperatures
/// floats, labels integers; the header's `comments` tells what each channel is, `labels` (JSON)
/// what each label.
ExrPicture exr_of(const std::set<Pass>& passes, const PassImages& images,
                  const PassContext& context);

/// Writes pictures' ground truth as .exr files on a thread of its own, each whole or absent: the
/// next frames are simulated meanwhile. The destructor waits for what is queued.
class PassWriter {
 public:
  explicit PassWriter(std::set<Pass> passes) : passes_(std::move(passes)), worker_(kMostWaiting) {}

  /// Queues; blocks only when another picture waits already.
  void write(const std::filesystem::path& file, std::shared_ptr<const PassImages> images,
             PassContext context);
  /// The first failure so far, without waiting.
  Result<void> status() const { return worker_.status(); }
  /// Waits for the queue; the first failure, if any (a full disk names the file).
  Result<void> finish() { return worker_.finish(); }
  double seconds() const { return worker_.seconds(); }  ///< spent on files by the worker

 private:
  /// All passes of a picture of 1280 x 720 are 55 MB.
  static constexpr std::size_t kMostWaiting = 1;
  std::set<Pass> passes_;
  FileWorker worker_;  // first destroyed: its jobs read passes_
};

}  // namespace viscera
