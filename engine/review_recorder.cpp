#include "engine/review_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "engine/frame.h"
#include "engine/run.h"
#include "engine/stages.h"

namespace viscera {
namespace {

constexpr int kThumbnailWidth = 320;
/// Stages that stay below this are told in the table alone [s].
constexpr double kLeastDrawnStage = 20e-6;

std::string name_of(const World& world, Entity organ) {
  const OrganBody* body = world.organ_bodies.find(organ);
  return body ? body->name : "tissue";
}

/// The organ that an instrument presses or holds.
std::string touched_by(const World& world, std::size_t tool) {
  const InstrumentContact& contact = world.instrument_contacts[tool];
  return name_of(world, contact.grasp ? contact.grasp->organ : contact.organ);
}

Chart stage_chart(const Trace& trace) {
  Chart chart{.title = "Time per stage",
              .unit = "ms",
              .curves = {},
              .logarithmic = true,
              .note = "of each frame, on a logarithmic axis; stages under " +
                      fmt::format("{:g} µs stand in the table alone", 1e6 * kLeastDrawnStage)};
  for (std::size_t stage = 0; stage < trace.stages().size(); ++stage) {
    const auto index = static_cast<std::int32_t>(stage);
    if (trace.durations(index).p99 < kLeastDrawnStage) continue;
    std::map<std::uint32_t, double> of_frame;  // [s]
    for (const Trace::Event& event : trace.events())
      if (event.stage == index) of_frame[event.frame] += 1e-9 * static_cast<double>(event.duration);
    Curve& curve = chart.curves.emplace_back(trace.stages()[stage]);
    for (const auto& [frame, duration] : of_frame)
      curve.add(static_cast<double>(frame) / static_cast<double>(kFramesPerSecond), 1e3 * duration);
  }
  return chart;
}

}  // namespace

std::vector<double> penetrations(const World& world) {
  std::vector<double> depths(world.instrument_bodies.size(), 0.0);
  for (const OrganContact& contact : world.organ_contacts) {
    if (contact.cells.empty() || contact.solution.forces.size() != contact.cells.size()) continue;
    for (const CellRange& range : contact.ranges) {
      if (range.held) continue;
      const InstrumentBody* tool = world.instrument_bodies.find(range.instrument);
      if (!tool) continue;
      double& depth = depths[static_cast<std::size_t>(tool - &world.instrument_bodies[0])];
      for (std::size_t k = range.begin; k < range.end; ++k)
        if (contact.solution.forces[k].dot(contact.cells[k].direction) > 0.0)
          depth = std::max(depth, contact.cells[k].depth);
    }
  }
  return depths;
}

void ReviewRecorder::Watched::comes(const World& world, std::string what) {
  detail = std::move(what);
  frame = world.frame;
  time = world.time();
  wants_picture = true;
  picture.reset();
}

ReviewRecorder::ReviewRecorder(const World& world, const SceneDescription& scene)
    : force_{.title = "Force on the instruments", .unit = "N", .curves = {}, .note = ""},
      penetration_{.title = "Penetration of the tips",
                   .unit = "mm",
                   .curves = {},
                   .note = "how deep each tip is in the tissue's shape at rest, where it presses"},
      displacement_{.title = "Greatest displacement",
                    .unit = "mm",
                    .curves = {},
                    .note = "of each organ that instruments can reach"},
      links_{.title = "Force of the links", .unit = "N", .curves = {}, .note = ""},
      power_{.title = "Power into tissue", .unit = "W", .curves = {}, .note = "that it heats"},
      hottest_{.title = "Hottest tissue", .unit = "°C", .curves = {}, .note = ""},
      curve_of_organ_(world.organ_bodies.size()),
      greatest_(world.organ_bodies.size(), 0.0),
      greatest_time_(world.organ_bodies.size(), 0.0) {
  for (const InstrumentDescription& tool : scene.instruments) {
    tools_.push_back(tool.name);
    force_.curves.emplace_back(tool.name);
    penetration_.curves.emplace_back(tool.name);
  }
  for (std::size_t o = 0; o < world.organ_bodies.size(); ++o) {
    if (!world.organ_bodies[o].model->touchable_anywhere()) continue;
    curve_of_organ_[o] = displacement_.curves.size();
    displacement_.curves.emplace_back(world.organ_bodies[o].name);
  }
  for (const Link& link : world.links) links_.curves.emplace_back(link.name);
  for (std::size_t t = 0; t < world.burn_traces.size(); ++t)
    power_.curves.emplace_back(
        world.instrument_bodies.find(world.burn_traces.owner(t))->description.name);
  for (std::size_t b = 0; b < world.organ_burns.size(); ++b)
    hottest_.curves.emplace_back(name_of(world, world.organ_burns.owner(b)));
}

void ReviewRecorder::add_frame(const World& world, std::span<const TipSample> samples) {
  watch_contacts(world, samples);
  watch_organs(world);
  watch_smoke(world);
  watch_heat(world);
  for (std::size_t l = 0; l < world.links.size(); ++l)
    links_.curves[l].add(world.time(), world.links[l].force);
}

void ReviewRecorder::watch_contacts(const World& world, std::span<const TipSample> samples) {
  const std::vector<double> depths = penetrations(world);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double force = samples[i].force.norm();
    force_.curves[i].add(world.time(), force);
    penetration_.curves[i].add(world.time(), 1e3 * depths[i]);
    if (contact_.frame == 0 && force > 0.0)
      contact_.comes(world, fmt::format("{} on {}", tools_[i], touched_by(world, i)));
    if (hold_.frame == 0 && world.instrument_contacts[i].grasp)
      hold_.comes(world, fmt::format("{} on {}", tools_[i], touched_by(world, i)));
    if (force > force_peak_.greatest) {
      force_peak_.greatest = force;
      force_peak_.comes(world, fmt::format("{}, {:.2g} N", tools_[i], force));
    }
  }
}

void ReviewRecorder::watch_organs(const World& world) {
  for (std::size_t o = 0; o < greatest_.size(); ++o) {
    const double moved = world.organ_states[o].greatest_displacement;
    if (curve_of_organ_[o])
      displacement_.curves[*curve_of_organ_[o]].add(world.time(), 1e3 * moved);
    if (moved <= greatest_[o]) continue;
    greatest_[o] = moved;
    greatest_time_[o] = world.time();
    if (moved <= displacement_peak_.greatest) continue;
    displacement_peak_.greatest = moved;
    displacement_peak_.comes(world,
                             fmt::format("{}, {:.3g} mm", world.organ_bodies[o].name, 1e3 * moved));
  }
}

void ReviewRecorder::watch_smoke(const World& world) {
  if (smoke_.frame > 0) return;
  for (const SmokeBody& smoke : world.smoke) {
    if (smoke.volume.particles().size() == 0) continue;
    smoke_.comes(world, smoke.description.name);
    return;
  }
}

void ReviewRecorder::watch_heat(const World& world) {
  for (std::size_t t = 0; t < world.burn_traces.size(); ++t)
    power_.curves[t].add(world.time(), world.burn_traces[t].current.power);
  for (std::size_t b = 0; b < world.organ_burns.size(); ++b) {
    const Bioheat& heat = world.organ_burns[b].heat;
    hottest_.curves[b].add(world.time(), heat.options().body - kZeroCelsius + heat.excess_now());
  }
}

void ReviewRecorder::add_picture(const World& world, const Picture& picture) {
  std::optional<Thumbnail> small;
  for (Watched* moment : {&contact_, &hold_, &force_peak_, &smoke_, &displacement_peak_}) {
    if (!std::exchange(moment->wants_picture, false)) continue;
    // Where pictures are far apart, this one shows something else.
    if (world.frame - moment->frame >= kFramesPerPicture) continue;
    if (!small) small = thumbnail(picture.rgb, picture.width, picture.height, kThumbnailWidth);
    moment->picture = small;
  }
}

void ReviewRecorder::describe(RunReport& report) const {
  for (std::size_t o = 0; o < report.organs.size() && o < greatest_.size(); ++o) {
    report.organs[o].greatest_displacement = greatest_[o];
    report.organs[o].greatest_displacement_time = greatest_time_[o];
  }
}

Result<Review> ReviewRecorder::finish(const Trace& trace, const RunReport& report,
                                      const std::string& film) const {
  Review review;
  review.report = report;
  review.film = film;
  review.pictures_per_second =
      static_cast<double>(kFramesPerSecond) / static_cast<double>(kFramesPerPicture);
  review.charts = {force_, penetration_, displacement_};
  for (const Chart* chart : {&links_, &power_, &hottest_})
    if (!chart->curves.empty()) review.charts.push_back(*chart);
  review.charts.push_back(stage_chart(trace));
  for (const Watched* watched : {&contact_, &hold_, &force_peak_, &smoke_, &displacement_peak_}) {
    if (watched->frame == 0) continue;
    Moment moment{watched->title, watched->detail, watched->time, ""};
    if (watched->picture) {
      auto uri = data_uri(*watched->picture);
      if (!uri) return std::unexpected(uri.error());
      moment.picture = std::move(*uri);
    }
    review.moments.push_back(std::move(moment));
  }
  std::stable_sort(review.moments.begin(), review.moments.end(),
                   [](const Moment& a, const Moment& b) { return a.time < b.time; });
  return review;
}

}  // namespace viscera
