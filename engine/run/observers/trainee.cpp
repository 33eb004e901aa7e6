#include "engine/run/observers/trainee.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/features/beds/beds.h"
#include "engine/features/cautery/cautery.h"
#include "engine/features/clips/clips.h"
#include "engine/features/parting/perforations.h"
#include "engine/features/shafts/shafts.h"

namespace viscera {
namespace {

/// Slower than this a tip rests [m/s].
constexpr double kRests = 1e-5;

Json optional_json(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

Json json_of(const TraineeFigures& trainee) {
  Json perforated = Json::array();
  for (const TraineeFigures::Perforated& one : trainee.perforated)
    perforated.push_back({{"organ", one.organ}, {"perforations", one.places}});
  Json ducts = Json::array();
  for (const TraineeFigures::OpenDuct& one : trainee.open_ducts)
    ducts.push_back({{"organ", one.organ}, {"duct", one.duct}});
  Json spared = Json::array(), torn = Json::array(), organs = Json::array(), tips = Json::array();
  for (const auto& bed : trainee.torn_beds)
    torn.push_back({{"bed", bed.bed}, {"bonds", bed.bonds}, {"area_m2", bed.area}});
  for (const TraineeFigures::SparedBurn& burn : trainee.spared_burns)
    spared.push_back({{"organ", burn.organ},
                      {"volume_coagulated_m3", burn.coagulated},
                      {"volume_dead_m3", burn.dead}});
  for (const TraineeFigures::Organ& organ : trainee.organs)
    organs.push_back({{"name", organ.name},
                      {"peak_force_N", organ.peak_force},
                      {"mean_force_N", organ.mean_force},
                      {"touched_s", organ.touched}});
  for (const TraineeFigures::Tip& tip : trainee.tips)
    tips.push_back({{"name", tip.name},
                    {"path_length_m", tip.path},
                    {"smoothness", optional_json(tip.smoothness)}});
  return {{"energy_delivered_J", trainee.energy},
          {"current_without_contact_s", trainee.idle_current},
          {"greatest_temperature_K", optional_json(trainee.greatest_temperature)},
          {"spared_organs_burnt", spared},
          {"organs_perforated", perforated},
          {"ducts_open", ducts},
          {"beds_torn", torn},
          {"organs", organs},
          {"tips", tips},
          {"time_in_smoke_s", nullptr}};  // for whoever looks through the smoke
}

}  // namespace

void Motion::add(double time, const Vec3& at) {
  if (count_ > 0 && time <= last_[3].time) return;
  std::rotate(last_.begin(), last_.begin() + 1, last_.end());
  last_[3] = {time, at};
  ++count_;
  if (count_ < 2) {
    begun_ = time;
    return;
  }
  const double dt = last_[3].time - last_[2].time;
  const double way = (last_[3].at - last_[2].at).norm();
  path_ += way;
  if (way > kRests * dt) {
    fastest_ = std::max(fastest_, way / dt);
    moved_ = time;
  } else if (moved_ == 0.0) {
    begun_ = time;
  }
  if (count_ < 4) return;
  // Samples needn't be evenly apart: six times the divided difference is the third derivative.
  std::array<Vec3, 4> d;
  for (std::size_t i = 0; i < 4; ++i) d[i] = last_[i].at;
  for (std::size_t order = 1; order < 4; ++order)
    for (std::size_t i = 0; i + order < 4; ++i)
      d[i] = (d[i + 1] - d[i]) / (last_[i + order].time - last_[i].time);
  jerk_squares_ += 36.0 * d[0].squaredNorm() * dt;
}

std::optional<double> Motion::smoothness() const {
  const double span = moved_ - begun_;
  if (count_ < 4 || fastest_ <= 0.0 || span <= 0.0) return {};
  const double jerk = jerk_squares_ * span * span * span / (fastest_ * fastest_);
  return jerk > 0.0 ? std::optional(-std::log(jerk)) : std::nullopt;
}

Trainee::Trainee(const World& world, const SceneDescription& scene)
    : Observer("trainee"),
      state_{.tips = std::vector<Motion>(world.all<InstrumentState>().size()),
             .forces = std::vector<Force>(world.all<OrganBody>().size()),
             .time = world.time()} {
  for (std::size_t i = 0; i < state_.tips.size(); ++i)
    state_.tips[i].add(world.time(), world.all<InstrumentBody>()[i].tip.at(world.time()));
  for (const OrganDescription& organ : scene.organs) spared_.push_back(is_spared(organ));
}

void Trainee::add_frame(const World& world) {
  const double dt = world.time() - state_.time;
  state_.time = world.time();
  for (std::size_t i = 0; i < state_.tips.size(); ++i)
    state_.tips[i].add(world.time(), world.all<InstrumentState>()[i].tip);
  for (std::size_t o = 0; o < state_.forces.size(); ++o) {
    const OrganTouch* touch = world.find<OrganTouch>(world.all<OrganBody>().owner(o));
    if (!touch) continue;
    double force = 0.0;
    for (const CellRange& range : touch->ranges) force += range.felt.norm();
    force += force_of_shafts(world, world.all<OrganBody>().owner(o));
    if (force <= 0.0) continue;
    state_.forces[o].peak = std::max(state_.forces[o].peak, force);
    state_.forces[o].impulse += force * dt;
    state_.forces[o].touched += dt;
  }
  bool idle = false;
  for (const BurnTrace& trace : world.all<BurnTrace>()) {
    idle = idle || trace.current.open;
  }
  if (idle) state_.idle_current += dt;
}

TraineeFigures Trainee::figures(const World& world) const {
  TraineeFigures figures;
  figures.idle_current = state_.idle_current;
  if (const auto cautery = cautery_figures(world)) figures.energy = cautery->delivered;
  for (const BurnFigures& burn : burn_figures(world)) {
    const OrganBody& body = *world.find<OrganBody>(burn.organ);
    figures.greatest_temperature =
        std::max(figures.greatest_temperature.value_or(0.0), burn.greatest_temperature);
    const auto organ = static_cast<std::size_t>(&body - &world.all<OrganBody>()[0]);
    if (spared_[organ] && burn.dead > 0.0)
      figures.spared_burns.push_back({body.name, burn.coagulated, burn.dead});
  }
  for (const WallFigures& wall : wall_figures(world))
    if (wall.perforations > 0)
      figures.perforated.push_back({world.find<OrganBody>(wall.organ)->name, wall.perforations});
  for (const DuctFigures& duct : duct_figures(world))
    if (duct.open)
      figures.open_ducts.push_back({world.find<OrganBody>(duct.organ)->name, duct.name});
  for (const BedFigures& bed : bed_figures(world))
    if (bed.by_force > 0) figures.torn_beds.push_back({bed.name, bed.by_force, bed.torn});
  for (std::size_t o = 0; o < state_.forces.size(); ++o)
    if (state_.forces[o].touched > 0.0)
      figures.organs.push_back({.name = world.all<OrganBody>()[o].name,
                                .peak_force = state_.forces[o].peak,
                                .mean_force = state_.forces[o].impulse / state_.forces[o].touched,
                                .touched = state_.forces[o].touched});
  for (std::size_t i = 0; i < state_.tips.size(); ++i)
    figures.tips.push_back({.name = world.all<InstrumentBody>()[i].description.name,
                            .path = state_.tips[i].path(),
                            .smoothness = state_.tips[i].smoothness()});
  return figures;
}

void Trainee::describe(const World& world, RunReport& report) const {
  report.sections.push_back(report_section("trainee", json_of(figures(world))));
}

Result<void> Trainee::save_state(ByteWriter& writer) {
  return save_whole(writer, state_);
}

Result<void> Trainee::load_state(ByteReader& reader) {
  const std::size_t tips = state_.tips.size(), organs = state_.forces.size();
  if (auto whole = load_whole(reader, state_); !whole) return whole;
  if (state_.tips.size() != tips || state_.forces.size() != organs)
    return failure("expected the scene's instruments and organs");
  return {};
}

}  // namespace viscera
