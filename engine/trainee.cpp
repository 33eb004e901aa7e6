#include "engine/trainee.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

/// Slower than this a tip rests [m/s].
constexpr double kRests = 1e-5;

/// How an organ's elasticity has followed what heat did to it.
std::optional<TissueReport::Stiffening> stiffening_of(const World& world, Entity organ) {
  const OrganChange* change = world.organ_changes.find(organ);
  if (!change || !change->update) return std::nullopt;
  return TissueReport::Stiffening{.greatest_factor = change->update->greatest_stiffness,
                                  .stiffened = change->stiffened,
                                  .left_out = change->left_out,
                                  .greatest_shrinkage = change->update->greatest_shift,
                                  .updates = change->updates,
                                  .nodes = change->update->nodes,
                                  .rank = change->update->rank};
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
    : tips_(world.instrument_states.size()),
      forces_(world.organ_bodies.size()),
      time_(world.time()) {
  for (std::size_t i = 0; i < tips_.size(); ++i)
    tips_[i].add(world.time(), world.instrument_bodies[i].tip.at(world.time()));
  for (const OrganDescription& organ : scene.organs) spared_.push_back(organ.spared);
}

void Trainee::add_frame(const World& world) {
  const double dt = world.time() - time_;
  time_ = world.time();
  for (std::size_t i = 0; i < tips_.size(); ++i)
    tips_[i].add(world.time(), world.instrument_states[i].tip);
  for (std::size_t o = 0; o < forces_.size(); ++o) {
    const OrganContact* contact = world.organ_contacts.find(world.organ_bodies.owner(o));
    if (!contact) continue;
    double force = 0.0;
    for (const CellRange& range : contact->ranges) force += range.force.norm();
    if (force <= 0.0) continue;
    forces_[o].peak = std::max(forces_[o].peak, force);
    forces_[o].impulse += force * dt;
    forces_[o].touched += dt;
  }
  bool idle = false;
  for (const BurnTrace& trace : world.burn_traces) {
    idle = idle || trace.current.open;
    far_ += trace.current.far_power * dt;
    sparks_ += trace.current.spark_power * dt;
  }
  if (idle) idle_current_ += dt;
}

void Trainee::describe(const World& world, RunReport& report) const {
  TraineeReport& trainee = report.trainee;
  CauteryReport cautery;
  double residual = 0.0;
  for (std::size_t b = 0; b < world.organ_burns.size(); ++b) {
    const Bioheat& heat = world.organ_burns[b].heat;
    const OrganBody& body = *world.organ_bodies.find(world.organ_burns.owner(b));
    const HeatBook book = heat.book();
    cautery.delivered += book.delivered;
    cautery.metabolic += book.metabolic;
    cautery.stored += book.stored;
    cautery.latent += book.latent;
    cautery.perfused += book.perfused;
    cautery.lost += book.vapour + book.pyrolysis + book.gas + book.instrument + book.boundary;
    residual += book.residual();
    const double greatest = heat.options().body + heat.greatest_excess();
    const double coagulated = heat.harmed_volume();
    report.tissue.push_back({.organ = body.name,
                             .vaporised = heat.vaporised_water() + heat.vaporised_tissue(),
                             .smoke = world.organ_burns[b].smoke,
                             .above_60 = world.organ_burns[b].greatest_hot,
                             .coagulated = coagulated,
                             .greatest_temperature = greatest,
                             .stiffening = stiffening_of(world, world.organ_burns.owner(b))});
    trainee.greatest_temperature = std::max(trainee.greatest_temperature.value_or(0.0), greatest);
    const auto organ = static_cast<std::size_t>(&body - &world.organ_bodies[0]);
    if (spared_[organ] && coagulated > 0.0) trainee.spared_burns.push_back({body.name, coagulated});
  }
  if (world.burn_traces.size() > 0) {
    for (const BurnTrace& trace : world.burn_traces) cautery.generated += trace.generated;
    cautery.body = far_;
    cautery.sparks = sparks_;
    cautery.residual = cautery.delivered > 0.0 ? residual / cautery.delivered : 0.0;
    report.cautery = cautery;
  }
  trainee.energy = cautery.delivered;
  trainee.idle_current = idle_current_;
  for (std::size_t o = 0; o < forces_.size(); ++o)
    if (forces_[o].touched > 0.0)
      trainee.organs.push_back({.name = world.organ_bodies[o].name,
                                .peak_force = forces_[o].peak,
                                .mean_force = forces_[o].impulse / forces_[o].touched,
                                .touched = forces_[o].touched});
  for (std::size_t i = 0; i < tips_.size(); ++i)
    trainee.tips.push_back({.name = world.instrument_bodies[i].description.name,
                            .path = tips_[i].path(),
                            .smoothness = tips_[i].smoothness()});
  if (report.smoke.time_in_smoke)
    trainee.time_in_smoke = *report.smoke.time_in_smoke * report.duration_s;
}

}  // namespace viscera
