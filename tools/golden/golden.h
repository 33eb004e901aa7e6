// Golden figures: what the shipped scenes come to, few figures a scene with a tolerance each, kept
// in tests/scenes/golden.json. `viscera_golden` runs the scenes and says what has changed; with
// --write it writes the file anew. A test compares.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct GoldenFigure {
  double value = 0.0;
  double tolerance = 0.0;  ///< share of the value
};

struct GoldenScene {
  std::string name;         ///< scenes/NAME.json
  double duration_s = 0.0;  ///< of the run; shorter than the scene's where that is long
  std::map<std::string, GoldenFigure> figures;  ///< "hook: greatest force, N"
};

/// Fails with the place where the file isn't what golden_text() writes.
Result<std::vector<GoldenScene>> read_golden(const std::filesystem::path& file);
std::string golden_text(const std::vector<GoldenScene>& scenes);

/// Figures of a run's folder, from report.json, forces.csv and lesion.csv: of each tool the
/// greatest and the mean force and the work its tip put in, of each organ how far it was pushed,
/// how hot and how much of it coagulated, of the whole energy and smoke. Those that are zero are
/// left out. Fails where the run ended early, or where files of it lack what every run writes.
Result<std::map<std::string, double>> figures_of_run(const std::filesystem::path& folder);

/// Runs the scene of the project below `root` without pictures into `out`; figures_of_run() then.
Result<std::map<std::string, double>> golden_run(const GoldenScene& scene,
                                                 const std::filesystem::path& root,
                                                 const std::filesystem::path& out);

struct GoldenChange {
  std::string line;     ///< "hook: greatest force, N   0.512 -> 0.534  +4.3 %  (1 % allowed)"
  bool beyond = false;  ///< its tolerance, new or gone
};

/// Every figure that isn't bit for bit what it was, in the order of their names.
std::vector<GoldenChange> golden_changes(const GoldenScene& old,
                                         const std::map<std::string, double>& found);

/// The scene with these figures; tolerances stay, and new ones get that of their unit.
GoldenScene with_figures(const GoldenScene& old, const std::map<std::string, double>& found);

}  // namespace viscera
