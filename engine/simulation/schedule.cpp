#include "engine/simulation/schedule.h"

#include <fmt/format.h>

#include <algorithm>

namespace viscera {
namespace {

bool holds(const std::vector<std::string_view>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string joined(const std::vector<std::string_view>& names) {
  std::string all;
  for (const std::string_view name : names) all += (all.empty() ? "" : ", ") + std::string(name);
  return all;
}

/// True where `a` comes before `b` because of something that both name. `earlier`: it stands before
/// it in the list.
bool precedes(const Stage& a, const Stage& b, bool earlier) {
  for (const std::string_view thing : a.writes) {
    const bool changes = holds(a.reads, thing);
    if (holds(b.writes, thing)) {
      const bool b_changes = holds(b.reads, thing);
      if (changes == b_changes ? earlier : !changes) return true;
    } else if (holds(b.reads, thing)) {
      return true;
    }
  }
  for (const std::string_view thing : a.reads_before)
    if (holds(b.writes, thing) && !holds(b.reads_before, thing)) return true;
  return false;
}

}  // namespace

Result<Schedule> Schedule::of(const std::vector<Feature>& features) {
  Schedule all;
  for (const Feature& feature : features)
    for (const Stage& stage : feature.stages) {
      all.stages_.push_back(stage);
      all.owners_.push_back(feature.name);
    }
  const std::size_t n = all.stages_.size();
  for (const Stage& stage : all.stages_)
    for (const auto* names : {&stage.reads, &stage.reads_before})
      for (const std::string_view thing : *names)
        if (thing != "controls" &&
            std::none_of(all.stages_.begin(), all.stages_.end(),
                         [&](const Stage& one) { return holds(one.writes, thing); }))
          return failure(
              fmt::format("stage \"{}\": found that it reads \"{}\", expected something "
                          "that a stage writes",
                          stage.name, thing));
  Schedule ordered;
  std::vector<char> placed(n, 0);
  while (ordered.stages_.size() < n) {
    std::size_t next = n;
    for (std::size_t i = 0; i < n && next == n; ++i) {
      if (placed[i]) continue;
      bool free = true;
      for (std::size_t j = 0; j < n && free; ++j)
        free = j == i || placed[j] || !precedes(all.stages_[j], all.stages_[i], j < i);
      if (free) next = i;
    }
    if (next == n) {
      std::string ring;
      for (std::size_t i = 0; i < n; ++i)
        if (!placed[i])
          ring += fmt::format("{}\"{}\"", ring.empty() ? "" : ", ", all.stages_[i].name);
      return failure("stages: found " + ring + " that wait for each other, expected an order");
    }
    placed[next] = 1;
    ordered.stages_.push_back(all.stages_[next]);
    ordered.owners_.push_back(all.owners_[next]);
  }
  return ordered;
}

std::string Schedule::markdown() const {
  std::string text = "| stage | feature | reads | writes |\n| --- | --- | --- | --- |\n";
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    const Stage& stage = stages_[i];
    std::string reads = joined(stage.reads);
    if (!stage.reads_before.empty())
      reads += (reads.empty() ? "" : "; ") + std::string("of the last step: ") +
               joined(stage.reads_before);
    text +=
        fmt::format("| {} | {} | {} | {} |\n", stage.name, owners_[i], reads, joined(stage.writes));
  }
  return text;
}

}  // namespace viscera
