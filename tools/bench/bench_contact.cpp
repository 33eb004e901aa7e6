#include "tools/bench/bench_contact.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <ostream>

#include "engine/features/free_bodies/ball_heap.h"
#include "engine/features/free_bodies/block_on_floor.h"
#include "engine/features/touching/resting.h"
#include "engine/features/touching/touching.h"
#include "engine/features/touching/touching_balls.h"
#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/svg_plot.h"
#include "engine/scene/tissues.h"
#include "engine/simulation/frame.h"
#include "engine/simulation/prepare.h"
#include "engine/simulator/build.h"
#include "engine/verification/two_balls.h"
#include "kernels/base/stopwatch.h"
#include "kernels/points/surface.h"
#include "tools/bench/bench_jaws.h"
#include "tools/bench/bench_pressure.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

/// Hertz's balls, held infinitely far away, come this much nearer under 29.6 mN [m].
constexpr double kApproach = 1e-3;
constexpr double kGravity = 9.81;

/// Patches a fifth of the touching disc's radius apart, on triangles that lie 3 um within the ball.
constexpr BallFineness kFine{.edge = 0.7e-3, .pitch = 0.25};

struct ContactCase {
  std::string name;
  double value = 0.0, reference = 0.0;
  double frame_ms = 0.0;
  int rows = 0;
  double error() const { return value / reference - 1.0; }
};

/// The bases' approach under the force of Hertz's balls at kApproach [m].
double held_approach(const IsotropicMaterial& material, double give) {
  return kApproach - 2.0 * give * hertz(material, kHemisphereRadius, kApproach).force;
}

class ContactBench {
 public:
  Result<void> run(std::ostream& out) {
    auto balls = TwoBalls::prepare({}, until_interrupted());
    if (!balls) return std::unexpected(balls.error());
    material_ = (*balls)->material();
    auto give = give_of_base(material_, kHemisphereRadius);
    if (!give) return std::unexpected(give.error());
    give_ = *give;
    out << fmt::format("{:<62}{:>10}{:>11}{:>9}{:>11}{:>7}\n", "case", "value", "reference",
                       "error", "frame", "rows");
    press_kernel(**balls, out);
    for (const bool fine : {false, true})
      for (const Response response : {Response::kLinear, Response::kFinite})
        if (auto pressed = press_organs(response, fine, out); !pressed) return pressed;
    drag(**balls, out);
    if (auto slid = slide_block(out); !slid) return slid;
    if (auto pressed = press_to_modulus(out); !pressed) return pressed;
    for (const int edge : {2, 4})
      if (auto settled = settle_heap(edge, out); !settled) return settled;
    return pull_by_jaws(out);
  }

  std::vector<BenchRow> rows() const {
    const auto error = [&](std::size_t i) { return 100.0 * std::abs(cases_[i].error()); };
    return {{"two balls, the kernel: force against Hertz", "%", error(0), 4.0},
            {"their radius of touch", "%", error(1), 10.0},
            {"their forces, opposite", "", unbalanced_, 1e-6},
            {"two linear organs: force against Hertz", "%", error(2), 4.0},
            {"a frame while they touch", "ms", cases_[2].frame_ms, 0.5},
            {"two organs at finite strain: force against Hertz", "%", error(3), 4.0},
            {"a frame while they touch", "ms", cases_[3].frame_ms, 4.0},
            {"fine patches, linear: force against Hertz", "%", error(4), 4.0},
            {"fine patches, finite strain: the same", "%", error(5), 4.0},
            {"dragged: tangential over normal force", "%", error(6), 1.0},
            {"a block that nothing holds slides at tan = mu", "%", error(7), 1.0},
            {"a block under a tenth of its modulus: force", "%", error(8), 5.0},
            {"the pressure that it carries without a flag, over its modulus", "",
             cases_[9].value / cases_[9].reference, 1.0, true},
            {"64 balls in a box: a frame until they rest, mean", "ms", cases_[11].frame_ms, 100.0},
            {"what carries them then: force against their weight", "%", error(11), 1.0},
            {"a frame once they rest", "ms", resting_ms_, 0.1},
            {"jaws: pull at which slip begins, from 2 mu N", "%", jaws_begin_, 5.0},
            {"jaws: friction while they slide, from 2 mu N", "%", jaws_slide_, 5.0}};
  }
  nlohmann::json json() const {
    nlohmann::json all = nlohmann::json::array();
    for (const ContactCase& one : cases_)
      all.push_back({{"case", one.name},
                     {"value", one.value},
                     {"reference", one.reference},
                     {"error", one.error()},
                     {"frame_ms", one.frame_ms},
                     {"rows", one.rows}});
    return all;
  }
  Plot plot() const {
    Plot plot;
    plot.title = "Two balls press each other";
    plot.subtitle = "R 25 mm, E 10 kPa, Poisson .45, held by their bases";
    plot.x = {"approach (mm)"};
    plot.y = {"force (mN)"};
    plot.series = {computed_, exact_};
    return plot;
  }

 private:
  void add(const ContactCase& one, std::ostream& out) {
    out << fmt::format("{:<62}{:>10.5f}{:>11.5f}{:>7.2f} %{:>8.2f} ms{:>7}\n", one.name, one.value,
                       one.reference, 100.0 * one.error(), one.frame_ms, one.rows)
        << std::flush;
    cases_.push_back(one);
  }

  Tissue rubber() const {
    Tissue tissue;
    tissue.name = "rubber";
    tissue.elastic = material_;
    return tissue;
  }

  Result<std::unique_ptr<World>> start(const SceneDescription& scene) const {
    std::vector<std::string> warnings;
    auto model = build_model(scene, {{"rubber", rubber()}}, {assets_folder(), false},
                             until_interrupted(), warnings);
    if (!model) return std::unexpected(model.error());
    return start_world(*std::move(model));
  }

  void press_kernel(TwoBalls& balls, std::ostream& out) {
    const HertzAnswer exact = hertz(material_, kHemisphereRadius, kApproach);
    const double approach = held_approach(material_, give_);
    TwoBallsAnswer answer;
    const double time = median_call_s([&] { answer = balls.press(approach); }, 0.5);
    add({"balls, kernel: force (N)", answer.force, exact.force, 1e3 * time, answer.island.rows},
        out);
    add({"balls, kernel: radius (mm)", 1e3 * answer.radius, 1e3 * exact.radius, 1e3 * time,
         answer.island.rows},
        out);
    unbalanced_ = answer.unbalanced;
    computed_.name = "computed";
    computed_.line = false;
    exact_.name = "Hertz, bases held";
    exact_.markers = false;
    for (int i = 1; i <= 10; ++i) {
      const double deep = 0.2e-3 * i;
      computed_.points.emplace_back(1e3 * deep, 1e3 * balls.press(deep).force);
      exact_.points.emplace_back(1e3 * deep,
                                 1e3 * hertz_held(material_, kHemisphereRadius, deep, give_).force);
    }
  }

  /// The upper organ goes down and back; frames count in which they touch.
  Result<void> press_organs(Response response, bool fine, std::ostream& out) {
    const double approach = held_approach(material_, give_);
    auto world = start(touching_balls(approach, response, fine ? kFine : BallFineness{}));
    if (!world) return std::unexpected(world.error());
    Trace trace(stage_names());
    std::vector<double> times;
    double greatest = 0.0;
    while ((*world)->time() < 2.0 * kBallsNearest) {
      if (interrupted()) return failure(kCancelled);
      const Stopwatch watch;
      step_frame(**world, trace);
      const double took = watch.seconds();
      Vec3 force = Vec3::Zero();
      for (const Vec3& one : (*world)->all<OrganContact>()[0].solution.forces) force += one;
      if (-force.z() > 0.0) times.push_back(took);
      greatest = std::max(greatest, -force.z());
    }
    const bool linear = response == Response::kLinear;
    add({fmt::format("balls, {}, {}: force (N)",
                     linear ? "linear organs" : "organs at finite strain",
                     fine ? "fine patches" : "patches by default"),
         greatest, hertz(material_, kHemisphereRadius, kApproach).force,
         1e3 * quantiles(times).median,
         static_cast<int>((*world)->one<TouchingFigures>()->most_rows)},
        out);
    return {};
  }

  /// The upper ball's cells are dragged along until all slide.
  void drag(TwoBalls& balls, std::ostream& out) {
    constexpr double kFriction = 0.3;
    TwoBallsAnswer answer;
    const double time = median_call_s(
        [&] { answer = balls.press(held_approach(material_, give_), kFriction, 5e-3); }, 0.5);
    add({"balls, dragged: tangential over normal force", answer.drag / answer.force, kFriction,
         1e3 * time, answer.island.rows},
        out);
  }

  /// A soft block on a slope whose tangent is so many times the friction: how it gets faster
  /// [m/s2], from the ways of its surface's mean in two spans of time.
  Result<double> acceleration(double friction, double ratio, ContactCase& told) {
    constexpr double kSpan = 0.4;
    auto world =
        start(block_on_floor({.friction = friction, .slope = std::atan(ratio * friction)}));
    if (!world) return std::unexpected(world.error());
    Trace trace(stage_names());
    std::vector<double> times, places;
    for (int span = 1; span <= 3; ++span) {
      while ((*world)->time() < span * kSpan - 1e-9) {
        if (interrupted()) return failure(kCancelled);
        const Stopwatch watch;
        step_frame(**world, trace);
        times.push_back(watch.seconds());
      }
      double sum = 0.0;
      const std::vector<Vec3f>& positions = (*world)->all<OrganState>()[0].positions;
      for (const Vec3f& position : positions) sum += static_cast<double>(position.y());
      places.push_back(sum / static_cast<double>(positions.size()));
    }
    told.frame_ms = 1e3 * quantiles(times).median;
    told.rows = static_cast<int>((*world)->one<TouchingFigures>()->most_rows);
    return -(places[2] - 2.0 * places[1] + places[0]) / (kSpan * kSpan);
  }

  /// Where it begins to slide: where g (sin - mu cos) is what it gets faster by, a little steeper
  /// than that; a little less steep it must stay.
  Result<void> slide_block(std::ostream& out) {
    constexpr double kFriction = 0.3, kSteeper = 1.05, kLess = 0.99;
    ContactCase told{"block on a slope: tangent where it begins to slide", 0.0, kFriction};
    auto stays = acceleration(kFriction, kLess, told);
    if (!stays) return std::unexpected(stays.error());
    auto slides = acceleration(kFriction, kSteeper, told);
    if (!slides) return std::unexpected(slides.error());
    const double tangent = kSteeper * kFriction;
    told.value = std::abs(*stays) > 1e-3 ? kLess * kFriction
                                         : tangent - *slides * std::hypot(1.0, tangent) / kGravity;
    add(told, out);
    return {};
  }

  /// A free block between plates without friction, up to a pressure of its own modulus.
  Result<void> press_to_modulus(std::ostream& out) {
    const double modulus = material_.youngs_modulus;
    auto curve = press_block(material_, modulus, {});
    if (!curve) return std::unexpected(curve.error());
    std::vector<double> times;
    const PressureFrame* tenth = nullptr;
    for (const PressureFrame& frame : curve->frames) {
      times.push_back(frame.took);
      if (!tenth && frame.pressure >= 0.1 * modulus) tenth = &frame;
    }
    const double median = 1e3 * quantiles(times).median;
    if (!tenth) return failure("a block between plates came to no pressure");
    add({"a block between plates, a tenth of its modulus: force (N)", tenth->force, tenth->exact,
         median},
        out);
    const PressureFrame* refused = curve->first_refused();
    add({"the same: pressure carried without a flag (kPa)",
         1e-3 * (refused ? refused->pressure : curve->frames.back().pressure), 1e-3 * modulus,
         median},
        out);
    print_pressure(*curve, out);
    return {};
  }

  /// Balls in a box, so many along each edge, until all rest or for so long. A frame: the mean
  /// until then, since those of the fall take many times as long as those of coming to rest.
  Result<void> settle_heap(int edge, std::ostream& out) {
    constexpr double kLongest = 10.0;
    constexpr int kResting = 60;
    auto world = start(ball_heap({.along = edge, .across = edge, .layers = edge}));
    if (!world) return std::unexpected(world.error());
    Trace trace(stage_names());
    const auto take = [&] {
      const Stopwatch watch;
      step_frame(**world, trace);
      return 1e3 * watch.seconds();
    };
    const auto all_rest = [&] {
      return std::ranges::all_of((*world)->all<Resting>(), &Resting::rests);
    };
    std::vector<double> settling, resting;
    while (!all_rest() && (*world)->time() < kLongest) {
      if (interrupted()) return failure(kCancelled);
      settling.push_back(take());
    }
    const double took = std::reduce(settling.begin(), settling.end());
    const double at = (*world)->time();
    const bool rested = all_rest();
    double force = 0.0, weight = 0.0;
    for (const OrganContact& contact : (*world)->all<OrganContact>())
      for (const Vec3& one : contact.solution.forces) force += one.z();
    for (const OrganBody& body : (*world)->all<OrganBody>())
      if (body.model->deformable())
        weight += kGravity * rubber().density * std::abs(volume(body.model->surface));
    for (int i = 0; rested && i < kResting; ++i) resting.push_back(take());
    resting_ms_ = rested ? quantiles(resting).median : std::numeric_limits<double>::infinity();
    const TouchingFigures& figures = *(*world)->one<TouchingFigures>();
    add({fmt::format("{} balls in a box: what carries them (N)", edge * edge * edge), force, weight,
         took / static_cast<double>(settling.size()), static_cast<int>(figures.most_rows)},
        out);
    const auto [fewest, most] = std::ranges::minmax(settling);
    out << fmt::format(
        "  {} after {:.2f} s of the scene, {:.2f} s of computing; a frame {:.1f} to {:.0f} ms, "
        "median "
        "{:.1f}; at rest {:.3f} ms; overlap at most {:.2f} mm\n",
        rested ? "at rest" : "not at rest", at, 1e-3 * took, fewest, most,
        quantiles(settling).median, resting_ms_, 1e3 * figures.greatest_overlap);
    return {};
  }

  Result<void> pull_by_jaws(std::ostream& out) {
    auto slips = bench_jaws();
    if (!slips) return std::unexpected(slips.error());
    for (const JawsSlip& slip : *slips) {
      add({slip.name, slip.value, slip.reference, slip.frame_ms, slip.rows}, out);
      jaws_begin_ = std::max(jaws_begin_, 100.0 * std::abs(slip.value / slip.reference - 1.0));
      jaws_slide_ = std::max(jaws_slide_, 100.0 * slip.farthest);
    }
    return {};
  }

  IsotropicMaterial material_;
  double jaws_begin_ = 0.0, jaws_slide_ = 0.0, resting_ms_ = 0.0;
  double give_ = 0.0, unbalanced_ = 0.0;
  std::vector<ContactCase> cases_;
  PlotSeries computed_, exact_;
};

}  // namespace

Result<void> bench_contact(const ContactBenchOptions& options, std::ostream& out) {
  if (auto sound = check_outputs({options.json}, options.plots); !sound) return sound;
  ContactBench bench;
  if (auto done = bench.run(out); !done) return done;
  print_rows_of_this_machine(bench.rows(), out);
  if (!options.plots.empty())
    if (auto drawn = write_file(options.plots / "two_balls.svg", to_svg(bench.plot())); !drawn)
      return drawn;
  return write_cases(options.json, bench.json(), bench.rows());
}

}  // namespace viscera
