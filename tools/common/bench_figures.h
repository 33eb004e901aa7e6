// What benchmarks share: figures beside their targets, medians, a folder that goes.
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

/// A figure beside what it is to reach.
struct BenchRow {
  std::string what, unit;
  std::optional<double> value;  ///< nothing: it couldn't be measured
  double target = 0.0;
  bool at_least = false;  ///< the target is a lower bound
  /// Cases that were to count in it and came to nothing: refused, or without a solution; or why
  /// there is no value.
  std::vector<std::string> dropped = {};

  /// Never where a case was dropped: what is left may be the easier part.
  bool met() const;
};

/// The worst of what several cases come to, with the names of those that came to nothing.
class WorstCase {
 public:
  /// Nothing, or no number: dropped. Errors count by their size.
  void add(const std::optional<double>& value, const std::string& which);
  bool empty() const { return !worst_ && dropped_.empty(); }
  BenchRow row(std::string what, std::string unit, double target, double scale = 1.0) const;

 private:
  std::optional<double> worst_;
  std::vector<std::string> dropped_;
};

/// One line a row: what, figure, target, met or not, and what was dropped from it; then how many of
/// all are met, where that is more than one.
void print_rows(const std::vector<BenchRow>& rows, const std::string& title, std::ostream& out);
nlohmann::json to_json(const std::vector<BenchRow>& rows);

/// The rows under this machine's name; nothing where there are none.
void print_rows_of_this_machine(const std::vector<BenchRow>& rows, std::ostream& out);
/// {"machine", "cores", "cases", "rows"} with a list of cases; an empty path: nothing.
Result<void> write_cases(const std::filesystem::path& file, const nlohmann::json& cases,
                         const std::vector<BenchRow>& rows);

/// Asked before minutes are spent on what can't be written: files (empty: none), a folder for
/// plots.
Result<void> check_outputs(const std::vector<std::filesystem::path>& files,
                           const std::filesystem::path& plots);

/// Median wall time of one call [s]: after a warm-up, calls for about this long, at least seven.
double median_call_s(const std::function<void()>& call, double for_about_s);

/// What this process reads from memory: the best of several passes over a block that no cache
/// holds, all threads together [bytes/s].
double read_bandwidth();

/// A folder for temporary files, which goes with the object.
class ScratchFolder {
 public:
  static Result<std::unique_ptr<ScratchFolder>> create();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  explicit ScratchFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

/// Runs a command to its end without a shell, its output going to `log` (empty: to nowhere).
struct CommandResult {
  int code = -1;  ///< of its exit; -1: it didn't start or was killed
  double wall_s = 0.0;
  std::size_t peak_memory_bytes = 0;
};
CommandResult run_program(const std::vector<std::string>& words,
                          const std::filesystem::path& log = {},
                          const std::filesystem::path& folder = {});

}  // namespace viscera
