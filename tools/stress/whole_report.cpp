// Running many whole scenes one after the other, and what is told of them.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/progress_bar.h"
#include "kernels/base/stopwatch.h"
#include "tools/common/bench_figures.h"
#include "tools/stress/refusals.h"
#include "tools/stress/whole_run.h"

namespace viscera {
namespace {

/// Scenes that the draw spoils (a tool that starts in tissue, a link that ties nothing) are
/// refused.
constexpr double kMostRefused = 0.25;
/// Memory is looked at from so many cases on; it may grow by this and a share of itself [bytes].
/// All chosen by eye.
constexpr std::size_t kFewestForMemory = 20;
constexpr double kMostGrowth = 48e6, kMostGrowthShare = 0.1;

/// Resident now [bytes].
double resident() {
  std::ifstream file("/proc/self/statm");
  double all = 0.0, here = 0.0;
  file >> all >> here;
  return here * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

/// Open now.
std::size_t descriptors() {
  std::error_code ignored;
  const std::filesystem::directory_iterator open("/proc/self/fd", ignored);
  return static_cast<std::size_t>(std::distance(begin(open), end(open)));
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// From the second fifth of the cases to the last, by their medians [bytes].
double growth(const std::vector<double>& memory) {
  const auto fifth = static_cast<std::ptrdiff_t>(memory.size() / 5);
  const std::vector<double> before(memory.begin() + fifth, memory.begin() + 2 * fifth);
  const std::vector<double> after(memory.end() - fifth, memory.end());
  return median(after) - median(before);
}

/// Without the file that every message begins with.
std::string without_file(const std::string& reason) {
  const std::size_t colon = reason.find(": ");
  return colon == std::string::npos ? reason : reason.substr(colon + 2);
}

/// What was seen of all cases.
class WholeSummary {
 public:
  void add(const WholeOutcome& outcome) {
    ++cases_;
    refused_ += !outcome.refused.empty();
    failed_ += !outcome.passed();
    if (!outcome.refused.empty()) ++reasons_[refusal_sort(without_file(outcome.refused))];
    for (const std::string& flag : outcome.flags) ++flags_[flag];
    smoke_residual_ = std::max(smoke_residual_, outcome.smoke_residual);
    heat_residual_ = std::max(heat_residual_, outcome.heat_residual);
    deepest_ = std::max(deepest_, outcome.deepest_inside);
    bodies_ += outcome.bodies;
    mass_residual_ = std::max(mass_residual_, outcome.mass_residual);
    for (const std::string& reason : outcome.cuts_refused) ++cuts_refused_[refusal_sort(reason)];
    memory_.push_back(resident());
    descriptors_.push_back(descriptors());
  }

  bool sound(std::ostream& out) const {
    bool sound = failed_ == 0;
    if (refused_ > 3 + static_cast<int>(kMostRefused * cases_)) {
      out << fmt::format("{} of {} scenes were refused, expected at most a quarter\n", refused_,
                         cases_);
      sound = false;
    }
    if (memory_.size() >= kFewestForMemory) {
      const double grown = growth(memory_);
      const double most = kMostGrowth + kMostGrowthShare * memory_.back();
      if (grown > most) {
        out << fmt::format("memory grew by {:.0f} MB, expected at most {:.0f} MB\n", 1e-6 * grown,
                           1e-6 * most);
        sound = false;
      }
      // The first cases open what stays: a context, a log.
      const std::size_t early = descriptors_[kFewestForMemory / 2];
      if (descriptors_.back() > early) {
        out << fmt::format("{} descriptors are open, expected {} as after the first cases\n",
                           descriptors_.back(), early);
        sound = false;
      }
    }
    return sound;
  }

  void print(std::ostream& out, double seconds) const {
    out << fmt::format("{} scenes in {:.0f} s: {} passed, {} refused, {} failed\n", cases_, seconds,
                       cases_ - refused_ - failed_, refused_, failed_);
    out << fmt::format(
        "books: smoke to {:.1e} of what was emitted, heat to {:.1e} of what was "
        "delivered\n",
        smoke_residual_, heat_residual_);
    out << fmt::format("organs lay {:.2f} mm in others at most, beyond that at rest\n",
                       1e3 * deepest_);
    if (bodies_ > 0)
      out << fmt::format(
          "organs became {} cut bodies; points, surfaces and what is gone agree to {:.1e} of their "
          "mass\n",
          bodies_, mass_residual_);
    for (const auto& [reason, count] : cuts_refused_)
      out << fmt::format("{:>6} scenes with cuts that were refused: {}\n", count, reason);
    if (memory_.size() >= kFewestForMemory)
      out << fmt::format("memory: {:.0f} MB at the end, {:+.1f} MB since the second fifth\n",
                         1e-6 * memory_.back(), 1e-6 * growth(memory_));
    if (!descriptors_.empty())
      out << fmt::format("descriptors: {} at the end, {} after the first scene\n",
                         descriptors_.back(), descriptors_.front());
    for (const auto& [flag, count] : flags_)
      out << fmt::format("{:>6} scenes raised {}\n", count, flag);
    for (const auto& [reason, count] : reasons_)
      out << fmt::format("{:>6} refused: {}\n", count, reason);
  }

 private:
  int cases_ = 0, refused_ = 0, failed_ = 0;
  double smoke_residual_ = 0.0, heat_residual_ = 0.0, deepest_ = 0.0;
  std::uint64_t bodies_ = 0;
  double mass_residual_ = 0.0;
  std::map<std::string, int> flags_, reasons_, cuts_refused_;
  std::vector<double> memory_;
  std::vector<std::size_t> descriptors_;
};

void tell_failure(const WholeOptions& options, const WholeOutcome& outcome, std::ostream& out) {
  out << fmt::format("case {} failed: {}\n", outcome.number, outcome.description);
  for (const std::string& failure : outcome.failures) out << "  " << failure << '\n';
  out << "  again: " << replay_whole(options, outcome.number) << '\n' << std::flush;
}

}  // namespace

std::string replay_whole(const WholeOptions& options, int number) {
  return fmt::format("viscera stress --whole{} --seed {} --case {}{}",
                     options.cuts ? " --cuts" : "", options.seed, number,
                     options.fault ? " --inject-fault" : "");
}

Result<bool> run_whole_stress(const WholeOptions& options, std::ostream& out) {
  const Stopwatch watch;
  const auto folder = ScratchFolder::create();
  if (!folder) return std::unexpected(folder.error());
  const std::filesystem::path where = options.keep.empty() ? (*folder)->path() : options.keep;
  if (auto usable = check_out_folder(where); !usable) return std::unexpected(usable.error());
  WholeSummary summary;
  std::optional<ProgressBar> bar;
  if (!options.quiet && options.cases != 1) bar.emplace("stress");
  const double most_seconds = 60.0 * options.minutes;
  for (int done = 0; !interrupted(); ++done) {
    if (options.cases > 0 && done == options.cases) break;
    if (options.minutes > 0.0 && watch.seconds() >= most_seconds) break;
    const double by_cases = options.cases > 0 ? static_cast<double>(done) / options.cases : 0.0;
    const double by_time = options.minutes > 0.0 ? watch.seconds() / most_seconds : 0.0;
    if (bar) bar->update(std::max(by_cases, by_time), "running whole scenes");
    const WholeOutcome outcome =
        run_whole_case({options.seed, options.first + done, options.fault, options.cuts}, where);
    summary.add(outcome);
    if (options.cases == 1) {
      out << fmt::format("case {}: {}\n", outcome.number, outcome.description);
      if (!outcome.refused.empty()) out << "  refused: " << outcome.refused << '\n';
    }
    if (!outcome.passed()) tell_failure(options, outcome, out);
  }
  bar.reset();
  summary.print(out, watch.seconds());
  if (interrupted()) return failure("stopped; what was done is told above");
  return summary.sound(out);
}

}  // namespace viscera
