#include "tools/bench/bench_cut.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/svg_plot.h"
#include "engine/verification/cut_block.h"
#include "engine/verification/penny_crack.h"
#include "kernels/base/stopwatch.h"
#include "tools/bench/bench_advancing_cut.h"
#include "tools/common/bench_figures.h"

namespace viscera {
namespace {

/// A row of the table; what a case doesn't have stays empty.
struct CutCase {
  std::string name;
  double spacing = 0.0;                      // [m]
  std::optional<double> force_error = {};    // over the reference
  std::optional<double> opening_error = {};  // over the reference
  std::optional<double> frame = {};          // [s]
  std::optional<double> worker = {};         // to prepare what is left [s]
  std::optional<double> frames_late = {};
};

struct SlitCase {
  double spacing;                             // [m]
  double most_force = 0.0, most_mouth = 0.0;  // errors to reach; 0: none is asked for
};
constexpr std::array<SlitCase, 4> kSlits{
    {{5e-3}, {4e-3, 0.03, 0.04}, {3e-3}, {2.5e-3, 0.02, 0.02}}};

std::string cell(const std::optional<double>& value, double scale, const char* unit, int digits) {
  return value ? fmt::format("{:>12}", fmt::format("{:.{}f} {}", scale * *value, digits, unit))
               : fmt::format("{:>12}", "");
}

nlohmann::json or_null(const std::optional<double>& value, double scale = 1.0) {
  return value ? nlohmann::json(scale * *value) : nlohmann::json();
}

class CutBench {
 public:
  explicit CutBench(bool quick) : quick_(quick) {}

  Result<void> run(std::ostream& out) {
    out << fmt::format("{:<52}{:>9}{:>12}{:>12}{:>12}{:>12}{:>12}\n", "case", "spacing", "force",
                       "opening", "a frame", "worker", "late");
    for (const SlitCase& one : kSlits)
      if (!quick_ || one.spacing > 3.5e-3)
        if (auto done = slit(one, out); !done) return done;
    for (const double spacing : quick_ ? std::vector{4e-3} : std::vector{4e-3, 3e-3})
      for (const Kerf& kerf : kKerfs)
        if (auto done = cut_by_blade(kerf, spacing, out); !done) return done;
    if (auto done = open_penny(2.5e-3, out); !done) return done;
    if (quick_) return {};
    if (auto done = open_penny(1.25e-3, out); !done) return done;
    for (const double spacing : {4e-3, 2.5e-3})
      if (auto done = release_energy(spacing, out); !done) return done;
    if (auto done = go_on(out); !done) return done;
    if (auto done = sever(out); !done) return done;
    return cut_in_scene(out);
  }

  const std::vector<BenchRow>& rows() const { return rows_; }
  nlohmann::json json() const {
    nlohmann::json all = nlohmann::json::array();
    for (const CutCase& one : cases_)
      all.push_back({{"case", one.name},
                     {"spacing_m", one.spacing},
                     {"force_error", or_null(one.force_error)},
                     {"opening_error", or_null(one.opening_error)},
                     {"frame_ms", or_null(one.frame, 1e3)},
                     {"worker_ms", or_null(one.worker, 1e3)},
                     {"frames_late", or_null(one.frames_late)}});
    return all;
  }
  Result<void> draw(const std::filesystem::path& folder) const {
    Plot error;
    error.title = "A slit half through a block: error";
    error.subtitle = "against finite elements, means of three clouds of nodes";
    error.x = {"distance of nodes (mm)"};
    error.y = {"error (%)"};
    error.series = {slit_force_, slit_mouth_};
    Plot time;
    time.title = "A slit half through a block: time";
    time.subtitle = "to prepare what is left";
    time.x = {"distance of nodes (mm)"};
    time.y = {"time (s)"};
    time.series = {slit_time_};
    Plot crack;
    crack.title = "A crack like a coin under pressure";
    crack.subtitle = "radius 5 mm, 100 Pa, 10 kPa, Poisson .45";
    crack.x = {"from its axis (mm)"};
    crack.y = {"opening of both faces (um)"};
    crack.series = cracks_;
    for (const auto& [name, plot] : {std::pair<const char*, const Plot&>{"cut_error.svg", error},
                                     {"cut_time.svg", time},
                                     {"penny_crack.svg", crack}})
      if (auto drawn = write_file(folder / name, to_svg(plot)); !drawn) return drawn;
    return {};
  }

 private:
  void add(const CutCase& one, std::ostream& out) {
    out << fmt::format("{:<52}{:>6.2f} mm{}{}{}{}{}\n", one.name, 1e3 * one.spacing,
                       cell(one.force_error, 100.0, "%", 2), cell(one.opening_error, 100.0, "%", 2),
                       cell(one.frame, 1e3, "ms", 1), cell(one.worker, 1e3, "ms", 0),
                       cell(one.frames_late, 1.0, "frames", 0))
        << std::flush;
    cases_.push_back(one);
  }
  void reach(std::string what, std::string unit, double value, double target) {
    rows_.push_back({std::move(what), std::move(unit), value, target});
  }
  Result<void> slit(const SlitCase& one, std::ostream& out) {
    const double spacing = one.spacing;
    double force = 0.0, mouth = 0.0;
    std::vector<double> times;
    for (const std::uint64_t seed : {1, 2, 3}) {
      if (interrupted()) return failure(kCancelled);
      auto block = CutBlock::whole(spacing, seed);
      if (!block) return std::unexpected(block.error());
      block->slit_down_to(0.0, spacing);
      const Stopwatch watch;
      auto system = block->assemble(CutBlock::is_end);
      if (!system) return std::unexpected(system.error());
      if (auto factor = system->factor(); !factor) return std::unexpected(factor.error());
      times.push_back(watch.seconds());
      auto pulled = pull(*system);
      if (!pulled) return std::unexpected(pulled.error());
      force += std::abs(pulled->force / kSlitForce - 1.0) / 3.0;
      mouth += std::abs(mouth_of(*system, *pulled) / kSlitMouth - 1.0) / 3.0;
    }
    const double time = quantiles(times).median, h = 1e3 * spacing;
    add({.name = "slit half through",
         .spacing = spacing,
         .force_error = force,
         .opening_error = mouth,
         .worker = time},
        out);
    slit_force_.points.emplace_back(h, 100.0 * force);
    slit_mouth_.points.emplace_back(h, 100.0 * mouth);
    slit_time_.points.emplace_back(h, time);
    if (one.most_force > 0.0) {
      reach(fmt::format("slit half through, nodes {:g} mm apart: force", h), "%", 100.0 * force,
            100.0 * one.most_force);
      reach("its mouth", "%", 100.0 * mouth, 100.0 * one.most_mouth);
    }
    return {};
  }

  /// What a kerf adds to the block's compliance.
  Result<void> cut_by_blade(const Kerf& kerf, double spacing, std::ostream& out) {
    const double expected = 1.0 / kerf.force - 1.0 / kWholeForce;
    double error = 0.0;
    std::vector<double> times;
    for (const std::uint64_t seed : {11, 12}) {
      if (interrupted()) return failure(kCancelled);
      auto block = CutBlock::whole(spacing, seed);
      if (!block) return std::unexpected(block.error());
      auto whole = force_of(*block);
      if (!whole) return std::unexpected(whole.error());
      const Stopwatch watch;
      TissueShare gone(CutBlock::kKerfVoxel);
      kerf.cut(gone);
      if (auto taken = block->take(gone, spacing); !taken) return taken;
      auto system = block->assemble(CutBlock::is_end);
      if (!system) return std::unexpected(system.error());
      times.push_back(watch.seconds());
      auto pulled = pull(*system);
      if (!pulled) return std::unexpected(pulled.error());
      const double added = 1.0 / pulled->force - 1.0 / *whole;
      error += 0.5 * std::abs(added / expected - 1.0);
    }
    add({.name = fmt::format("kerf of voxels, {}: added compliance", lower(kerf.name)),
         .spacing = spacing,
         .force_error = error,
         .worker = quantiles(times).median},
        out);
    if (spacing < 3.5e-3)
      reach(fmt::format("kerf of voxels, {}: added compliance", lower(kerf.name)), "%",
            100.0 * error, 8.0);
    return {};
  }

  static Result<double> force_of(const CutBlock& block) {
    auto system = block.assemble(CutBlock::is_end);
    if (!system) return std::unexpected(system.error());
    auto pulled = pull(*system);
    if (!pulled) return std::unexpected(pulled.error());
    return pulled->force;
  }

  /// A slit goes down by half a millimetre a step; what the energy falls by over two. The ends
  /// stay: W is half their force times their way.
  Result<void> release_energy(double spacing, std::ostream& out) {
    constexpr double kStep = 0.5e-3;
    constexpr int kSteps = 4;
    double worst = 0.0, least = 1.0;
    std::vector<double> times;
    for (const std::uint64_t seed : {1, 2, 3}) {
      auto block = CutBlock::whole(spacing, seed);
      if (!block) return std::unexpected(block.error());
      std::vector<double> forces;
      const auto steps = static_cast<int>(kSlitForces.size() - 1) * kSteps;
      for (int step = 0; step <= steps; ++step) {
        if (interrupted()) return failure(kCancelled);
        const double depth = kSlitForces[0].depth + kStep * step;
        block->slit_down_to(0.5 * CutBlock::kHeight - depth, spacing);
        const Stopwatch watch;
        auto force = force_of(*block);
        if (!force) return std::unexpected(force.error());
        times.push_back(watch.seconds());
        forces.push_back(*force);
      }
      for (std::size_t i = 1; i < forces.size(); ++i)
        least = std::min(least, (forces[i - 1] - forces[i]) / kWholeForce);
      for (std::size_t i = 1; i < kSlitForces.size(); ++i) {
        const double exact = kSlitForces[i - 1].force - kSlitForces[i].force;
        const double found = forces[kSteps * (i - 1)] - forces[kSteps * i];
        worst = std::max(worst, std::abs(found / exact - 1.0));
      }
    }
    add({.name = "-dW/dA over 2 mm of a slit, worst of 15",
         .spacing = spacing,
         .force_error = worst,
         .worker = quantiles(times).median},
        out);
    reach(fmt::format("-dW/dA over 2 mm, nodes {:g} mm apart, worst of 15", 1e3 * spacing), "%",
          100.0 * worst, 10.0);
    rows_.push_back(
        {"its least over .5 mm, of the whole block's force", "%", 100.0 * least, 0.0, true});
    return {};
  }

  /// Half through, half a millimetre a step along the width.
  Result<void> go_on(std::ostream& out) {
    constexpr double kSpacing = 4e-3, kStep = 0.5e-3;
    double greatest = 0.0, upwards = 0.0, before = 0.0;
    auto block = CutBlock::whole(kSpacing, 1);
    if (!block) return std::unexpected(block.error());
    for (int step = 0; step <= 60; ++step) {
      if (interrupted()) return failure(kCancelled);
      block->slit_along_to(-15e-3 + kStep * step, kSpacing);
      auto force = force_of(*block);
      if (!force) return std::unexpected(force.error());
      if (step > 0) {
        greatest = std::max(greatest, std::abs(*force / before - 1.0));
        upwards = std::max(upwards, *force / before - 1.0);
      }
      before = *force;
    }
    add({.name = "a slit goes on by .5 mm: greatest step of the force",
         .spacing = kSpacing,
         .force_error = greatest},
        out);
    reach("a cut goes on by .5 mm: greatest step of the force", "%", 100.0 * greatest, 1.0);
    reach("its greatest step upwards", "%", 100.0 * upwards, 0.0);
    return {};
  }

  Result<void> open_penny(double spacing, std::ostream& out) {
    if (interrupted()) return failure(kCancelled);
    PennyCrack crack;
    crack.spacing = spacing;
    auto opened = open_crack(crack);
    if (!opened) return std::unexpected(opened.error());
    if (cracks_.empty()) {
      PlotSeries& exact = cracks_.emplace_back();
      exact.name = "exact";
      exact.markers = false;
      for (int i = 0; i <= 100; ++i) {
        const double r = 0.01 * i * crack.radius;
        exact.points.emplace_back(1e3 * r, 1e6 * crack.exact_opening(r));
      }
    }
    PlotSeries& found = cracks_.emplace_back();
    found.name = fmt::format("nodes {:g} mm apart", 1e3 * spacing);
    found.line = false;
    for (const PennyOpening& one : opened->openings)
      found.points.emplace_back(1e3 * one.r, 1e6 * one.opening);
    const double error =
        std::abs(opened->openings.front().opening / crack.exact_opening(0.0) - 1.0);
    add({.name = "a crack under pressure: opening at its centre",
         .spacing = spacing,
         .opening_error = error,
         .worker = opened->seconds},
        out);
    if (spacing < 2e-3)
      reach("a crack under pressure: opening at its centre", "%", 100.0 * error, 8.0);
    return {};
  }

  Result<void> sever(std::ostream& out) {
    constexpr double kSpacing = 4e-3;
    for (const Kerf& kerf : kSeveringKerfs) {
      double energy = 0.0;
      std::vector<double> times;
      for (const std::uint64_t seed : {1, 2, 3}) {
        if (interrupted()) return failure(kCancelled);
        auto block = CutBlock::whole(kSpacing, seed);
        if (!block) return std::unexpected(block.error());
        const Stopwatch watch;
        TissueShare gone(CutBlock::kKerfVoxel);
        kerf.cut(gone);
        if (auto taken = block->take(gone, kSpacing); !taken) return taken;
        auto system =
            block->assemble([](const Vec3& x) { return CutBlock::is_end(x) && x.x() < 0.0; });
        if (!system) return std::unexpected(system.error());
        times.push_back(watch.seconds());
        auto free = energy_of_free_piece(*system, kSpacing);
        if (!free) return std::unexpected(free.error());
        energy = std::max(energy, *free);
      }
      add({.name = fmt::format("cut through, {}", lower(kerf.name)),
           .spacing = kSpacing,
           .worker = quantiles(times).median},
          out);
      reach(fmt::format("cut through, {}: rigid motions over E h^3", lower(kerf.name)), "", energy,
            1e-10);
    }
    return {};
  }

  Result<void> cut_in_scene(std::ostream& out) {
    auto cut = advancing_cut();
    if (!cut) return std::unexpected(cut.error());
    add({.name =
             fmt::format("a scene's blade at {:g} mm/s, {} nodes", 1e3 * cut->speed, cut->nodes),
         .spacing = cut->spacing,
         .force_error = cut->force_error,
         .frame = cut->frame,
         .worker = cut->worker,
         .frames_late = cut->frames_late},
        out);
    reach("a scene's blade: the tissue's part of a frame", "ms", 1e3 * cut->frame, 16.0);
    reach("how late the tissue opens, at most", "fr.", cut->frames_late, 5.0);
    // Over the force itself it errs by less, since the cut doesn't change much of that.
    reach("the graspers' force meanwhile, over what the cut changes", "%", 100.0 * cut->missing,
          5.0);
    return {};
  }

  static std::string lower(std::string word) {
    word.front() = static_cast<char>(std::tolower(static_cast<unsigned char>(word.front())));
    return word;
  }

  bool quick_;
  std::vector<CutCase> cases_;
  std::vector<BenchRow> rows_;
  PlotSeries slit_force_{.name = "force"}, slit_mouth_{.name = "mouth"},
      slit_time_{.name = "to prepare"};
  std::vector<PlotSeries> cracks_;
};

}  // namespace

Result<void> bench_cut(const CutBenchOptions& options, std::ostream& out) {
  if (auto sound = check_outputs({options.json}, options.plots); !sound) return sound;
  CutBench bench(options.quick);
  if (auto done = bench.run(out); !done) return done;
  print_rows_of_this_machine(bench.rows(), out);
  if (!options.plots.empty())
    if (auto drawn = bench.draw(options.plots); !drawn) return drawn;
  return write_cases(options.json, bench.json(), bench.rows());
}

}  // namespace viscera
