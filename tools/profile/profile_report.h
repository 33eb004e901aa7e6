// What `viscera profile` found, as text, JSON and pictures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "tools/common/bench_figures.h"
#include "tools/profile/profile_measure.h"

namespace viscera {

struct LineFit {
  double slope = 0.0, intercept = 0.0;
  double at(double x) const { return intercept + slope * x; }
};
/// Least squares; nothing for fewer than two different x.
std::optional<LineFit> fit_line(const std::vector<Vec2>& points);

struct ProfileReport {
  std::string scene, machine, renderer;
  int cores = 0;
  double seconds = 0.0;  ///< simulated in each case
  int rounds = 0;
  std::vector<ProfileCase> idle, touched;  ///< by number of organs
  struct Memory {
    std::size_t organs = 0;
    std::uint64_t bytes = 0;
  };
  std::vector<Memory> memory;
  SceneItself itself;
  std::vector<std::string> left_out;  ///< cases that can't be: more touched than there are
  std::string not_touched;            ///< why no case has a touched organ though it was to have one
  std::size_t scene_organs = 0;

  /// Medians of the step against the number of organs, nothing touched [us].
  std::optional<LineFit> idle_fit() const;
  /// The same with tools that touch.
  std::optional<LineFit> touched_fit() const;
  /// What an organ adds to a frame in which it is touched: median [us]; nothing where none is.
  std::optional<double> touched_organ_us() const;
  /// The most organs over the fewest, as many touched, frame by frame in which some are: median.
  std::optional<double> cost_of_organs() const;
  std::vector<BenchRow> rows() const;
};

void print(const ProfileReport& report, std::ostream& out);
std::string to_json_text(const ProfileReport& report);
/// cost_against_organs.svg and memory_against_organs.svg.
Result<void> draw_plots(const ProfileReport& report, const std::filesystem::path& folder);

}  // namespace viscera
