#include "tools/bench/bench_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <ostream>
#include <vector>

#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/svg_plot.h"
#include "engine/simulator/build.h"
#include "engine/simulator/loop.h"
#include "kernels/base/stopwatch.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

/// The last is what the others are compared with.
constexpr std::array<std::uint64_t, 4> kRates = {30, 60, 120, 240};
/// Forces are compared so many times a second, shapes every so many of those.
constexpr std::uint64_t kLooks = 30, kLooksAShape = 8;

struct Course {
  std::uint64_t rate = 0;
  double wall = 0.0;                                    ///< of all steps [s]
  std::vector<double> frames;                           ///< [s]
  std::vector<std::vector<Vec3>> forces;                ///< [instrument][look] [N]
  std::vector<std::vector<std::vector<Vec3f>>> shapes;  ///< [organ][look][vertex] [m]
  // Against the finest.
  std::vector<double> force_errors;  ///< of each tool: mean over time, over its mean force
  /// Greatest way of a vertex between both, of organs until they are cut [m].
  double shape_error = 0.0;
};

Result<Course> run(SceneDescription scene, const std::map<std::string, Tissue>& tissues,
                   std::uint64_t rate) {
  set_steps(scene, {.per_second = rate});
  std::vector<std::string> warnings;
  auto model = build_model(scene, tissues, {assets_folder(), true}, until_interrupted(), warnings);
  if (!model) return std::unexpected(model.error());
  auto simulation = Simulation::create(Model(*std::move(model)), {.hands = Hands::kNone});
  if (!simulation) return std::unexpected(simulation.error());
  Course course;
  course.rate = rate;
  course.forces.resize(scene.instruments.size());
  course.shapes.resize(scene.organs.size());
  Stopwatch step;
  Loop loop{.until = scene.steps.steps_in(scene.duration)};
  loop.pace = [&](Simulation&) {
    step = Stopwatch();
    return !interrupted();
  };
  loop.look = [&](Simulation& one, const StepReport&) -> Result<void> {
    course.frames.push_back(step.seconds());
    course.wall += course.frames.back();
    const std::uint64_t apart = rate / kLooks;
    if (one.frame() % apart != 0) return {};
    for (std::size_t i = 0; i < course.forces.size(); ++i) course.forces[i].push_back(one.force(i));
    if (one.frame() % (apart * kLooksAShape) != 0) return {};
    for (std::size_t o = 0; o < course.shapes.size(); ++o) {
      const SurfaceView surface = one.surface(o);
      course.shapes[o].emplace_back(surface.positions.begin(), surface.positions.end());
    }
    return {};
  };
  if (auto stepped = step_through(*simulation, loop); !stepped)
    return std::unexpected(stepped.error());
  if (interrupted()) return failure(kCancelled);
  return course;
}

double mean_size(const std::vector<Vec3>& forces) {
  double sum = 0.0;
  for (const Vec3& force : forces) sum += force.norm();
  return forces.empty() ? 0.0 : sum / static_cast<double>(forces.size());
}

void compare(const Course& finest, Course& course) {
  for (std::size_t i = 0; i < course.forces.size(); ++i) {
    const double mean = mean_size(finest.forces[i]);
    const std::size_t looks = std::min(course.forces[i].size(), finest.forces[i].size());
    double off = 0.0;
    for (std::size_t k = 0; k < looks; ++k)
      off += (course.forces[i][k] - finest.forces[i][k]).norm() / static_cast<double>(looks);
    course.force_errors.push_back(mean > 0.0 ? off / mean : 0.0);
  }
  for (std::size_t o = 0; o < course.shapes.size(); ++o)
    for (std::size_t k = 0; k < std::min(course.shapes[o].size(), finest.shapes[o].size()); ++k) {
      const auto &one = course.shapes[o][k], &other = finest.shapes[o][k];
      // Vertices of what was cut since have other numbers.
      const std::size_t whole = finest.shapes[o].front().size();
      if (one.size() != whole || other.size() != whole) break;
      for (std::size_t v = 0; v < whole; ++v)
        course.shape_error =
            std::max(course.shape_error, static_cast<double>((one[v] - other[v]).norm()));
    }
}

double at_share(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

std::string line(const Course& one, double duration, bool finest) {
  std::string text =
      fmt::format("{:>7}{:>12.2f} x{:>11.1f} ms{:>11.1f} ms", one.rate, duration / one.wall,
                  1e3 * at_share(one.frames, 0.5), 1e3 * at_share(one.frames, 0.99));
  if (finest) return text + "   what the others are compared with\n";
  text += fmt::format("{:>11.2f} mm", 1e3 * one.shape_error);
  for (const double error : one.force_errors) text += fmt::format("{:>11.1f} %", 100.0 * error);
  return text + "\n";
}

std::string heading(const SceneDescription& scene) {
  std::string text = fmt::format("{:>7}{:>14}{:>14}{:>14}{:>14}", "steps/s", "real time", "a step",
                                 "p99", "a vertex");
  for (const InstrumentDescription& tool : scene.instruments)
    text += fmt::format("{:>13}", tool.name.substr(0, 12));
  return text + "\n";
}

nlohmann::json to_json(const std::vector<Course>& courses, double duration) {
  nlohmann::json cases = nlohmann::json::array();
  for (const Course& one : courses)
    cases.push_back({{"steps_per_s", one.rate},
                     {"real_time_factor", duration / one.wall},
                     {"frame_ms", 1e3 * at_share(one.frames, 0.5)},
                     {"frame_p99_ms", 1e3 * at_share(one.frames, 0.99)},
                     {"force_errors", one.force_errors},
                     {"shape_error_m", one.shape_error}});
  return cases;
}

Result<void> draw(const std::vector<Course>& courses, const SceneDescription& scene,
                  const std::filesystem::path& folder) {
  Plot plot;
  plot.title = scene.name + ": time against error, by the length of a step";
  plot.subtitle = fmt::format("30, 60 and 120 steps a second against {}", kRates.back());
  plot.x = {"wall time over simulated time"};
  plot.y = {"error of the force over its mean (%)"};
  for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
    PlotSeries errors{.name = scene.instruments[i].name};
    for (const Course& one : courses)
      if (one.rate != kRates.back())
        errors.points.emplace_back(one.wall / scene.duration, 100.0 * one.force_errors[i]);
    plot.series.push_back(errors);
  }
  return write_file(folder / "steps.svg", to_svg(plot));
}

}  // namespace

Result<void> bench_steps(const SceneDescription& scene,
                         const std::map<std::string, Tissue>& tissues,
                         const StepsBenchOptions& options, std::ostream& out) {
  if (auto writable = check_outputs({options.json}, options.plots); !writable) return writable;
  std::vector<Course> courses;
  for (const std::uint64_t rate : kRates) {
    auto course = run(scene, tissues, rate);
    if (!course) return std::unexpected(course.error());
    courses.push_back(*std::move(course));
  }
  const bool touched = std::ranges::any_of(
      courses.back().forces, [](const auto& forces) { return mean_size(forces) > 0.0; });
  if (!touched)
    return failure(scene.file.string() +
                   ": instruments: found none that touches anything, expected one whose force can "
                   "be compared");
  out << heading(scene);
  for (Course& one : courses) {
    compare(courses.back(), one);
    out << line(one, scene.duration, &one == &courses.back());
  }
  if (auto written = write_cases(options.json, to_json(courses, scene.duration), {}); !written)
    return written;
  return options.plots.empty() ? Result<void>() : draw(courses, scene, options.plots);
}

}  // namespace viscera
