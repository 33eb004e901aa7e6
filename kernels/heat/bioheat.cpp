#include "kernels/heat/bioheat.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace viscera {
namespace {

/// Of the explicit bound: the rates that it follows from change during the step.
constexpr double kSafety = 0.9;
/// From so many explicit substeps on a super step may be the cheaper one.
constexpr int kFewSubsteps = 3;
/// Steps that a brick stays after it was last warm: a pulsed or moving source would make it anew.
constexpr int kPatience = 30;

BioheatNumbers numbers_of(const ThermalTissue& tissue, const BioheatOptions& options) {
  const auto f = [](double value) { return static_cast<float>(value); };
  const double water = tissue.density * tissue.water_fraction * water::kSpecificHeat;
  BioheatNumbers n;
  n.dry_conductivity = f(tissue.dry_conductivity);
  n.wet_conductivity = f(tissue.conductivity);
  n.conductivity_slope = f(tissue.conductivity_slope);
  n.boiling = f(water::kBoiling - options.body);
  n.solids_capacity = f(tissue.density * tissue.specific_heat - water);
  n.water_capacity = f(water);
  n.lost_solids = f(1.0 - tissue.char_share);
  n.drain = f(tissue.perfusion * water::kBloodDensity * water::kBloodHeat -
              tissue.metabolic_heat * tissue.metabolic_slope);
  n.inverse_square = f(1.0 / (options.voxel * options.voxel));
  n.coagulation_exponent = f(std::log(std::max(tissue.coagulation.frequency, 1e-300)));
  n.coagulation_kelvin = f(tissue.coagulation.energy / kGasConstant);
  n.collagen_exponent = f(std::log(std::max(tissue.collagen.frequency, 1e-300)));
  n.collagen_kelvin = f(tissue.collagen.energy / kGasConstant);
  n.body = f(options.body);
  n.voxel = f(options.voxel);
  n.followed = f(options.followed);
  return n;
}

}  // namespace

Bioheat::Bioheat(const ThermalTissue& tissue, const BioheatOptions& options,
                 SignedDistance distance)
    : tissue_(tissue),
      options_(options),
      numbers_(numbers_of(tissue, options)),
      state_(std::make_shared<State>()),
      bricks_(options.voxel, std::move(distance), options.most_bricks,
              std::shared_ptr<HeatBricks::State>(state_, &state_->bricks)) {}

const Bioheat::State& Bioheat::state() const {
  assert(current_ && "fetch() comes before");
  return *state_;
}

void Bioheat::restore(State state) {
  bricks_.restore(std::move(state.bricks));
  state_->vapour = std::move(state.vapour);
  state_->totals = state.totals;
  state_->stored_at_start = state.stored_at_start;
  state_->version = state.version;
  state_->passes = state.passes;
  fetched_ = state_->totals;
  current_ = true;
  list_warm();
}

bool Bioheat::fits(const State& state) const {
  const auto is_sound = [](const Vapour& one) {
    return one.position.allFinite() && std::isfinite(one.water) && std::isfinite(one.tissue) &&
           std::isfinite(one.temperature);
  };
  const HeatBook& book = state.totals.book;
  return bricks_.fits(state.bricks) && std::ranges::all_of(state.vapour, is_sound) &&
         std::isfinite(book.residual()) && std::isfinite(state.totals.greatest) &&
         std::isfinite(state.totals.water_lost) && std::isfinite(state.totals.tissue_lost) &&
         std::isfinite(state.stored_at_start) && state.passes >= 0;
}

void Bioheat::heat_voxel(HeatBrick& brick, int voxel, double power) {
  if (brick.geometry->fraction[voxel] <= 0.0f) return;
  brick.warm->source[voxel] += static_cast<float>(power / voxel_volume());
  brick.warm->heated = true;
}

double Bioheat::voxel_capacity(const HeatBrick& brick, int voxel) const {
  return brick.geometry->fraction[voxel] * voxel_volume() *
         heat_capacity(tissue_, brick.water[voxel], brick.charred[voxel]);
}

void Bioheat::draw_from_voxel(HeatBrick& brick, int voxel, double energy) {
  assert(current_ && "fetch() comes before");
  brick.warm->excess[voxel] -= static_cast<float>(energy / voxel_capacity(brick, voxel));
  brick.warm->altered = true;
  state_->totals.book.instrument += energy;
}

void Bioheat::take_shapes(std::vector<ShapedBrick> shapes) {
  fetch();
  const double before = stored();
  for (HeatBrick* brick : bricks_.take_shapes(std::move(shapes))) {
    if (!brick->warm) continue;
    for (std::size_t v = 0; v < BrickField::kVoxels; ++v)
      if (brick->geometry->fraction[v] <= 0.0f) brick->warm->excess[v] = 0.0f;
    brick->warm->slot = -1;  // a device has to take its geometry, too
  }
  state_->totals.book.removed += before - stored();
  ++state_->version;
}

void Bioheat::compute_on(std::shared_ptr<HeatPasses> passes, HeatReturn fields) {
  fetch();
  forget_device();
  device_ = std::move(passes);
  device_failure_.clear();
  return_ = fields;
}

void Bioheat::forget_device() {
  device_.reset();
  for (std::size_t i = 0; i < bricks_.count(); ++i)
    if (bricks_.brick(i).warm) bricks_.brick(i).warm->slot = -1;
}

void Bioheat::fetch() {
  if (current_) return;
  list_warm();
  if (!device_->fetch(warm_)) {
    device_failure_ = device_->trouble();
    forget_device();
    state_->totals = fetched_;
  }
  current_ = true;
  fetched_ = state_->totals;
}

void Bioheat::list_warm() {
  warm_.clear();
  for (std::size_t i = 0; i < bricks_.count(); ++i)
    if (bricks_.brick(i).warm) warm_.push_back(&bricks_.brick(i));
}

void Bioheat::step(double dt) {
  list_warm();
  state_->vapour.clear();
  state_->passes = 0;
  if (warm_.empty() || !(dt > 0.0)) return;
  if (current_) fetched_ = state_->totals;
  if (!take_step(dt)) {
    device_failure_ = device_->trouble();
    forget_device();
    state_->totals = fetched_;
    current_ = true;
    state_->passes = 0;
    take_step(dt);
  }
  book_step();
  ++state_->version;
  follow_heat();
  let_go();
  list_warm();
}

/// False: the device failed.
bool Bioheat::take_step(double dt) {
  if (!passes().start(warm_, {&numbers_, &tissue_, &options_.cooling})) return false;
  double source = 0.0;
  double left = dt;
  while (left > 0.0) {
    const HeatFlows now = passes().prepare();
    ++state_->passes;
    if (!passes().trouble().empty()) return false;
    if (left == dt) source = now.source;
    // A voxel that takes all of its neighbours' mean within a step just doesn't overshoot.
    const double ratio = left * now.fastest / kSafety;
    const int substeps = std::max(1, static_cast<int>(std::ceil(ratio)));
    const int stages = super_stages(ratio);
    const bool super =
        options_.scheme == HeatScheme::kSuper ||
        (options_.scheme == HeatScheme::kFewest && substeps >= kFewSubsteps && stages < substeps);
    const double sub = super ? left : left / substeps;
    if (!super)
      advance(now, sub);
    else if (!super_step(now, sub, std::max(3, stages)))
      return false;
    passes().settle(sub);
    left = super || substeps == 1 ? 0.0 : left - sub;
  }
  const bool fields = !device_ || return_ == HeatReturn::kEveryStep;
  if (!passes().finish(fields)) return false;
  current_ = fields;
  state_->totals.book.delivered += source * voxel_volume() * dt;
  return true;
}

/// Of flows over time: [K s], [J/m].
void Bioheat::book_flows(double living, double boundary) {
  const double volume = voxel_volume();
  state_->totals.book.perfused +=
      volume * living * tissue_.perfusion * water::kBloodDensity * water::kBloodHeat;
  state_->totals.book.metabolic +=
      volume * living * tissue_.metabolic_heat * tissue_.metabolic_slope;
  state_->totals.book.boundary += options_.voxel * boundary;
}

void Bioheat::advance(const HeatFlows& now, double dt) {
  book_flows(dt * now.living, dt * now.boundary);
  passes().advance(dt);
}

// What flows out over a super step follows the same recursion as the temperature that it flows
// from.
bool Bioheat::super_step(const HeatFlows& first, double dt, int stages) {
  HeatFlows now = first, newest, older;
  for (int j = 1; j <= stages; ++j) {
    const SuperStage s = super_stage(j, stages);
    if (j > 1) {
      now = passes().rates();
      ++state_->passes;
      if (!passes().trouble().empty()) return false;
    }
    const auto next = [&](double HeatFlows::*flow) {
      return s.newest * newest.*flow + s.older * older.*flow + dt * s.slope * now.*flow +
             dt * s.first_slope * first.*flow;
    };
    const HeatFlows sum{.living = next(&HeatFlows::living), .boundary = next(&HeatFlows::boundary)};
    older = newest;
    newest = sum;
    passes().advance_stage(s, j, dt);
  }
  book_flows(newest.living, newest.boundary);
  return true;
}

void Bioheat::book_step() {
  for (HeatBrick* brick : warm_) {
    HeatBrick::Warm& warm = *brick->warm;
    state_->totals.book.latent += warm.sums.latent;
    state_->totals.book.vapour += warm.sums.vapour;
    state_->totals.book.pyrolysis += warm.sums.pyrolysis;
    state_->totals.book.gas += warm.sums.gas;
    state_->totals.greatest = std::max(state_->totals.greatest, static_cast<double>(warm.greatest));
    for (const VoxelVapour& lost : warm.vapour) {
      state_->vapour.push_back(
          {bricks_.centre(*brick, lost.voxel), lost.water, lost.tissue, lost.temperature});
      state_->totals.water_lost += lost.water;
      state_->totals.tissue_lost += lost.tissue;
    }
    if (warm.heated) warm.source.fill(0.0f);
    warm.heated = false;
  }
}

void Bioheat::follow_heat() {
  std::vector<BrickIndex> wanted;
  for (HeatBrick* brick : warm_) {
    for (int side = 0; side < 6; ++side) {
      if (!(brick->warm->border[side] > options_.followed)) continue;
      if (brick->neighbours[side] && brick->neighbours[side]->warm) continue;
      BrickIndex beyond = brick->index;
      beyond[side / 2] += side % 2 ? 1 : -1;
      if (std::find(wanted.begin(), wanted.end(), beyond) == wanted.end()) wanted.push_back(beyond);
    }
  }
  bricks_.warm_up(wanted);
}

void Bioheat::let_go() {
  // Backwards: what takes a removed brick's place has been seen.
  for (std::size_t i = bricks_.count(); i-- > 0;) {
    HeatBrick& brick = bricks_.brick(i);
    if (!brick.warm) continue;
    bool needed = brick.warm->greatest > 0.5 * options_.followed;
    for (int side = 0; side < 6 && !needed; ++side) {
      const HeatBrick* other = brick.neighbours[side];
      needed = other && other->warm && other->warm->border[side ^ 1] > options_.followed;
    }
    brick.warm->idle = needed ? 0 : brick.warm->idle + 1;
    if (brick.warm->idle < kPatience) continue;
    HeatBrick* gone = &brick;
    if (!current_ && !device_->fetch({&gone, 1})) continue;  // as the next step will find
    state_->totals.book.boundary += stored_in(brick, numbers_);
    bricks_.cool_down(i);
  }
}

double Bioheat::stored() const {
  double stored = 0.0;
  for (std::size_t i = 0; i < bricks_.count(); ++i)
    if (const HeatBrick& brick = bricks_.brick(i); brick.warm)
      stored += current_ ? stored_in(brick, numbers_) : brick.warm->stored * voxel_volume();
  return stored;
}

HeatBook Bioheat::book() const {
  HeatBook book = state_->totals.book;
  book.stored = stored() - state_->stored_at_start;
  return book;
}

void Bioheat::begin_book() {
  state_->totals.book = {};
  state_->stored_at_start = stored();
}

double Bioheat::excess_now() const {
  float greatest = 0.0f;
  for (const HeatBrick* brick : warm_) greatest = std::max(greatest, brick->warm->greatest);
  return static_cast<double>(greatest);
}

double Bioheat::tissue_above(double kelvin) const {
  const double excess = kelvin - options_.body;
  double volume = 0.0;
  for (const HeatBrick* brick : warm_) {
    if (brick->warm->greatest <= excess) continue;
    for (int i = 0; i < BrickField::kVoxels; ++i)
      if (brick->warm->excess[i] > excess) volume += brick->geometry->fraction[i];
  }
  return volume * voxel_volume();
}

template <class Is>
double Bioheat::volume_that(const Is& is) const {
  double volume = 0.0;
  for (std::size_t i = 0; i < bricks_.count(); ++i) {
    const HeatBrick& brick = bricks_.brick(i);
    if (!brick.harmed) continue;
    for (std::size_t v = 0; v < BrickField::kVoxels; ++v)
      if (is(brick, v)) volume += brick.geometry->fraction[v];
  }
  return volume * voxel_volume();
}

double Bioheat::coagulated_volume() const {
  return volume_that(
      [](const HeatBrick& brick, std::size_t v) { return brick.coagulation[v] >= 1.0f; });
}

double Bioheat::dead_volume() const {
  return volume_that([](const HeatBrick& brick, std::size_t v) { return is_dead(brick, v); });
}

}  // namespace viscera
