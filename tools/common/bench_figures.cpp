#include "tools/common/bench_figures.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/io/atomic_file.h"
#include "engine/io/report.h"
#include "kernels/base/parallel.h"
#include "kernels/base/stopwatch.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

VISCERA_WIDE std::uint64_t sum_of(const std::uint64_t* __restrict words, std::size_t count) {
  std::uint64_t sum[8] = {};
  for (std::size_t i = 0; i + 8 <= count; i += 8)
    for (std::size_t k = 0; k < 8; ++k) sum[k] += words[i + k];
  return sum[0] + sum[1] + sum[2] + sum[3] + sum[4] + sum[5] + sum[6] + sum[7];
}

}  // namespace

bool BenchRow::met() const {
  return value && dropped.empty() && (at_least ? *value >= target : *value <= target);
}

void WorstCase::add(const std::optional<double>& value, const std::string& which) {
  if (!value || !std::isfinite(*value))
    dropped_.push_back(which);
  else
    worst_ = std::max(worst_.value_or(0.0), std::abs(*value));
}

BenchRow WorstCase::row(std::string what, std::string unit, double target, double scale) const {
  BenchRow row{std::move(what), std::move(unit), worst_, target, false, dropped_};
  if (row.value) *row.value *= scale;
  return row;
}

void print_rows(const std::vector<BenchRow>& rows, const std::string& title, std::ostream& out) {
  std::size_t width = std::max<std::size_t>(50, title.size() + 1);
  for (const BenchRow& row : rows) width = std::max(width, row.what.size() + 2);
  out << fmt::format("{:<{}}{:>12}{:>12}\n", title, width, "measured", "to reach");
  std::size_t met = 0, measured = 0;
  for (const BenchRow& row : rows) {
    met += row.met();
    measured += row.value && row.dropped.empty();
    const std::string target = fmt::format("{}{:g}", row.at_least ? ">" : "<", row.target);
    out << fmt::format("{:<{}}{:>9} {:<4}{:>7} {:<4}{}\n", row.what, width,
                       row.value ? fmt::format("{:.3g}", *row.value) : "-", row.unit, target,
                       row.unit,
                       row.met()             ? "met"
                       : !row.value          ? "NOT MEASURED"
                       : row.dropped.empty() ? "NOT MET"
                                             : "NOT MET: cases were dropped");
    for (const std::string& one : row.dropped) out << "  dropped: " << one << '\n';
  }
  if (rows.size() < 2) return;
  out << (met == rows.size()
              ? fmt::format("all {} met\n", met)
              : fmt::format("{} of {} met, {} wholly measured\n", met, rows.size(), measured));
}

nlohmann::json to_json(const std::vector<BenchRow>& rows) {
  nlohmann::json json = nlohmann::json::array();
  for (const BenchRow& row : rows) {
    json.push_back({{"what", row.what},
                    {"unit", row.unit},
                    {"value", row.value ? nlohmann::json(*row.value) : nlohmann::json(nullptr)},
                    {"target", row.target},
                    {"met", row.met()},
                    {"dropped", row.dropped}});
  }
  return json;
}

void print_rows_of_this_machine(const std::vector<BenchRow>& rows, std::ostream& out) {
  if (rows.empty()) return;
  const MachineReport machine = this_machine();
  out << '\n';
  print_rows(rows, fmt::format("{} cores of {}", machine.cores, machine.cpu), out);
}

Result<void> write_cases(const std::filesystem::path& file, const nlohmann::json& cases,
                         const std::vector<BenchRow>& rows) {
  if (file.empty()) return {};
  const MachineReport machine = this_machine();
  const nlohmann::json json = {{"machine", machine.cpu},
                               {"cores", machine.cores},
                               {"cases", cases},
                               {"rows", to_json(rows)}};
  return write_file(file, json.dump(2) + "\n");
}

Result<void> check_outputs(const std::vector<fs::path>& files, const fs::path& plots) {
  if (!plots.empty())
    if (auto made = check_out_folder(plots); !made) return made;
  for (const fs::path& file : files) {
    if (file.empty()) continue;
    if (auto opened = AtomicFile::create(file); !opened) return std::unexpected(opened.error());
  }
  return {};
}

double median_call_s(const std::function<void()>& call, double for_about_s) {
  constexpr std::size_t kLeast = 7, kMost = 20000;
  call();
  const Stopwatch whole;
  std::vector<double> times;
  while (times.size() < kMost && (times.size() < kLeast || whole.seconds() < for_about_s)) {
    const Stopwatch watch;
    call();
    times.push_back(watch.seconds());
  }
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

double read_bandwidth() {
  constexpr std::size_t kWords = std::size_t{1} << 27, kChunk = std::size_t{1} << 18;  // 1 GB
  std::vector<std::uint64_t> words(kWords, 1);
  double best = 0.0;
  for (int pass = 0; pass < 5; ++pass) {
    const Stopwatch watch;
    const auto sum =
        parallel_sum<std::uint64_t>(kWords, kChunk, 0, [&](std::size_t begin, std::size_t end) {
          return sum_of(words.data() + begin, end - begin);
        });
    const double seconds = watch.seconds();
    if (sum == kWords) best = std::max(best, static_cast<double>(8 * kWords) / seconds);
  }
  return best;
}

Result<std::unique_ptr<ScratchFolder>> ScratchFolder::create() {
  std::error_code error;
  // What mkdtemp fills in.
  const std::string random_part(6, 'X');
  std::string name = (fs::temp_directory_path(error) / ("viscera_bench_" + random_part)).string();
  if (error || !mkdtemp(name.data())) return failure(name + ": can't make a temporary folder");
  return std::unique_ptr<ScratchFolder>(new ScratchFolder(name));
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

CommandResult run_program(const std::vector<std::string>& words, const fs::path& log,
                          const fs::path& folder) {
  std::vector<std::string> copy = words;
  std::vector<char*> arguments;
  for (std::string& word : copy) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const std::string log_name = log.empty() ? "/dev/null" : log.string();
  const Stopwatch watch;
  const pid_t child = fork();
  if (child < 0) return {};
  if (child == 0) {
    const int out = open(log_name.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (out >= 0) {
      dup2(out, STDOUT_FILENO);
      dup2(out, STDERR_FILENO);
    }
    if (!folder.empty() && chdir(folder.c_str()) != 0) _exit(127);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  CommandResult result;
  int status = 0;
  rusage usage{};
  if (wait4(child, &status, 0, &usage) != child) return {};
  result.wall_s = watch.seconds();
  result.peak_memory_bytes = static_cast<std::size_t>(usage.ru_maxrss) * 1024;
  if (WIFEXITED(status) && WEXITSTATUS(status) != 127) result.code = WEXITSTATUS(status);
  return result;
}

}  // namespace viscera
