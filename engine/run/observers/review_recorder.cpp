#include "engine/run/observers/review_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/features/beds/beds.h"
#include "engine/features/cautery/cautery.h"
#include "engine/features/gas/gas.h"
#include "engine/features/links/links.h"
#include "engine/features/smoke/smoke.h"
#include "engine/run/observers/tip_samples.h"
#include "engine/simulation/frame.h"
#include "engine/simulator/build.h"

namespace viscera {
namespace {

constexpr int kThumbnailWidth = 320;
/// Stages that stay below this are told in the table alone [s].
constexpr double kLeastDrawnStage = 20e-6;

std::string name_of(const World& world, Entity organ) {
  const OrganBody* body = world.find<OrganBody>(organ);
  return body ? body->name : "tissue";
}

/// The organ that an instrument presses or holds.
std::string touched_by(const World& world, std::size_t tool) {
  const InstrumentContact& contact = world.all<InstrumentContact>()[tool];
  return name_of(world, contact.grasp ? contact.grasp->organ : contact.organ);
}

Chart stage_chart(const Trace& trace, const StepRate& steps) {
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
      curve.add(steps.time_after(frame), 1e3 * duration);
  }
  return chart;
}

}  // namespace

std::vector<double> penetrations(const World& world) {
  std::vector<double> depths(world.all<InstrumentBody>().size(), 0.0);
  const Pool<OrganContact>& contacts = world.all<OrganContact>();
  for (std::size_t o = 0; o < contacts.size(); ++o) {
    const OrganContact& contact = contacts[o];
    if (contact.cells.empty() || contact.solution.forces.size() != contact.cells.size()) continue;
    for (const CellRange& range : world.find<OrganTouch>(contacts.owner(o))->ranges) {
      if (range.held) continue;
      const InstrumentBody* tool = world.find<InstrumentBody>(range.instrument);
      if (!tool) continue;
      double& depth = depths[static_cast<std::size_t>(tool - &world.all<InstrumentBody>()[0])];
      for (std::size_t k = range.begin; k < range.end; ++k)
        if (contact.solution.forces[k].dot(contact.cells[k].direction) > 0.0)
          depth = std::max(depth, contact.cells[k].depth);
    }
  }
  return depths;
}

void ReviewRecorder::Watched::comes(const World& world, std::string what) {
  detail = std::move(what);
  frame = world.frame();
  time = world.time();
  wants_picture = true;
  picture.reset();
}

std::array<ReviewRecorder::Watched*, 7> ReviewRecorder::watched() {
  Moments& m = state_.moments;
  return {&m.contact,           &m.hold,         &m.force_peak, &m.smoke,
          &m.displacement_peak, &m.first_parted, &m.last_parted};
}

ReviewRecorder::ReviewRecorder(const World& world, const SceneDescription& scene,
                               const Trace& trace, std::string film, bool pictures)
    : Observer("review", pictures ? Looks::kWanted : Looks::kNever, RunStage::kEncode),
      trace_(trace),
      steps_(scene.steps),
      film_(std::move(film)),
      curve_of_organ_(world.all<OrganBody>().size()) {
  Curves& curves = state_.curves;
  state_.greatest.assign(world.all<OrganBody>().size(), 0.0);
  state_.greatest_time.assign(world.all<OrganBody>().size(), 0.0);
  for (const InstrumentDescription& tool : scene.instruments) {
    tools_.push_back(tool.name);
    curves.force.emplace_back(tool.name);
    curves.penetration.emplace_back(tool.name);
  }
  for (std::size_t o = 0; o < world.all<OrganBody>().size(); ++o) {
    if (!world.find<OrganTouch>(world.all<OrganBody>().owner(o))) continue;
    curve_of_organ_[o] = curves.displacement.size();
    curves.displacement.emplace_back(world.all<OrganBody>()[o].name);
  }
  for (const Link& link : world.all<Link>()) curves.links.emplace_back(link.name);
  for (const Bed& bed : world.all<Bed>()) {
    curves.bed_forces.emplace_back(bed.name);
    curves.bonds_parted.emplace_back(bed.name + ", by force");
    curves.bonds_parted.emplace_back(bed.name + ", by heat");
  }
  for (std::size_t t = 0; t < world.all<BurnTrace>().size(); ++t)
    curves.power.emplace_back(
        world.find<InstrumentBody>(world.all<BurnTrace>().owner(t))->description.name);
  for (std::size_t b = 0; b < world.all<OrganBurn>().size(); ++b)
    curves.hottest.emplace_back(name_of(world, world.all<OrganBurn>().owner(b)));
  if (world.has<GasBody>()) curves.pressure.emplace_back("cavity");
}

Result<void> ReviewRecorder::open(const std::filesystem::path& folder) {
  folder_ = folder;
  return {};
}

void ReviewRecorder::add_frame(const World& world) {
  watch_contacts(world);
  watch_organs(world);
  watch_smoke(world);
  watch_heat(world);
  watch_gas(world);
  watch_beds(world);
  for (std::size_t l = 0; l < world.all<LinkState>().size(); ++l)
    state_.curves.links[l].add(world.time(), world.all<LinkState>()[l].force);
}

void ReviewRecorder::watch_contacts(const World& world) {
  Moments& moments = state_.moments;
  const std::vector<double> depths = penetrations(world);
  const std::vector<TipSample> samples = tip_samples(world);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double force = samples[i].force.norm();
    state_.curves.force[i].add(world.time(), force);
    state_.curves.penetration[i].add(world.time(), 1e3 * depths[i]);
    if (moments.contact.frame == 0 && force > 0.0)
      moments.contact.comes(world, fmt::format("{} on {}", tools_[i], touched_by(world, i)));
    if (moments.hold.frame == 0 && world.all<InstrumentContact>()[i].grasp)
      moments.hold.comes(world, fmt::format("{} on {}", tools_[i], touched_by(world, i)));
    if (force > moments.force_peak.greatest) {
      moments.force_peak.greatest = force;
      moments.force_peak.comes(world, fmt::format("{}, {:.2g} N", tools_[i], force));
    }
  }
}

void ReviewRecorder::watch_organs(const World& world) {
  Watched& peak = state_.moments.displacement_peak;
  for (std::size_t o = 0; o < state_.greatest.size(); ++o) {
    const double moved = world.all<OrganState>()[o].greatest_displacement;
    if (curve_of_organ_[o])
      state_.curves.displacement[*curve_of_organ_[o]].add(world.time(), 1e3 * moved);
    if (moved <= state_.greatest[o]) continue;
    state_.greatest[o] = moved;
    state_.greatest_time[o] = world.time();
    if (moved <= peak.greatest) continue;
    peak.greatest = moved;
    peak.comes(world, fmt::format("{}, {:.3g} mm", world.all<OrganBody>()[o].name, 1e3 * moved));
  }
}

void ReviewRecorder::watch_smoke(const World& world) {
  if (state_.moments.smoke.frame > 0) return;
  const Pool<SmokeSource>& sources = world.all<SmokeSource>();
  for (std::size_t s = 0; s < sources.size(); ++s) {
    if (world.find<SmokeBody>(sources.owner(s))->volume.particles().size() == 0) continue;
    state_.moments.smoke.comes(world, sources[s].description.name);
    return;
  }
}

void ReviewRecorder::watch_heat(const World& world) {
  for (std::size_t t = 0; t < world.all<BurnTrace>().size(); ++t)
    state_.curves.power[t].add(world.time(), world.all<BurnTrace>()[t].current.power);
  for (std::size_t b = 0; b < world.all<OrganBurn>().size(); ++b) {
    const Bioheat& heat = world.all<OrganBurn>()[b].heat;
    state_.curves.hottest[b].add(world.time(),
                                 heat.options().body - kZeroCelsius + heat.excess_now());
  }
}

void ReviewRecorder::watch_gas(const World& world) {
  if (const GasBody* gas = world.one<GasBody>())
    state_.curves.pressure[0].add(world.time(),
                                  gas->cavity.pressure() / kPascalPerMillimetreOfMercury);
}

void ReviewRecorder::watch_beds(const World& world) {
  const std::vector<BedFigures> figures = bed_figures(world);
  Moments& moments = state_.moments;
  for (std::size_t b = 0; b < figures.size(); ++b) {
    const BedFigures& bed = figures[b];
    state_.curves.bed_forces[b].add(world.time(), bed.force);
    state_.curves.bonds_parted[2 * b].add(world.time(), static_cast<double>(bed.by_force));
    state_.curves.bonds_parted[2 * b + 1].add(world.time(), static_cast<double>(bed.by_heat));
    if (moments.first_parted.frame == 0 && bed.whole < bed.bonds)
      moments.first_parted.comes(world, fmt::format("{}, by {}", bed.name,
                                                    bed.by_heat > 0  ? "heat"
                                                    : bed.by_cut > 0 ? "a cut"
                                                                     : "force"));
    if (moments.last_parted.frame == 0 && bed.whole == 0)
      moments.last_parted.comes(
          world, fmt::format("{}: {} bonds by force, {} by heat, {} by cuts", bed.name,
                             bed.by_force, bed.by_heat, bed.by_cut));
  }
}

Result<void> ReviewRecorder::add_picture(FrameViews& views) {
  const auto shot = views.shot();
  if (!shot) return std::unexpected(shot.error());
  take(views.world(), shot->picture);
  return {};
}

void ReviewRecorder::take(const World& world, const Picture& picture) {
  std::optional<Thumbnail> small;
  for (Watched* moment : watched()) {
    if (!std::exchange(moment->wants_picture, false)) continue;
    // Where pictures are far apart, this one shows something else.
    if (world.frame() - moment->frame >= steps_a_picture(steps_)) continue;
    if (!small) small = thumbnail(picture.rgb, picture.width, picture.height, kThumbnailWidth);
    moment->picture = small;
  }
}

void ReviewRecorder::describe(const World& world, RunReport& report) const {
  Json organs = Json::array();
  for (std::size_t o = 0; o < state_.greatest.size(); ++o)
    organs.push_back({{"name", world.all<OrganBody>()[o].name},
                      {"greatest_displacement_m", state_.greatest[o]},
                      {"greatest_displacement_time_s", state_.greatest_time[o]}});
  report.sections.push_back(report_section("organs", organs));
}

Result<Review> ReviewRecorder::review(const RunReport& report) const {
  Review review;
  review.report = report;
  if (report.pictures > 0) review.film = film_;
  review.pictures_per_second = static_cast<double>(kPicturesPerSecond);
  const Curves& curves = state_.curves;
  review.charts = {
      {.title = "Force on the instruments", .unit = "N", .curves = curves.force, .note = ""},
      {.title = "Penetration of the tips",
       .unit = "mm",
       .curves = curves.penetration,
       .note = "how deep each tip is in the tissue's shape at rest, where it presses"},
      {.title = "Greatest displacement",
       .unit = "mm",
       .curves = curves.displacement,
       .note = "of each organ that instruments can reach"}};
  const auto add_if_any = [&](const char* title, const char* unit, const std::vector<Curve>& some,
                              const char* note) {
    if (!some.empty())
      review.charts.push_back({.title = title, .unit = unit, .curves = some, .note = note});
  };
  add_if_any("Force of the links", "N", curves.links, "");
  add_if_any("Force of the beds", "N", curves.bed_forces, "of all their bonds together");
  add_if_any("Bonds parted", "bonds", curves.bonds_parted, "of the beds, so far");
  add_if_any("Power into tissue", "W", curves.power, "that it heats");
  add_if_any("Hottest tissue", "°C", curves.hottest, "");
  add_if_any("Pressure of the cavity", "mmHg", curves.pressure, "over atmosphere");
  review.charts.push_back(stage_chart(trace_, steps_));
  const Moments& moments = state_.moments;
  const std::array<std::pair<const char*, const Watched*>, 7> titled = {{
      {"First contact", &moments.contact},
      {"Jaws first hold tissue", &moments.hold},
      {"Peak force", &moments.force_peak},
      {"First smoke", &moments.smoke},
      {"Greatest displacement", &moments.displacement_peak},
      {"A first bond parts", &moments.first_parted},
      {"A bed is parted whole", &moments.last_parted},
  }};
  for (const auto& [title, watched] : titled) {
    if (watched->frame == 0) continue;
    Moment moment{title, watched->detail, watched->time, ""};
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

Result<void> ReviewRecorder::present(const RunReport& report) {
  auto page = review(report);
  if (!page) return std::unexpected(page.error());
  return write_review(folder_ / "review.html", *page);
}

Result<void> ReviewRecorder::save_state(ByteWriter& writer) {
  return save_whole(writer, state_);
}

Result<void> ReviewRecorder::load_state(ByteReader& reader) {
  State loaded;
  if (auto whole = load_whole(reader, loaded); !whole) return whole;
  bool fits = loaded.greatest.size() == state_.greatest.size() &&
              loaded.greatest_time.size() == state_.greatest_time.size();
  std::apply(
      [&](const auto&... curves) {
        ((fits = fits &&
                 (loaded.curves.*curves.member).size() == (state_.curves.*curves.member).size()),
         ...);
      },
      Curves::fields());
  if (!fits) return failure("expected curves of this scene");
  state_ = std::move(loaded);
  return {};
}

}  // namespace viscera
