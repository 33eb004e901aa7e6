// Smoke volumes on disk: OpenVDB grids written by one worker thread.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/smoke/smoke.h"

namespace viscera {

/// Writes smoke grids as .vdb files (fog volumes "density" [kg/m3] and "temperature" [K excess],
/// vectors "velocity" [m/s], half floats, world transform in metres), each to a temporary name and
/// renamed. OpenVDB is initialised by the first object, so a run without smoke never touches it.
class SmokeWriter {
 public:
  SmokeWriter();
  ~SmokeWriter();  ///< waits for what is queued

  /// Queues a copy of the part that holds smoke; blocks only when more than two volumes wait.
  void write(const std::filesystem::path& file, const SmokeGrid& grid, double time,
             const std::string& volume_name, const std::string& scene_name);
  /// Waits for the queue; the first failure, if any (a full disk names the file).
  Result<void> finish();
  int written() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

/// What a written file holds: for `viscera smoke-info` and tests.
struct SmokeFileInfo {
  std::string volume;
  double time = 0.0;  ///< [s]
  double mass = 0.0;  ///< integral of density [kg]
  Box active_bounds;  ///< [m]
  std::size_t active_voxels = 0;
  double voxel = 0.0;  ///< [m]
  struct Grid {
    std::string name;
    std::string type;  ///< of its values, as OpenVDB calls it: "float", "vec3s"
    std::string unit;
  };
  std::vector<Grid> grids;
};
Result<SmokeFileInfo> read_smoke_info(const std::filesystem::path& file);

/// How often OpenVDB was initialised in this process (0 or 1): proves that a scene without smoke
/// doesn't.
int openvdb_initialisations();

}  // namespace viscera
