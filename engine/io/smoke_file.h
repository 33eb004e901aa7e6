// Smoke volumes on disk: OpenVDB grids written by one worker thread.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/io/file_worker.h"
#include "kernels/base/result.h"
#include "kernels/smoke/smoke.h"

namespace viscera {

/// Writes smoke grids as .vdb files (fog volumes "density" [kg/m3] and "temperature" [K excess],
/// vectors "velocity" [m/s], half floats, world transform in metres), each to a temporary name and
/// renamed. The destructor waits for what is queued. OpenVDB is initialised by the first object, so
/// a run without smoke never touches it.
class SmokeWriter {
 public:
  SmokeWriter();

  /// Queues a copy of the part that holds smoke; blocks only when more than two volumes wait.
  void write(const std::filesystem::path& file, const SmokeGrid& grid, double time,
             const std::string& volume_name, const std::string& scene_name);
  /// The first failure so far, without waiting.
  Result<void> status() const { return worker_.status(); }
  /// Waits for the queue; the first failure, if any (a full disk names the file).
  Result<void> finish() { return worker_.finish(); }
  int written() const { return worker_.done(); }
  double seconds() const { return worker_.seconds(); }  ///< spent on files by the worker

 private:
  FileWorker worker_;
};

/// How often OpenVDB was initialised in this process (0 or 1): proves that a scene without smoke
/// doesn't.
int openvdb_initialisations();

}  // namespace viscera
