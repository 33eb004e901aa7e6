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

constexpr std::size_t kPointsAChunk = 8192, kFacesAChunk = 8192;

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
  expect(p.density > 0.0 && std::isfinite(p.density), "density", p.density, "above 0 kg/m3");
  const auto not_negative = [](double v) { return v >= 0.0 && std::isfinite(v); };
  expect(not_negative(p.kinematic_viscosity), "kinematic viscosity", p.kinematic_viscosity,
         "0 m2/s or above");
  expect(not_negative(p.eddy_viscosity), "eddy viscosity", p.eddy_viscosity, "0 m2/s or above");
  expect(p.tolerance >= 1e-6 && p.tolerance < 1.0, "tolerance", p.tolerance, "1e-6 to 1");
  expect(p.most_speed > 0.0 && std::isfinite(p.most_speed), "most speed", p.most_speed,
         "above 0 m/s");
  expect(not_negative(p.rest_speed), "rest speed", p.rest_speed, "0 m/s or above");
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

GasGrid::GasGrid(const GasParameters& parameters)
    : parameters_(parameters), layout_(cells_of(parameters, spacing_)), pressure_(layout_.n) {
  const auto count = static_cast<std::size_t>(layout_.count);
  solid_.assign(count, 0);
  for (int axis = 0; axis < 3; ++axis) {
    velocity_[axis].assign(count, 0.0f);
    weight_[axis].assign(count, 0.0f);
    free_[axis].assign(count, 0);
    impulse_[axis].assign(count, 0.0);
    rate_[axis].assign(count, 0.0f);
    rate_sums_[axis].assign(count, 0.0);
  }
  opening_.assign(count, 0.0f);
  outside_.assign(count, 0.0f);
  potential_.assign(count, 0.0f);
  source_.assign(count, 0.0f);
  right_.assign(count, 0.0f);
  rebuild();
}

Vec3 GasGrid::cell_middle(int i, int j, int k) const {
  return parameters_.domain.min() + ((Vec3(i, j, k).array() + 0.5) * spacing_.array()).matrix();
}

bool GasGrid::is_solid(int i, int j, int k) const {
  return solid_[static_cast<std::size_t>(layout_.index(i, j, k))] != 0;
}

void GasGrid::set_solids(std::span<const std::uint8_t> solid, std::span<const Vec3f> velocities) {
  const auto& n = layout_.n;
  bool moving = false;
  for (const Vec3f& v : velocities) moving |= !v.isZero(0.0f);
  if (moving) {
    solid_velocity_.assign(solid_.size(), Vec3f::Zero());
    at_rest_ = false;
  } else {
    solid_velocity_.clear();
  }
  layout_.rows([&](std::ptrdiff_t c, int length, int j, int k) {
    const auto given = static_cast<std::size_t>(n[0]) *
                       (static_cast<std::size_t>(j) +
                        static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(k));
    for (std::size_t i = 0; i < static_cast<std::size_t>(length); ++i) {
      const std::size_t cell = static_cast<std::size_t>(c) + i;
      solid_[cell] = solid[given + i] != 0;
      if (moving && solid_[cell] && velocities[given + i].allFinite()) {
        solid_velocity_[cell] = velocities[given + i];
      }
    }
  });
  rebuild();
}

void GasGrid::rebuild() {
  for (int axis = 0; axis < 3; ++axis) {
    const auto weight = static_cast<float>(1.0 / (spacing_[axis] * spacing_[axis]));
    for_gas_face_rows(layout_, axis, [&](std::ptrdiff_t c, int length, int j, int k) {
      for (int i = 0; i < length; ++i) {
        const std::array<int, 3> at{i, j, k};
        const auto above = static_cast<std::size_t>(c + i);
        const std::size_t below = above - static_cast<std::size_t>(layout_.stride[axis]);
        bool free;
        if (at[axis] == 0) {
          free = parameters_.open[2 * axis] && !solid_[above];
        } else if (at[axis] == layout_.n[axis]) {
          free = parameters_.open[2 * axis + 1] && !solid_[below];
        } else {
          free = !solid_[above] && !solid_[below];
        }
        free_[axis][above] = free;
        weight_[axis][above] = free ? weight : 0.0f;
      }
    });
  }
  regions_ = gas_regions(layout_, solid_, weight_);

  // A hole of radius r lets gas out as a plug of that length would that pressure drives:
  // flow = pi r^2 (p dt / density) / r, shared by the cells about it.
  leak_cells_.clear();
  std::ranges::fill(opening_, 0.0f);
  for (const GasLeak& leak : leaks_) {
    GasSpread spread = spread_source(layout_, spacing_, regions_,
                                     leak.position - parameters_.domain.min(), leak.radius);
    const double conductance = std::numbers::pi * leak.radius / cell_volume();
    for (std::size_t i = 0; i < spread.cells.size(); ++i) {
      opening_[static_cast<std::size_t>(spread.cells[i])] +=
          static_cast<float>(conductance * spread.weights[i]);
    }
    leak_cells_.push_back(std::move(spread));
  }
  for_gas_rows(layout_, [&](std::ptrdiff_t c, int length, int j, int k) {
    for (int i = 0; i < length; ++i) {
      const std::array<int, 3> at{i, j, k};
      const auto cell = static_cast<std::size_t>(c + i);
      outside_[cell] = opening_[cell];
      for (int axis = 0; axis < 3; ++axis) {
        const auto above = cell + static_cast<std::size_t>(layout_.stride[axis]);
        if (at[axis] == 0) outside_[cell] += weight_[axis][cell];
        if (at[axis] + 1 == layout_.n[axis]) outside_[cell] += weight_[axis][above];
      }
    }
  });
  const VectorX opening =
      sum_regions(layout_, regions_.cells.size(), [&](std::ptrdiff_t c, int length, VectorX& sums) {
        for (auto i = static_cast<std::size_t>(c); i < static_cast<std::size_t>(c + length); ++i) {
          if (!solid_[i]) sums[regions_.of[i]] += static_cast<double>(outside_[i]);
        }
      });
  region_opening_.assign(opening.begin(), opening.end());
  pressure_.set_openings(weight_, opening_);
  viscosity_.set_walls(layout_, free_, {parameters_.no_slip, parameters_.open});
  layout_.rows([&](std::ptrdiff_t c, int length, int, int) {
    for (std::ptrdiff_t i = c; i < c + length; ++i) {
      if (solid_[static_cast<std::size_t>(i)]) potential_[static_cast<std::size_t>(i)] = 0.0f;
    }
  });
  hold_fixed_faces();
  place_sources();
}

void GasGrid::place_sources() {
  const auto spread = [&](const Vec3& position, double radius) {
    return spread_source(layout_, spacing_, regions_, position - parameters_.domain.min(), radius);
  };
  inlet_cells_.clear();
  for (const GasInlet& inlet : inlets_) {
    inlet_cells_.push_back(spread(inlet.position, inlet.radius));
  }
  evacuator_cells_.clear();
  for (const GasEvacuator& evacuator : evacuators_) {
    evacuator_cells_.push_back(spread(evacuator.position, evacuator.radius));
  }
  std::ranges::fill(source_, 0.0f);
  report_.inlets.assign(inlets_.size(), 0.0);
  report_.evacuators.assign(evacuators_.size(), 0.0);
  report_.leaks.assign(leaks_.size(), 0.0);
  const auto add = [&](const GasSpread& cells, double flow) {
    for (std::size_t i = 0; i < cells.cells.size(); ++i) {
      source_[static_cast<std::size_t>(cells.cells[i])] +=
          static_cast<float>(flow * cells.weights[i] / cell_volume());
    }
  };
  for (std::size_t i = 0; i < inlets_.size(); ++i) add(inlet_cells_[i], inlets_[i].flow);
  for (std::size_t i = 0; i < evacuators_.size(); ++i) {
    add(evacuator_cells_[i], -evacuators_[i].flow);
  }
}

void GasGrid::set_inlets(std::span<const GasInlet> inlets) {
  inlets_.assign(inlets.begin(), inlets.end());
  place_sources();
}

void GasGrid::set_evacuators(std::span<const GasEvacuator> evacuators) {
  evacuators_.assign(evacuators.begin(), evacuators.end());
  place_sources();
}

void GasGrid::set_leaks(std::span<const GasLeak> leaks) {
  if (std::ranges::equal(leaks, leaks_)) return;
  leaks_.assign(leaks.begin(), leaks.end());
  rebuild();
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
        if (!solid_velocity_.empty() && at[axis] > 0 && at[axis] < layout_.n[axis]) {
          const auto below = static_cast<std::size_t>(c + i - stride);
          const float sides = static_cast<float>(solid_[f] + solid_[below]);
          value = (solid_velocity_[f][axis] + solid_velocity_[below][axis]) / sides;
        }
        velocity_[axis][f] = value;
      }
    });
  }
}

void GasGrid::place(const GasPoints& points) {
  stencils_.place(layout_, parameters_.domain.min(), spacing_, points);
}

void GasGrid::velocity(const StridedVectors<float>& velocities) const {
  stencils_.read(velocity_, velocities);
}

Vec3 GasGrid::velocity(const Vec3& world) const {
  const Vec3f at = (world - parameters_.domain.min()).cwiseQuotient(spacing_).cast<float>();
  return sample(layout_, velocity_, at.x(), at.y(), at.z()).cast<double>();
}

void GasGrid::couple(std::span<const float> rates, std::span<float> shares) {
  stencils_.spread({rates, rates, rates}, rate_sums_);
  for (int axis = 0; axis < 3; ++axis) {
    for_gas_face_rows(layout_, axis, [&](std::ptrdiff_t c, int length, int, int) {
      for (auto f = static_cast<std::size_t>(c); f < static_cast<std::size_t>(c + length); ++f) {
        // Walls have all the mass that it takes.
        rate_[axis][f] = free_[axis][f] ? static_cast<float>(rate_sums_[axis][f]) : 0.0f;
        rate_sums_[axis][f] = 0.0;
      }
    });
  }
  stencils_.greatest(rate_, shares);
  const double mass = parameters_.density * cell_volume();
  parallel_for_each_index(shares.size(), kPointsAChunk, [&](std::size_t i) {
    shares[i] = static_cast<float>(mass / (mass + static_cast<double>(shares[i])));
  });
}

void GasGrid::add_momentum(const StridedVectors<const float>& impulses) {
  stencils_.spread(impulses, impulse_);
  for (std::size_t i = 0; i < impulses.size && !impulse_came_; ++i) {
    const Vec3f impulse = impulses.at(i);
    impulse_came_ = impulse.allFinite() && !impulse.isZero(0.0f);
  }
}

void GasGrid::give_impulses() {
  const double mass = parameters_.density * cell_volume();
  const double most = 2.0 * parameters_.most_speed;
  for (int axis = 0; axis < 3; ++axis) {
    report_.impulse_to_walls[axis] =
        sum_gas_chunks(impulse_[axis].size(), [&](std::size_t begin, std::size_t end) {
          double walls = 0.0;
          for (std::size_t f = begin; f < end; ++f) {
            const double impulse = std::exchange(impulse_[axis][f], 0.0);
            if (impulse == 0.0) continue;
            if (free_[axis][f]) {
              velocity_[axis][f] += static_cast<float>(std::clamp(impulse / mass, -most, most));
            } else {
              walls += impulse;
            }
          }
          return walls;
        });
  }
  impulse_came_ = false;
}

void GasGrid::drive_inlets(double dt) {
  // What comes in mixes with what is there: du/dt = (flow / volume) (jet - u), implicit. A face
  // takes half of each of its cells.
  for (std::size_t n = 0; n < inlets_.size(); ++n) {
    const GasInlet& inlet = inlets_[n];
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
          float& u = velocity_[axis][face];
          u = static_cast<float>((static_cast<double>(u) + rate * jet[axis]) / (1.0 + rate));
        }
      }
    }
  }
}

void GasGrid::slow_down() {
  const auto most = static_cast<float>(parameters_.most_speed);
  report_.slowed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double slowed =
        sum_gas_chunks(velocity_[axis].size(), [&](std::size_t begin, std::size_t end) {
          double number = 0.0;
          for (std::size_t f = begin; f < end; ++f) {
            float& u = velocity_[axis][f];
            if (std::abs(u) <= most) continue;
            u = std::clamp(std::isnan(u) ? 0.0f : u, -most, most);
            ++number;
          }
          return number;
        });
    report_.slowed += static_cast<std::size_t>(slowed);
  }
}

bool GasGrid::driven() const {
  const auto flows = [](const auto& source) { return source.flow > 0.0; };
  return impulse_came_ || !solid_velocity_.empty() || std::ranges::any_of(inlets_, flows) ||
         std::ranges::any_of(evacuators_, flows);
}

const GasReport& GasGrid::step(double dt) {
  if (!(dt > 0.0) || !std::isfinite(dt) || (at_rest_ && !driven())) {
    const auto zeros = [](std::vector<double>& flows) { std::ranges::fill(flows, 0.0); };
    if (report_.moved) {
      zeros(report_.inlets), zeros(report_.evacuators), zeros(report_.leaks);
      GasReport rest;
      rest.inlets.swap(report_.inlets);
      rest.evacuators.swap(report_.evacuators);
      rest.leaks.swap(report_.leaks);
      report_ = std::move(rest);
    }
    return report_;
  }
  report_.moved = true;
  if (!at_rest_) advection_.step(layout_, weight_, spacing_, dt, velocity_);
  at_rest_ = false;
  report_.impulse_to_walls.setZero();
  if (impulse_came_) give_impulses();
  viscosity_.step(spacing_, parameters_.kinematic_viscosity + parameters_.eddy_viscosity, dt,
                  velocity_);
  drive_inlets(dt);
  slow_down();
  project(dt);
  measure(dt);
  return report_;
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
          if (solid_[i]) continue;
          float divergence = 0.0f;
          for (int axis = 0; axis < 3; ++axis) {
            const float* u = velocity_[axis].data() + at;
            divergence += per[axis] * (u[layout_.stride[axis]] - u[0]);
          }
          right_[i] = source_[i] - divergence;
          sums[regions_.of[i]] += static_cast<double>(right_[i]);
        }
      });
  // A closed region takes its excess as compression.
  squeeze_.setZero(static_cast<Eigen::Index>(regions));
  report_.compression = 0.0;
  for (std::size_t region = 0; region < regions; ++region) {
    if (region_opening_[region] > 0.0) continue;
    const auto at = static_cast<Eigen::Index>(region);
    squeeze_[at] = excess[at] / regions_.cells[region];
    report_.compression += excess[at] * cell_volume();
  }
  const auto scale = static_cast<float>(potential_dt_ > 0.0 ? dt / potential_dt_ : 1.0);
  const double square = sum_gas_rows(layout_, [&](std::ptrdiff_t c, int length) {
    double sum = 0.0;
    for (std::ptrdiff_t at = c; at < c + length; ++at) {
      const auto i = static_cast<std::size_t>(at);
      if (solid_[i]) continue;
      right_[i] -= static_cast<float>(squeeze_[regions_.of[i]]);
      potential_[i] *= scale;
      sum += static_cast<double>(right_[i]) * static_cast<double>(right_[i]);
    }
    return sum;
  });
  double speeds = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    speeds += sum_gas_rows(layout_, [&](std::ptrdiff_t c, int length) {
      float sum = 0.0f;
      for (std::ptrdiff_t i = c; i < c + length; ++i) {
        const float u = velocity_[axis][static_cast<std::size_t>(i)] * per[axis];
        sum += u * u;
      }
      return static_cast<double>(sum);
    });
  }
  const double reference = std::max(std::sqrt(square), 0.1 * std::sqrt(speeds));
  const GasPressure::Outcome outcome =
      pressure_.solve(right_, potential_, parameters_.tolerance * reference);
  report_.iterations = outcome.iterations;
  report_.converged = outcome.converged;
  report_.divergence = reference > 0.0 ? outcome.residual / reference : 0.0;
  potential_dt_ = dt;

  // A constant is free in closed regions: mean 0. In open ones it closes the balance of flows that
  // the tolerance leaves open.
  const VectorX sums =
      sum_regions(layout_, regions, [&](std::ptrdiff_t c, int length, VectorX& all) {
        for (std::ptrdiff_t at = c; at < c + length; ++at) {
          const auto i = static_cast<std::size_t>(at);
          if (solid_[i]) continue;
          const int region = regions_.of[i];
          const bool open = region_opening_[static_cast<std::size_t>(region)] > 0.0;
          all[region] +=
              (open ? static_cast<double>(outside_[i]) : 1.0) * static_cast<double>(potential_[i]);
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
      if (!solid_[i]) potential_[i] += static_cast<float>(shift[regions_.of[i]]);
    }
  });
  for (int axis = 0; axis < 3; ++axis) {
    const std::ptrdiff_t stride = layout_.stride[axis];
    const float* phi = potential_.data();
    const float* weight = weight_[axis].data();
    float* u = velocity_[axis].data();
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
  report_.courant = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const float most = greatest_of(velocity_[axis].data(), velocity_[axis].size());
    report_.courant = std::max(report_.courant, static_cast<double>(most) * dt / spacing_[axis]);
    speed = std::max(speed, most);
  }
  report_.speed = static_cast<double>(speed);

  for (std::size_t i = 0; i < inlets_.size(); ++i) {
    report_.inlets[i] = inlet_cells_[i].cells.empty() ? 0.0 : inlets_[i].flow;
  }
  for (std::size_t i = 0; i < evacuators_.size(); ++i) {
    report_.evacuators[i] = evacuator_cells_[i].cells.empty() ? 0.0 : evacuators_[i].flow;
  }
  for (std::size_t i = 0; i < leaks_.size(); ++i) {
    double sum = 0.0;
    for (std::size_t c = 0; c < leak_cells_[i].cells.size(); ++c) {
      sum += leak_cells_[i].weights[c] *
             static_cast<double>(potential_[static_cast<std::size_t>(leak_cells_[i].cells[c])]);
    }
    report_.leaks[i] = std::numbers::pi * leaks_[i].radius * sum;
  }
  report_.sides.fill(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    if (!parameters_.open[2 * axis] && !parameters_.open[2 * axis + 1]) continue;
    const double area = cell_volume() / spacing_[axis];
    layout_.rows([&](std::ptrdiff_t c, int length, int j, int k) {
      for (int i = 0; i < length; ++i) {
        const std::array<int, 3> at{i, j, k};
        const float* u = velocity_[axis].data() + c + i;
        if (at[axis] == 0) report_.sides[2 * axis] -= area * static_cast<double>(u[0]);
        if (at[axis] + 1 == layout_.n[axis]) {
          report_.sides[2 * axis + 1] += area * static_cast<double>(u[layout_.stride[axis]]);
        }
      }
    });
  }
  report_.displaced = 0.0;
  if (!solid_velocity_.empty()) {
    layout_.rows([&](std::ptrdiff_t c, int length, int, int) {
      for (std::ptrdiff_t i = c; i < c + length; ++i) {
        if (solid_[static_cast<std::size_t>(i)]) continue;
        for (int axis = 0; axis < 3; ++axis) {
          const double area = cell_volume() / spacing_[axis];
          const std::ptrdiff_t above = i + layout_.stride[axis];
          if (!free_[axis][static_cast<std::size_t>(i)]) {
            report_.displaced +=
                area * static_cast<double>(velocity_[axis][static_cast<std::size_t>(i)]);
          }
          if (!free_[axis][static_cast<std::size_t>(above)]) {
            report_.displaced -=
                area * static_cast<double>(velocity_[axis][static_cast<std::size_t>(above)]);
          }
        }
      }
    });
  }
  if (report_.speed <= parameters_.rest_speed && !driven()) {
    for (auto& faces : velocity_) std::ranges::fill(faces, 0.0f);
    std::ranges::fill(potential_, 0.0f);
    at_rest_ = true;
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
          velocity_[axis][f] = static_cast<float>(field(at)[axis]);
        }
      }
    }
  }
  at_rest_ = false;
}

Vec3 GasGrid::momentum() const {
  const double mass = parameters_.density * cell_volume();
  Vec3 sum = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t f = 0; f < velocity_[axis].size(); ++f) {
      if (!free_[axis][f]) continue;
      sum[axis] += mass * static_cast<double>(velocity_[axis][f]) + impulse_[axis][f];
    }
  }
  return sum;
}

double GasGrid::energy() const {
  const double mass = parameters_.density * cell_volume();
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t f = 0; f < velocity_[axis].size(); ++f) {
      const auto u = static_cast<double>(velocity_[axis][f]);
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
      if (solid_[i]) continue;
      double divergence = 0.0;
      for (int axis = 0; axis < 3; ++axis) {
        const float* u = velocity_[axis].data() + at;
        divergence += (static_cast<double>(u[layout_.stride[axis]]) - static_cast<double>(u[0])) /
                      spacing_[axis];
      }
      const double asked = static_cast<double>(source_[i]) - squeeze_[regions_.of[i]] -
                           static_cast<double>(opening_[i]) * static_cast<double>(potential_[i]);
      worst = std::max(worst, std::abs(divergence - asked));
    }
  });
  return report_.speed > 0.0 ? worst * spacing_.minCoeff() / report_.speed : 0.0;
}

std::size_t GasGrid::memory_bytes() const {
  // Bytes of the arrays over cells or faces: here, of advection and viscosity, and of the
  // pressure's grids, the coarse ones of which add a seventh.
  constexpr std::size_t kHere =
      3 * (1 + 3 * sizeof(float) + 2 * sizeof(double)) + 5 * sizeof(float) + sizeof(int) + 1;
  constexpr std::size_t kAdvection = 11 * sizeof(float), kViscosity = 18 * sizeof(float);
  constexpr std::size_t kPressure = 9 * sizeof(float) * 8 / 7 + 2 * sizeof(float);
  return static_cast<std::size_t>(layout_.count) * (kHere + kAdvection + kViscosity + kPressure) +
         solid_velocity_.capacity() * sizeof(Vec3f) + stencils_.memory_bytes();
}

}  // namespace viscera
