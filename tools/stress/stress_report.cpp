// Running many cases side by side, and what is told of them.
#include <fmt/format.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <limits>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <ostream>
#include <thread>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/progress_bar.h"
#include "kernels/base/stopwatch.h"
#include "tools/stress/refusals.h"
#include "tools/stress/stress_run.h"

namespace viscera {
namespace {

double share_of_limit(const StressFigure& figure) {
  if (std::isnan(figure.figure)) return std::numeric_limits<double>::infinity();
  return figure.limit > 0.0 ? figure.figure / figure.limit : figure.figure;
}

nlohmann::json number(double value) {
  if (std::isfinite(value)) return value;
  return nullptr;  // JSON has no infinity
}

nlohmann::json to_json(const StressFigure& figure) {
  return {{"check", figure.check},
          {"figure", number(figure.figure)},
          {"limit", figure.limit},
          {"sound", figure.sound()},
          {"detail", figure.detail}};
}

/// Cases done, taken by whoever is free; handed out in the order of their numbers.
class Queue {
 public:
  Queue(const StressOptions& options, int first, int count)
      : options_(options), first_(first), outcomes_(static_cast<std::size_t>(count)) {}

  void work() {
    // Inner loops stay on this thread: no case waits for another's, and none is done within one.
    oneapi::tbb::task_arena arena(1);
    arena.execute([&] {
      for (int i = next_++; i < static_cast<int>(outcomes_.size()); i = next_++) {
        auto outcome = run(first_ + i);
        const std::lock_guard guard(lock_);
        if (!outcome) return;
        outcomes_[static_cast<std::size_t>(i)] = std::move(*outcome);
        ++done_;
        changed_.notify_one();
      }
    });
    const std::lock_guard guard(lock_);
    changed_.notify_one();
  }

  /// Waits up to a fifth of a second for the next; null: none yet. In order.
  const StressOutcome* next() {
    std::unique_lock guard(lock_);
    auto& slot = outcomes_[told_];
    if (!slot) changed_.wait_for(guard, std::chrono::milliseconds(200));
    if (!slot) return nullptr;
    ++told_;
    return &*slot;
  }
  bool finished() const { return told_ == outcomes_.size(); }
  int done() {
    const std::lock_guard guard(lock_);
    return done_;
  }

 private:
  Result<StressOutcome> run(int number) const {
    try {
      return run_stress_case(options_.seed, number, options_.fault, until_interrupted());
    } catch (const std::exception& error) {
      StressOutcome outcome;
      outcome.number = number;
      outcome.kind = static_cast<StressKind>(number % kStressKinds);
      outcome.figures.push_back({"no exception", 1.0, 0.0, error.what()});
      return outcome;
    }
  }

  const StressOptions& options_;
  const int first_;
  std::atomic<int> next_ = 0;
  std::mutex lock_;
  std::condition_variable changed_;
  std::vector<std::optional<StressOutcome>> outcomes_;
  std::size_t told_ = 0;
  int done_ = 0;
};

void tell_figures(const StressOutcome& outcome, bool all, std::ostream& out) {
  for (const StressFigure& figure : outcome.figures) {
    if (!all && figure.sound()) continue;
    out << fmt::format("  {:<32}{:>12.3g}  limit {:<10.3g}{}{}\n", figure.check, figure.figure,
                       figure.limit, figure.sound() ? "" : "  FAILED",
                       figure.detail.empty() ? "" : "  (" + figure.detail + ")");
  }
}

void tell_failure(const StressOptions& options, const StressOutcome& outcome, std::ostream& out) {
  out << fmt::format("case {} FAILED: {}\n", outcome.number, outcome.description);
  if (!outcome.tools.empty()) out << "  " << outcome.tools << '\n';
  if (!outcome.refused.empty())
    out << "  refused, but " << unclear_refusal(outcome.refused) << '\n';
  else if (outcome.to_be_refused)
    out << "  answered, though nobody can answer for such a body\n";
  tell_figures(outcome, false, out);
  out << "  " << replay_command(options, outcome.number) << '\n' << std::flush;
}

struct Tally {
  int cases = 0, passed = 0, refused = 0, failed = 0;
};

/// What all cases come to.
class Summary {
 public:
  void add(const StressOptions& options, const StressOutcome& outcome) {
    Tally& kind = kinds_[static_cast<std::size_t>(outcome.kind)];
    Tally& formulation = formulations_[outcome.formulation];
    const bool passed = outcome.passed(), refused = !outcome.refused.empty();
    for (Tally* tally : {&kind, &formulation, &total_}) {
      ++tally->cases;
      ++(!passed ? tally->failed : refused ? tally->refused : tally->passed);
    }
    const bool galerkin = outcome.formulation == "galerkin";
    if (galerkin) {
      Tally& own = galerkin_[static_cast<std::size_t>(outcome.kind)];
      ++own.cases;
      ++(!passed ? own.failed : refused ? own.refused : own.passed);
    }
    count_refusal(all_refusals_, outcome);
    if (galerkin) count_refusal(galerkin_refusals_, outcome);
    if (refused && passed) {
      auto& reason = reasons_[refusal_sort(outcome.refused)];
      if (reason.count++ == 0) {
        reason.example = outcome.number;
        reason.text = outcome.refused;
      }
      ++reason.kinds[std::string(stress_kind_name(outcome.kind))];
    }
    for (const StressFigure& figure : outcome.figures) {
      auto [at, fresh] = worst_.try_emplace(figure.check, figure, outcome.number);
      if (!fresh && share_of_limit(figure) > share_of_limit(at->second.first))
        at->second = {figure, outcome.number};
    }
    if (passed) return;
    nlohmann::json failure = {
        {"case", outcome.number},     {"description", outcome.description},
        {"tools", outcome.tools},     {"replay", replay_command(options, outcome.number)},
        {"refused", outcome.refused}, {"checks", nlohmann::json::array()}};
    for (const StressFigure& figure : outcome.figures)
      if (!figure.sound()) failure["checks"].push_back(to_json(figure));
    failures_.push_back(std::move(failure));
  }

  const Tally& total() const { return total_; }

  /// More refusals of a kind than there may be.
  std::vector<std::string> too_many() const {
    std::vector<std::string> messages = all_refusals_.over(false);
    for (std::string& message : galerkin_refusals_.over(true)) messages.push_back(message);
    return messages;
  }

  void print(std::ostream& out) const {
    out << fmt::format("{:<20}{:>8}{:>8}{:>9}{:>8}\n", "kind", "cases", "passed", "refused",
                       "failed");
    const auto row = [&](std::string_view name, const Tally& tally) {
      if (tally.cases > 0)
        out << fmt::format("{:<20}{:>8}{:>8}{:>9}{:>8}\n", name, tally.cases, tally.passed,
                           tally.refused, tally.failed);
    };
    for (std::size_t k = 0; k < kinds_.size(); ++k)
      row(stress_kind_name(static_cast<StressKind>(k)), kinds_[k]);
    for (const auto& [name, tally] : formulations_) row(name, tally);
    row("all", total_);
    for (const std::string& name : formulation_names()) {
      const auto at = formulations_.find(name);
      if (at == formulations_.end() || at->second.passed == 0) continue;
      if (find_formulation(name)->warning().empty()) continue;
      out << fmt::format(
          "{}: not held to giving no energy, which it doesn't promise; its contacts are finite or "
          "say that they found no forces\n",
          name);
    }
    out << fmt::format("\n{:<20}{:>8}{:>8}{:>9}{:>8}\n", "galerkin alone", "cases", "passed",
                       "refused", "failed");
    for (std::size_t k = 0; k < galerkin_.size(); ++k)
      row(stress_kind_name(static_cast<StressKind>(k)), galerkin_[k]);
    out << fmt::format("\n{:<20}{:>8}{:>9}{:>12}{:>9}\n", "refused because", "all", "at most",
                       "galerkin", "at most");
    for (int k = 0; k < kRefusalKinds; ++k) {
      const auto kind = static_cast<RefusalKind>(k);
      const auto at = static_cast<std::size_t>(k);
      out << fmt::format("{:<20}{:>8}{:>9}{:>12}{:>9}\n", refusal_kind_name(kind),
                         all_refusals_.of_kind[at], all_refusals_.ceiling(kind, false),
                         galerkin_refusals_.of_kind[at], galerkin_refusals_.ceiling(kind, true));
    }
    out << fmt::format("{} of {} refused cases were made to be refused\n", all_refusals_.meant,
                       all_refusals_.all());
    if (!reasons_.empty()) out << "each reason with its first case:\n";
    for (const auto& [reason, said] : reasons_)
      out << fmt::format("{:>6} (case {}) {}\n", said.count, said.example, reason);
    out << "worst figure of each check:\n";
    for (const auto& [check, worst] : worst_)
      out << fmt::format("  {:<32}{:>12.3g}  limit {:<10.3g}case {}\n", check, worst.first.figure,
                         worst.first.limit, worst.second);
  }

  nlohmann::json json(const StressOptions& options) const {
    const auto tally_json = [](const Tally& tally) {
      return nlohmann::json{{"cases", tally.cases},
                            {"passed", tally.passed},
                            {"refused", tally.refused},
                            {"failed", tally.failed}};
    };
    nlohmann::json all = tally_json(total_);
    all["seed"] = options.seed;
    all["kinds"] = nlohmann::json::object();
    for (std::size_t k = 0; k < kinds_.size(); ++k)
      if (kinds_[k].cases > 0)
        all["kinds"][std::string(stress_kind_name(static_cast<StressKind>(k)))] =
            tally_json(kinds_[k]);
    all["formulations"] = nlohmann::json::object();
    for (const auto& [name, tally] : formulations_) all["formulations"][name] = tally_json(tally);
    all["refusals"] = nlohmann::json::array();
    for (const auto& [reason, said] : reasons_)
      all["refusals"].push_back({{"reason", reason},
                                 {"kind", refusal_kind_name(refusal_kind(said.text))},
                                 {"count", said.count},
                                 {"example_case", said.example},
                                 {"kinds", said.kinds}});
    const auto refusals_json = [](const Refusals& refusals, bool galerkin) {
      nlohmann::json json = {{"cases", refusals.cases},
                             {"refused", refusals.all()},
                             {"made_to_be_refused", refusals.meant}};
      for (int k = 0; k < kRefusalKinds; ++k) {
        const auto kind = static_cast<RefusalKind>(k);
        json["kinds"][std::string(refusal_kind_name(kind))] = {
            {"refused", refusals.of_kind[static_cast<std::size_t>(k)]},
            {"at_most", refusals.ceiling(kind, galerkin)}};
      }
      return json;
    };
    all["refused_because"] = {{"all", refusals_json(all_refusals_, false)},
                              {"galerkin", refusals_json(galerkin_refusals_, true)}};
    all["worst"] = nlohmann::json::array();
    for (const auto& [check, worst] : worst_) {
      nlohmann::json figure = to_json(worst.first);
      figure["case"] = worst.second;
      all["worst"].push_back(std::move(figure));
    }
    all["failures"] = failures_;
    return all;
  }

 private:
  static void count_refusal(Refusals& refusals, const StressOutcome& outcome) {
    ++refusals.cases;
    if (outcome.refused.empty()) return;
    ++refusals.of_kind[static_cast<std::size_t>(refusal_kind(outcome.refused))];
    refusals.meant += outcome.to_be_refused;
  }

  struct Reason {
    int count = 0, example = 0;
    std::string text;  ///< of the first
    std::map<std::string, int> kinds;
  };
  std::array<Tally, kStressKinds> kinds_, galerkin_;
  Refusals all_refusals_, galerkin_refusals_;
  std::map<std::string, Tally> formulations_;
  Tally total_;
  std::map<std::string, Reason> reasons_;
  std::map<std::string, std::pair<StressFigure, int>> worst_;
  nlohmann::json failures_ = nlohmann::json::array();
};

}  // namespace

Result<bool> run_stress(const StressOptions& options, std::ostream& out) {
  const Stopwatch watch;
  const int first = options.only.value_or(0), count = options.only ? 1 : options.cases;
  Queue queue(options, first, count);
  Summary summary;
  {
    const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    const int threads = std::min(count, options.threads > 0 ? options.threads : cores);
    std::vector<std::jthread> workers;
    for (int i = 0; i < threads; ++i) workers.emplace_back([&] { queue.work(); });
    std::optional<ProgressBar> bar;
    if (!options.quiet && count > 1) bar.emplace("stress");
    while (!queue.finished() && !interrupted()) {
      if (bar) bar->update(static_cast<double>(queue.done()) / count, "running cases");
      const StressOutcome* outcome = queue.next();
      if (!outcome) continue;
      summary.add(options, *outcome);
      if (options.only) {
        out << fmt::format("case {}: {}\n  {}\n", outcome->number, outcome->description,
                           outcome->tools);
        if (!outcome->refused.empty()) out << "  refused: " << outcome->refused << '\n';
        tell_figures(*outcome, true, out);
      }
      if (!outcome->passed()) tell_failure(options, *outcome, out);
    }
    if (bar && queue.finished()) bar->update(1.0, "running cases");
  }
  if (interrupted()) return failure(kCancelled);
  if (!options.only) summary.print(out);
  const Tally& total = summary.total();
  out << fmt::format("{} of {} cases passed, {} refused with a reason, {} failed; {}\n",
                     total.passed, total.cases, total.refused, total.failed,
                     duration_text(watch.seconds()));
  if (!options.json.empty()) {
    const std::string text = summary.json(options).dump(2) + "\n";
    if (auto written = write_file(options.json, text); !written)
      return std::unexpected(written.error());
  }
  const std::vector<std::string> too_many =
      options.only ? std::vector<std::string>() : summary.too_many();
  for (const std::string& message : too_many) out << message << '\n';
  return total.failed == 0 && too_many.empty();
}

}  // namespace viscera
