#include "kernels/smoke/gas_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "kernels/base/wide.h"
#include "kernels/smoke/gas_rows.h"
#include "kernels/smoke/gas_sampling.h"

namespace viscera {

namespace {

// What each region's cells add up to: body(first index, length, sums).
template <class Body>
VectorX sum_regions(const GasLayout& layout, std::size_t regions, const Body& body) {
  const VectorX zero = VectorX::Zero(static_cast<Eigen::Index>(regions));
  return parallel_sum(static_cast<std::size_t>(layout.n[2]), gas_layers_a_chunk(layout), zero,
                      [&](std::size_t begin, std::size_t end) {
                        VectorX sums = zero;
                        layout.rows(begin, end, [&](std::ptrdiff_t c, int length, int, int) {
                          body(c, length, sums);
                        });
                        return sums;
                      });
}

std::array<int, 3> cells_of(const GasParameters& parameters, Vec3& spacing) {
  const Vec3 size = parameters.domain.sizes();
  const double cell = size.maxCoeff() / parameters.cells;
  std::array<int, 3> n{};
  for (int axis = 0; axis < 3; ++axis) {
    n[axis] = std::max(1, static_cast<int>(std::lround(size[axis] / cell)));
    spacing[axis] = size[axis] / n[axis];
  }
  return n;
}

constexpr std::size_t kFacesAChunk = 8192;

template <class Value>
double sum_gas_chunks(std::size_t faces, const Value& value) {
  return parallel_sum(faces, kFacesAChunk, 0.0, value);
}

// The greatest absolute value, that of what isn't a number aside.
VISCERA_WIDE float greatest_of(const float* values, std::size_t count) {
  float most[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    for (int l = 0; l < 8; ++l) {
      const float size = std::abs(values[i + l]);
      most[l] = size > most[l] ? size : most[l];
    }
  }
  for (; i < count; ++i) most[0] = std::max(most[0], std::abs(values[i]));
  return *std::max_element(most, most + 8);
}

}  // namespace

Result<void> check_gas(const GasParameters& p) {
  Error error;
  const auto expect = [&](bool good, const char* name, double found, const char* expected) {
    if (good) return;
    std::ostringstream text;
    text << "gas grid: " << name << ": found " << found << ", expected " << expected;
    error.messages.push_back(text.str());
  };
  const Vec3 size = p.domain.sizes();
  for (int axis = 0; axis < 3; ++axis) {
    expect(size[axis] > 0.0 && std::isfinite(size[axis]) && p.domain.min().allFinite(),
           (std::string("size of the domain along ") + "xyz"[axis]).c_str(), size[axis],
           "a finite length above 0 m");
  }
  expect(p.cells >= 2 && p.cells <= 128, "cells along the longest axis", p.cells, "2 to 128");
  const auto above = [](double v) { return v > 0.0 && std::isfinite(v); };
  expect(above(p.mixture.pressure), "pressure", p.mixture.pressure, "above 0 Pa");
  expect(above(p.mixture.temperature), "temperature", p.mixture.temperature, "above 0 K");
  expect(p.mixture.humidity >= 0.0 && p.mixture.humidity <= 1.0, "humidity", p.mixture.humidity,
         "0 to 1");
  const auto not_negative = [](double v) { return v >= 0.0 && std::isfinite(v); };
  expect(not_negative(p.kinematic_viscosity), "kinematic viscosity", p.kinematic_viscosity,
         "0 m2/s or above");
  expect(not_negative(p.heat_diffusivity), "heat diffusivity", p.heat_diffusivity,
         "0 m2/s or above");
  expect(not_negative(p.vapour_diffusivity), "vapour diffusivity", p.vapour_diffusivity,
         "0 m2/s or above");
  expect(not_negative(p.eddy_viscosity), "eddy viscosity", p.eddy_viscosity, "0 m2/s or above");
  expect(std::isfinite(p.gravity), "gravity", p.gravity, "a number of m/s2");
  expect(p.tolerance >= 1e-6 && p.tolerance < 1.0, "tolerance", p.tolerance, "1e-6 to 1");
  expect(p.most_speed > 0.0 && std::isfinite(p.most_speed), "most speed", p.most_speed,
         "above 0 m/s");
  expect(not_negative(p.rest_speed), "rest speed", p.rest_speed, "0 m/s or above");
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

GasGrid::GasGrid(const GasParameters& parameters)
    : parameters_(parameters),
      layout_(cells_of(parameters, spacing_)),
      pressure_(layout_.n),
      transport_(layout_) {
  const auto count = static_cast<std::size_t>(layout_.count);
  state_.solid.assign(count, 0);
  for (int axis = 0; axis < 3; ++axis) {
    state_.velocity[axis].assign(count, 0.0f);
    weight_[axis].assign(count, 0.0f);
    free_[axis].assign(count, 0);
  }
  for (std::vector<float>* values : {&outside_, &walls_, &state_.potential, &source_, &sinks_,
                                     &right_, &to_walls_, &lack_, &eddies_})
    values->assign(count, 0.0f);
  rebuild();
}

Vec3 GasGrid::cell_middle(int i, int j, int k) const {
  return parameters_.domain.min() + ((Vec3(i, j, k).array() + 0.5) * spacing_.array()).matrix();
}

bool GasGrid::is_solid(int i, int j, int k) const {
  return state_.solid[static_cast<std::size_t>(layout_.index(i, j, k))] != 0;
}

void GasGrid::set_solids(std::span<const std::uint8_t> solid, std::span<const Vec3f> velocities) {
  const auto& n = layout_.n;
  bool moving = false;
  for (const Vec3f& v : velocities) moving |= !v.isZero(0.0f);
  if (moving) {
    state_.solid_velocity.assign(state_.solid.size(), Vec3f::Zero());
    state_.at_rest = false;
  } else {
    state_.solid_velocity.clear();
  }
  layout_.rows([&](std::ptrdiff_t c, int length, int j, int k) {
    const auto given = static_cast<std::size_t>(n[0]) *
                       (static_cast<std::size_t>(j) +
                        static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(k));
    for (std::size_t i = 0; i < static_cast<std::size_t>(length); ++i) {
      const std::size_t cell = static_cast<std::size_t>(c) + i;
      state_.solid[cell] = solid[given + i] != 0;
      if (moving && state_.solid[cell] && velocities[given + i].allFinite()) {
        state_.solid_velocity[cell] = velocities[given + i];
      }
    }
  });
  rebuild();
}

bool GasGrid::fits(const State& state) const {
  const auto count = static_cast<std::size_t>(layout_.count);
  const auto sized = [&](const auto& values) { return values.size() == count; };
  const auto opens = [](const auto& source) {
    return source.position.allFinite() && std::isfinite(source.radius);
  };
  const auto flows = [&](const auto& source) {
    return opens(source) && std::isfinite(source.flow);
  };
  const bool no_impulse = std::ranges::all_of(
      state.impulse, [](const std::vector<double>& of_axis) { return of_axis.empty(); });
  const auto gives = [&](const GasSource& source) {
    const GasGift& gift = source.gift;
    return opens(source) && std::isfinite(gift.volume) && std::isfinite(gift.heat) &&
           std::isfinite(gift.vapour);
  };
  return sized(state.solid) && sized(state.potential) &&
         (state.swelling.empty() || sized(state.swelling)) &&
         std::ranges::all_of(state.contents.of,
                             [&](const auto& kind) { return kind.empty() || sized(kind); }) &&
         std::ranges::all_of(state.sources, gives) &&
         (state.solid_velocity.empty() || sized(state.solid_velocity)) &&
         std::ranges::all_of(state.velocity, sized) &&
         (no_impulse || std::ranges::all_of(state.impulse, sized)) &&
         (!no_impulse || !state.impulse_came) && std::isfinite(state.potential_dt) &&
         std::ranges::all_of(state.inlets, flows) && std::ranges::all_of(state.evacuators, flows) &&
         std::ranges::all_of(state.leaks, flows) &&
         state.report.inlets.size() == state.inlets.size() &&
         state.report.evacuators.size() == state.evacuators.size() &&
         state.report.leaks.size() == state.leaks.size();
}

void GasGrid::restore(State state) {
  state_ = std::move(state);
  derive();
  follow_contents();
  find_eddies();
}

void GasGrid::rebuild() {
  derive();
  layout_.rows([&](std::ptrdiff_t c, int length, int, int) {
    for (std::ptrdiff_t i = c; i < c + length; ++i) {
      const auto cell = static_cast<std::size_t>(i);
      if (!state_.solid[cell]) continue;
      state_.potential[cell] = 0.0f;
      lose_contents(cell);
    }
  });
  hold_fixed_faces();
  forget_flows();
  follow_contents();
}

/// What follows from solids and sources.
void GasGrid::derive() {
  for (int axis = 0; axis < 3; ++axis) {
    const auto weight = static_cast<float>(1.0 / (spacing_[axis] * spacing_[axis]));
    for_gas_face_rows(layout_, axis, [&](std::ptrdiff_t c, int length, int j, int k) {
      for (int i = 0; i < length; ++i) {
        const std::array<int, 3> at{i, j, k};
        const auto above = static_cast<std::size_t>(c + i);
        const std::size_t below = above - static_cast<std::size_t>(layout_.stride[axis]);
        bool free;
        if (at[axis] == 0) {
          free = parameters_.open[2 * axis] && !state_.solid[above];
        } else if (at[axis] == layout_.n[axis]) {
          free = parameters_.open[2 * axis + 1] && !state_.solid[below];
        } else {
          free = !state_.solid[above] && !state_.solid[below];
        }
        free_[axis][above] = free;
        weight_[axis][above] = free ? weight : 0.0f;
      }
    });
  }
  regions_ = gas_regions(layout_, state_.solid, weight_);

  for_gas_rows(layout_, [&](std::ptrdiff_t c, int length, int j, int k) {
    for (int i = 0; i < length; ++i) {
      const std::array<int, 3> at{i, j, k};
      const auto cell = static_cast<std::size_t>(c + i);
      outside_[cell] = walls_[cell] = 0.0f;
      for (int axis = 0; axis < 3; ++axis) {
        const auto above = cell + static_cast<std::size_t>(layout_.stride[axis]);
        if (at[axis] == 0) outside_[cell] += weight_[axis][cell];
        if (at[axis] + 1 == layout_.n[axis]) outside_[cell] += weight_[axis][above];
        if (state_.solid[cell]) continue;
        // The wall is half a cell away.
        const auto near = static_cast<float>(2.0 / (spacing_[axis] * spacing_[axis]));
        if (!free_[axis][cell]) walls_[cell] += near;
        if (!free_[axis][above]) walls_[cell] += near;
      }
    }
  });
  const VectorX opening =
      sum_regions(layout_, regions_.cells.size(), [&](std::ptrdiff_t c, int length, VectorX& sums) {
        for (auto i = static_cast<std::size_t>(c); i < static_cast<std::size_t>(c + length); ++i) {
          if (!state_.solid[i]) sums[regions_.of[i]] += static_cast<double>(outside_[i]);
        }
      });
  region_opening_.assign(opening.begin(), opening.end());
  pressure_.set_openings(weight_);
  viscosity_.set_walls(layout_, free_, {parameters_.no_slip, parameters_.open});
  place_sources();
}

void GasGrid::place_sources() {
  const auto spread = [&](const Vec3& position, double radius) {
    return spread_source(layout_, spacing_, regions_, position - parameters_.domain.min(), radius);
  };
  inlet_cells_.clear();
  for (const GasInlet& inlet : state_.inlets) {
    inlet_cells_.push_back(spread(inlet.position, inlet.radius));
  }
  evacuator_cells_.clear();
  for (const GasEvacuator& evacuator : state_.evacuators) {
    evacuator_cells_.push_back(spread(evacuator.position, evacuator.radius));
  }
  leak_cells_.clear();
  for (const GasLeak& leak : state_.leaks) {
    leak_cells_.push_back(spread(leak.position, leak.radius));
  }
  std::ranges::fill(source_, 0.0f);
  std::ranges::fill(sinks_, 0.0f);
  const auto add = [&](const GasSpread& cells, double flow) {
    for (std::size_t i = 0; i < cells.cells.size(); ++i) {
      const auto cell = static_cast<std::size_t>(cells.cells[i]);
      const auto rate = static_cast<float>(flow * cells.weights[i] / cell_volume());
      source_[cell] += rate;
      if (rate < 0.0f) sinks_[cell] -= rate;
    }
  };
  for (std::size_t i = 0; i < state_.inlets.size(); ++i)
    add(inlet_cells_[i], state_.inlets[i].flow);
  for (std::size_t i = 0; i < state_.evacuators.size(); ++i) {
    add(evacuator_cells_[i], -state_.evacuators[i].flow);
  }
  for (std::size_t i = 0; i < state_.leaks.size(); ++i) add(leak_cells_[i], -state_.leaks[i].flow);
}

/// Those of the last step are of other sources.
void GasGrid::forget_flows() {
  state_.report.inlets.assign(state_.inlets.size(), 0.0);
  state_.report.evacuators.assign(state_.evacuators.size(), 0.0);
  state_.report.leaks.assign(state_.leaks.size(), 0.0);
}

void GasGrid::set_inlets(std::span<const GasInlet> inlets) {
  state_.inlets.assign(inlets.begin(), inlets.end());
  place_sources();
  forget_flows();
}

void GasGrid::set_evacuators(std::span<const GasEvacuator> evacuators) {
  state_.evacuators.assign(evacuators.begin(), evacuators.end());
  place_sources();
  forget_flows();
}

void GasGrid::set_leaks(std::span<const GasLeak> leaks) {
  state_.leaks.assign(leaks.begin(), leaks.end());
  place_sources();
  forget_flows();
}

void GasGrid::hold_fixed_faces() {
  for (int axis = 0; axis < 3; ++axis) {
    const std::ptrdiff_t stride = layout_.stride[axis];
    for_gas_face_rows(layout_, axis, [&](std::ptrdiff_t c, int length, int j, int k) {
      for (int i = 0; i < length; ++i) {
        const std::array<int, 3> at{i, j, k};
        const auto f = static_cast<std::size_t>(c + i);
        if (free_[axis][f]) continue;
        float value = 0.0f;
        if (!state_.solid_velocity.empty() && at[axis] > 0 && at[axis] < layout_.n[axis]) {
          const auto below = static_cast<std::size_t>(c + i - stride);
          const float sides = static_cast<float>(state_.solid[f] + state_.solid[below]);
          value = (state_.solid_velocity[f][axis] + state_.solid_velocity[below][axis]) / sides;
        }
        state_.velocity[axis][f] = value;
      }
    });
  }
}

void GasGrid::place(const GasPoints& points) {
  stencils_.place(layout_, parameters_.domain.min(), spacing_, points);
}

void GasGrid::velocity(const StridedVectors<float>& velocities) const {
  stencils_.read(state_.velocity, velocities);
}

Vec3 GasGrid::velocity(const Vec3& world) const {
  const Vec3f at = (world - parameters_.domain.min()).cwiseQuotient(spacing_).cast<float>();
  return sample(layout_, state_.velocity, at.x(), at.y(), at.z()).cast<double>();
}

void GasGrid::add_momentum(const StridedVectors<const float>& impulses) {
  for (std::vector<double>& of_axis : state_.impulse)
    of_axis.resize(static_cast<std::size_t>(layout_.count), 0.0);
  stencils_.spread(impulses, state_.impulse);
  for (std::size_t i = 0; i < impulses.size && !state_.impulse_came; ++i) {
    const Vec3f impulse = impulses.at(i);
    state_.impulse_came = impulse.allFinite() && !impulse.isZero(0.0f);
  }
}

void GasGrid::give_impulses() {
  const double mass = parameters_.mixture.density() * cell_volume();
  const double most = 2.0 * parameters_.most_speed;
  for (int axis = 0; axis < 3; ++axis) {
    state_.report.impulse_to_walls[axis] =
        sum_gas_chunks(state_.impulse[axis].size(), [&](std::size_t begin, std::size_t end) {
          double walls = 0.0;
          for (std::size_t f = begin; f < end; ++f) {
            const double impulse = state_.impulse[axis][f];
            if (impulse == 0.0) continue;
            if (free_[axis][f]) {
              state_.velocity[axis][f] +=
                  static_cast<float>(std::clamp(impulse / mass, -most, most));
            } else {
              walls += impulse;
            }
          }
          return walls;
        });
  }
  for (std::vector<double>& of_axis : state_.impulse) of_axis.clear();
  state_.impulse_came = false;
}

void GasGrid::drive_inlets(double dt) {
  // What comes in mixes with what is there: du/dt = (flow / volume) (jet - u), implicit. A face
  // takes half of each of its cells.
  for (std::size_t n = 0; n < state_.inlets.size(); ++n) {
    const GasInlet& inlet = state_.inlets[n];
    if (!(inlet.flow > 0.0) || inlet.direction.isZero(0.0)) continue;
    const Vec3 jet = inlet.flow / (std::numbers::pi * inlet.radius * inlet.radius) *
                     inlet.direction.normalized();
    const GasSpread& spread = inlet_cells_[n];
    for (std::size_t i = 0; i < spread.cells.size(); ++i) {
      const double rate = 0.5 * dt * inlet.flow * spread.weights[i] / cell_volume();
      for (int axis = 0; axis < 3; ++axis) {
        for (const std::ptrdiff_t f : {spread.cells[i], spread.cells[i] + layout_.stride[axis]}) {
          const auto face = static_cast<std::size_t>(f);
          if (!free_[axis][face]) continue;
          float& u = state_.velocity[axis][face];
          u = static_cast<float>((static_cast<double>(u) + rate * jet[axis]) / (1.0 + rate));
        }
      }
    }
  }
}

void GasGrid::slow_down() {
  const auto most = static_cast<float>(parameters_.most_speed);
  state_.report.slowed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double slowed =
        sum_gas_chunks(state_.velocity[axis].size(), [&](std::size_t begin, std::size_t end) {
          double number = 0.0;
          for (std::size_t f = begin; f < end; ++f) {
            float& u = state_.velocity[axis][f];
            if (std::abs(u) <= most) continue;
            u = std::clamp(std::isnan(u) ? 0.0f : u, -most, most);
            ++number;
          }
          return number;
        });
    state_.report.slowed += static_cast<std::size_t>(slowed);
  }
}

bool GasGrid::driven() const {
  const auto flows = [](const auto& source) { return source.flow > 0.0; };
  return state_.impulse_came || !state_.sources.empty() || felt_ ||
         !state_.solid_velocity.empty() || std::ranges::any_of(state_.inlets, flows) ||
         std::ranges::any_of(state_.evacuators, flows) ||
         std::ranges::any_of(state_.leaks, [](const GasLeak& leak) { return leak.flow != 0.0; });
}

const GasReport& GasGrid::step(double dt) {
  if (!(dt > 0.0) || !std::isfinite(dt) || (state_.at_rest && !driven())) {
    const auto zeros = [](std::vector<double>& flows) { std::ranges::fill(flows, 0.0); };
    if (state_.report.moved) {
      zeros(state_.report.inlets), zeros(state_.report.evacuators), zeros(state_.report.leaks);
      GasReport rest;
      rest.inlets.swap(state_.report.inlets);
      rest.evacuators.swap(state_.report.evacuators);
      rest.leaks.swap(state_.report.leaks);
      state_.report = std::move(rest);
    }
    return state_.report;
  }
  state_.report.moved = true;
  move_contents(dt);
  take_sources(dt);
  condense(dt);
  if (!state_.at_rest) advection_.step(layout_, weight_, spacing_, dt, state_.velocity);
  state_.at_rest = false;
  state_.report.impulse_to_walls.setZero();
  if (state_.impulse_came) give_impulses();
  lift(dt);
  viscosity_.step(spacing_, parameters_.kinematic_viscosity + parameters_.eddy_viscosity, dt,
                  state_.velocity);
  drive_inlets(dt);
  slow_down();
  project(dt);
  measure(dt);
  follow_contents();
  find_eddies();
  return state_.report;
}

void GasGrid::project(double dt) {
  // lap phi = div u - source, phi = p dt / density; then u -= grad phi. [Chorin1968]
  const Vec3f per = spacing_.cwiseInverse().cast<float>();
  const std::size_t regions = regions_.cells.size();
  const VectorX excess =
      sum_regions(layout_, regions, [&](std::ptrdiff_t c, int length, VectorX& sums) {
        for (std::ptrdiff_t at = c; at < c + length; ++at) {
          const auto i = static_cast<std::size_t>(at);
          right_[i] = 0.0f;
          if (state_.solid[i]) continue;
          float divergence = 0.0f;
          for (int axis = 0; axis < 3; ++axis) {
            const float* u = state_.velocity[axis].data() + at;
            divergence += per[axis] * (u[layout_.stride[axis]] - u[0]);
          }
          right_[i] = source_[i] + swelling(i) - divergence;
          sums[regions_.of[i]] += static_cast<double>(right_[i]);
        }
      });
  // A closed region takes its excess as compression.
  state_.squeeze.setZero(static_cast<Eigen::Index>(regions));
  state_.report.compression = 0.0;
  for (std::size_t region = 0; region < regions; ++region) {
    if (region_opening_[region] > 0.0) continue;
    const auto at = static_cast<Eigen::Index>(region);
    state_.squeeze[at] = excess[at] / regions_.cells[region];
    state_.report.compression += excess[at] * cell_volume();
  }
  const auto scale = static_cast<float>(state_.potential_dt > 0.0 ? dt / state_.potential_dt : 1.0);
  const double square = sum_gas_rows(layout_, [&](std::ptrdiff_t c, int length) {
    double sum = 0.0;
    for (std::ptrdiff_t at = c; at < c + length; ++at) {
      const auto i = static_cast<std::size_t>(at);
      if (state_.solid[i]) continue;
      right_[i] -= static_cast<float>(state_.squeeze[regions_.of[i]]);
      state_.potential[i] *= scale;
      sum += static_cast<double>(right_[i]) * static_cast<double>(right_[i]);
    }
    return sum;
  });
  double speeds = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    speeds += sum_gas_rows(layout_, [&](std::ptrdiff_t c, int length) {
      float sum = 0.0f;
      for (std::ptrdiff_t i = c; i < c + length; ++i) {
        const float u = state_.velocity[axis][static_cast<std::size_t>(i)] * per[axis];
        sum += u * u;
      }
      return static_cast<double>(sum);
    });
  }
  const double reference = std::max(std::sqrt(square), 0.1 * std::sqrt(speeds));
  const GasPressure::Outcome outcome =
      pressure_.solve(right_, state_.potential, parameters_.tolerance * reference);
  state_.report.iterations = outcome.iterations;
  state_.report.converged = outcome.converged;
  state_.report.divergence = reference > 0.0 ? outcome.residual / reference : 0.0;
  state_.potential_dt = dt;

  // A constant is free in closed regions: mean 0. In open ones it closes the balance of flows that
  // the tolerance leaves open.
  const VectorX sums =
      sum_regions(layout_, regions, [&](std::ptrdiff_t c, int length, VectorX& all) {
        for (std::ptrdiff_t at = c; at < c + length; ++at) {
          const auto i = static_cast<std::size_t>(at);
          if (state_.solid[i]) continue;
          const int region = regions_.of[i];
          const bool open = region_opening_[static_cast<std::size_t>(region)] > 0.0;
          all[region] += (open ? static_cast<double>(outside_[i]) : 1.0) *
                         static_cast<double>(state_.potential[i]);
        }
      });
  VectorX shift(static_cast<Eigen::Index>(regions));
  for (std::size_t region = 0; region < regions; ++region) {
    const auto at = static_cast<Eigen::Index>(region);
    const double opening = region_opening_[region];
    shift[at] =
        opening > 0.0 ? (excess[at] - sums[at]) / opening : -sums[at] / regions_.cells[region];
  }
  for_gas_rows(layout_, [&](std::ptrdiff_t c, int length, int, int) {
    for (std::ptrdiff_t at = c; at < c + length; ++at) {
      const auto i = static_cast<std::size_t>(at);
      if (!state_.solid[i]) state_.potential[i] += static_cast<float>(shift[regions_.of[i]]);
    }
  });
  for (int axis = 0; axis < 3; ++axis) {
    const std::ptrdiff_t stride = layout_.stride[axis];
    const float* phi = state_.potential.data();
    const float* weight = weight_[axis].data();
    float* u = state_.velocity[axis].data();
    // The weight is 1/h^2, or 0 where gas doesn't pass.
    const auto spacing = static_cast<float>(spacing_[axis]);
    for_gas_face_rows(layout_, axis, [&](std::ptrdiff_t c, int length, int, int) {
      for (std::ptrdiff_t f = c; f < c + length; ++f) {
        u[f] -= spacing * weight[f] * (phi[f] - phi[f - stride]);
      }
    });
  }
}

void GasGrid::measure(double dt) {
  float speed = 0.0f;
  state_.report.courant = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const float most = greatest_of(state_.velocity[axis].data(), state_.velocity[axis].size());
    state_.report.courant =
        std::max(state_.report.courant, static_cast<double>(most) * dt / spacing_[axis]);
    speed = std::max(speed, most);
  }
  state_.report.speed = static_cast<double>(speed);

  for (std::size_t i = 0; i < state_.inlets.size(); ++i) {
    state_.report.inlets[i] = inlet_cells_[i].cells.empty() ? 0.0 : state_.inlets[i].flow;
  }
  for (std::size_t i = 0; i < state_.evacuators.size(); ++i) {
    state_.report.evacuators[i] =
        evacuator_cells_[i].cells.empty() ? 0.0 : state_.evacuators[i].flow;
  }
  for (std::size_t i = 0; i < state_.leaks.size(); ++i) {
    state_.report.leaks[i] = leak_cells_[i].cells.empty() ? 0.0 : state_.leaks[i].flow;
  }
  state_.report.sides.fill(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    if (!parameters_.open[2 * axis] && !parameters_.open[2 * axis + 1]) continue;
    const double area = cell_volume() / spacing_[axis];
    layout_.rows([&](std::ptrdiff_t c, int length, int j, int k) {
      for (int i = 0; i < length; ++i) {
        const std::array<int, 3> at{i, j, k};
        const float* u = state_.velocity[axis].data() + c + i;
        if (at[axis] == 0) state_.report.sides[2 * axis] -= area * static_cast<double>(u[0]);
        if (at[axis] + 1 == layout_.n[axis]) {
          state_.report.sides[2 * axis + 1] += area * static_cast<double>(u[layout_.stride[axis]]);
        }
      }
    });
  }
  state_.report.swelling = cell_volume() * sum_gas_rows(layout_, [&](std::ptrdiff_t c, int length) {
                             double sum = 0.0;
                             for (std::ptrdiff_t i = c; i < c + length; ++i)
                               sum += static_cast<double>(swelling(static_cast<std::size_t>(i)));
                             return sum;
                           });
  state_.report.displaced = 0.0;
  if (!state_.solid_velocity.empty()) {
    layout_.rows([&](std::ptrdiff_t c, int length, int, int) {
      for (std::ptrdiff_t i = c; i < c + length; ++i) {
        if (state_.solid[static_cast<std::size_t>(i)]) continue;
        for (int axis = 0; axis < 3; ++axis) {
          const double area = cell_volume() / spacing_[axis];
          const std::ptrdiff_t above = i + layout_.stride[axis];
          if (!free_[axis][static_cast<std::size_t>(i)]) {
            state_.report.displaced +=
                area * static_cast<double>(state_.velocity[axis][static_cast<std::size_t>(i)]);
          }
          if (!free_[axis][static_cast<std::size_t>(above)]) {
            state_.report.displaced -=
                area * static_cast<double>(state_.velocity[axis][static_cast<std::size_t>(above)]);
          }
        }
      }
    });
  }
  if (state_.report.speed <= parameters_.rest_speed && !driven()) {
    for (auto& faces : state_.velocity) std::ranges::fill(faces, 0.0f);
    std::ranges::fill(state_.potential, 0.0f);
    state_.at_rest = true;
  }
}

void GasGrid::set_velocity(const std::function<Vec3(const Vec3&)>& field) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < layout_.faces(axis, 2); ++k) {
      for (int j = 0; j < layout_.faces(axis, 1); ++j) {
        for (int i = 0; i < layout_.faces(axis, 0); ++i) {
          const auto f = static_cast<std::size_t>(layout_.index(i, j, k));
          if (!free_[axis][f]) continue;
          const Vec3 at = cell_middle(i, j, k) - 0.5 * spacing_[axis] * Vec3::Unit(axis);
          state_.velocity[axis][f] = static_cast<float>(field(at)[axis]);
        }
      }
    }
  }
  state_.at_rest = false;
}

Vec3 GasGrid::momentum() const {
  const double mass = parameters_.mixture.density() * cell_volume();
  Vec3 sum = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t f = 0; f < state_.velocity[axis].size(); ++f) {
      if (!free_[axis][f]) continue;
      const double given = state_.impulse[axis].empty() ? 0.0 : state_.impulse[axis][f];
      sum[axis] += mass * static_cast<double>(state_.velocity[axis][f]) + given;
    }
  }
  return sum;
}

double GasGrid::energy() const {
  const double mass = parameters_.mixture.density() * cell_volume();
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t f = 0; f < state_.velocity[axis].size(); ++f) {
      const auto u = static_cast<double>(state_.velocity[axis][f]);
      if (free_[axis][f]) sum += 0.5 * mass * u * u;
    }
  }
  return sum;
}

double GasGrid::divergence_error() const {
  double worst = 0.0;
  layout_.rows([&](std::ptrdiff_t c, int length, int, int) {
    for (std::ptrdiff_t at = c; at < c + length; ++at) {
      const auto i = static_cast<std::size_t>(at);
      if (state_.solid[i]) continue;
      double divergence = 0.0;
      for (int axis = 0; axis < 3; ++axis) {
        const float* u = state_.velocity[axis].data() + at;
        divergence += (static_cast<double>(u[layout_.stride[axis]]) - static_cast<double>(u[0])) /
                      spacing_[axis];
      }
      const Eigen::Index region = regions_.of[i];
      const double squeezed = region < state_.squeeze.size() ? state_.squeeze[region] : 0.0;
      const double asked =
          static_cast<double>(source_[i]) + static_cast<double>(swelling(i)) - squeezed;
      worst = std::max(worst, std::abs(divergence - asked));
    }
  });
  return state_.report.speed > 0.0 ? worst * spacing_.minCoeff() / state_.report.speed : 0.0;
}

std::size_t GasGrid::memory_bytes() const {
  // Bytes of the arrays over cells or faces: here, of advection and viscosity, and of the
  // pressure's grids, the coarse ones of which add a seventh.
  constexpr std::size_t kHere =
      3 * (1 + 2 * sizeof(float) + sizeof(double)) + 13 * sizeof(float) + sizeof(int) + 1;
  constexpr std::size_t kAdvection = 11 * sizeof(float), kViscosity = 18 * sizeof(float);
  constexpr std::size_t kPressure = 9 * sizeof(float) * 8 / 7 + 2 * sizeof(float);
  return static_cast<std::size_t>(layout_.count) * (kHere + kAdvection + kViscosity + kPressure) +
         state_.solid_velocity.capacity() * sizeof(Vec3f) + transport_.memory_bytes() +
         stencils_.memory_bytes();
}

}  // namespace viscera
