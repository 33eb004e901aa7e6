// A whole run: from a scene to a folder with film, frames, volumes, force curves and report.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "engine/gpu/backend.h"
#include "engine/io/report.h"
#include "engine/render/quality.h"
#include "engine/run/observers/pass_writer.h"
#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/result.h"

namespace viscera {

struct RunOptions {
  std::filesystem::path out;  ///< made when absent; frames and volumes of an older run go
  std::filesystem::path assets;
  int threads = 0;  ///< 0: as many as the machine has
  bool render = true;
  Backend backend = Backend::kAuto;  ///< what deforms drawn surfaces
  bool use_cache = true;
  bool vtk = false;    ///< deformed organs for ParaView at every picture's time
  bool quiet = false;  ///< no progress bars
  int width = 1280, height = 720;
  Quality quality = Quality::kReview;  ///< of pictures
  std::set<Pass> passes;               ///< of every picture, written as passes/NNNN.exr
  std::vector<double> snapshots;  ///< not empty: pictures at these times [s] alone, and no film
  std::string command;            ///< repeats the run; goes into the report
  double checkpoint_s = 0.0;      ///< at most so long between two checkpoints [s]; 0: none
  bool resume = false;            ///< go on from the checkpoint in `out`
  std::filesystem::path record_controls;  ///< what moved the tools goes there; empty: nowhere
  std::filesystem::path replay;           ///< and comes from there; empty: from the scene's paths
  /// For tests: the OpenGL context is as if lost from this frame of simulation on; 0: never.
  std::uint64_t lose_context_at = 0;
  /// For tests: a thread throws in this frame; 0: none.
  std::uint64_t throw_at = 0;
};

/// Runs the scene to its end, to Ctrl-C, or to the first output that can't be written: what is
/// asked for is all of them, and what follows would be without. Fails where the run can't begin.
/// From then on there is a report, which says whether it is complete, and if not why; every other
/// output is ended as far as it goes. Whatever happens, files in `out` are whole; what they hold is
/// on the disk before the report says so, and that before the checkpoint goes.
Result<RunReport> run_scene(const SceneDescription& scene,
                            const std::map<std::string, Tissue>& tissues,
                            const RunOptions& options);

/// What this scene doesn't need, and why; the same words in `check` and in report.json.
std::vector<SkippedReport> skipped_parts(const SceneDescription& scene, bool render);

}  // namespace viscera
