// `viscera stress --whole`: random scenes, stepped under every check that the program has.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <set>
#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

struct WholeOutcome {
  int number = 0;
  std::string description;
  std::string refused;                ///< the reason; empty: the scene was stepped
  std::vector<std::string> flags;     ///< names of those that its frames raised
  std::vector<std::string> failures;  ///< of checks, each with what was found
  double smoke_residual = 0.0;        ///< of its book, over what was emitted
  double heat_residual = 0.0;         ///< of the energy book, over what was delivered
  double deepest_inside = 0.0;        ///< of an organ in another, beyond that at rest [m]
  std::uint64_t bodies = 0;           ///< that organs became as they were cut
  /// Of a cut body's points against its surface, and of that and what is gone against the whole
  /// one; over the latter's.
  double mass_residual = 0.0;
  std::set<std::string> cuts_refused;  ///< why cut bodies couldn't be prepared
  bool passed() const { return failures.empty(); }
};

/// Prepares and steps the case's scene in that folder, without any cache:
///   twice, by one thread and by two, to the same hash;
///   from a snapshot at a random frame in a simulation of its own, to the same hash;
/// turning tissue at finite strain inside out where the case says so, and
/// asking in the first run how deep organs of a pair lie in each other and, once nothing moves the
/// scene any more, whether it gains energy (whole_bodies.h), and whether cut bodies have the mass
/// of what their surfaces enclose, looking after each step for numbers that aren't finite
/// (sentinel.h) and flags that nothing in the scene explains, trying controls that can't be, and at
/// the end at the books of smoke and heat.
struct WholeCase {
  std::uint64_t seed = 1;
  int number = 0;
  bool fault = false;  ///< a number that isn't finite is put into the second run's state
  bool cuts = false;   ///< of write_cut_scene
};
WholeOutcome run_whole_case(const WholeCase& whole, const std::filesystem::path& folder);

struct WholeOptions {
  std::uint64_t seed = 1;
  int first = 0;
  int cases = 0;         ///< 0: as many as the time allows
  double minutes = 0.0;  ///< 0: as many as there are cases
  bool fault = false;    ///< a test of the checks themselves: every case that is stepped must fail
  bool cuts = false;     ///< scenes in which blades cut
  std::filesystem::path keep;  ///< where the last case's scene stays; empty: nowhere
  bool quiet = false;
};

/// The command that runs one case again.
std::string replay_whole(const WholeOptions& options, int number);

/// One case after the other; failures are printed as they are found, each with its command, then a
/// summary. True: all passed, no more than a quarter was refused, and memory didn't grow.
Result<bool> run_whole_stress(const WholeOptions& options, std::ostream& out);

}  // namespace viscera
