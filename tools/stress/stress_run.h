// `viscera stress`: random bodies under random tools; each must answer soundly or be refused with a
// reason.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "kernels/base/progress.h"
#include "kernels/base/result.h"
#include "tools/stress/stress_checks.h"

namespace viscera {

/// A sign that is flipped on purpose, to see that the checks see it: that of a diagonal entry of
/// the compliance's touchable square, or of one force of a contact.
enum class StressFault { kNone, kCompliance, kForce };

struct StressOutcome {
  int number = 0;
  StressKind kind = StressKind::kPlaced;
  std::string formulation, description, tools;
  std::string refused;                ///< the reason; empty: it was not
  bool to_be_refused = false;         ///< StressBody::to_be_refused
  std::vector<StressFigure> figures;  ///< greatest of each check, in the order of the checks
  bool passed() const;
};

/// Runs one case. Unsymmetric compliances (strong forms) are refused where they aren't positive, as
/// in a scene, but for a formulation that warns of it. Of their contacts, whose forces have no
/// energy, only finite figures are expected, or that the contact says it found none. Depends on
/// (seed, number, fault) alone; deterministic on one machine. An error: `progress` said stop.
Result<StressOutcome> run_stress_case(std::uint64_t seed, int number, StressFault fault,
                                      const Progress& progress);

struct StressOptions {
  std::uint64_t seed = 1;
  int cases = 2000;
  std::optional<int> only;  ///< this case alone, with all its figures
  StressFault fault = StressFault::kNone;
  int threads = 0;             ///< 0: all cores
  std::filesystem::path json;  ///< empty: none is written
  bool quiet = false;
};

/// The command that runs one case again.
std::string replay_command(const StressOptions& options, int number);

/// Runs the cases on some threads (each case on one), prints failures as they are found in the
/// order of their numbers, then a summary; writes the JSON file. True: all passed or were refused
/// clearly, no more of a kind than its ceiling (refusals.h).
Result<bool> run_stress(const StressOptions& options, std::ostream& out);

}  // namespace viscera
