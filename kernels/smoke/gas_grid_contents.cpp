// What the gas of a grid is given, how it carries that, and how it rises by it.
#include <algorithm>
#include <cmath>

#include "kernels/smoke/gas_grid.h"
#include "kernels/smoke/gas_rows.h"
#include "kernels/smoke/gas_sampling.h"

namespace viscera {
namespace {

// What can be felt: 0.01 K lifts by 0.3 mm/s2, and 1e-6 kg/m3 of vapour as much; that much fog is
// seen in a kilometre.
constexpr double kLeastExcess = 0.01;    // [K]
constexpr double kLeastMass = 2e-5;      // of vapour and air [kg/m3]
constexpr double kLeastDroplets = 1e-6;  // [kg/m3]

constexpr double kLilly = 0.17;       // Cs [Lilly1967]
constexpr double kYoshizawa = 0.094;  // Ck, of k^(1/2) in the eddy viscosity [Yoshizawa1985]

bool sound(const GasSource& source) {
  const GasGift& gift = source.gift;
  return source.position.allFinite() && source.direction.allFinite() &&
         std::isfinite(source.radius) && std::isfinite(source.reach) && source.reach >= 0.0 &&
         std::isfinite(source.impulse) && std::isfinite(gift.volume) && std::isfinite(gift.heat) &&
         std::isfinite(gift.vapour) && gift.vapour >= 0.0;
}

}  // namespace

GasTransport::Least GasGrid::least() const {
  return {static_cast<float>(parameters_.mixture.heat_of(kLeastExcess)),
          static_cast<float>(kLeastMass), static_cast<float>(kLeastDroplets),
          static_cast<float>(kLeastMass)};
}

bool GasGrid::give(const GasSource& source) {
  if (!sound(source)) return false;
  const auto is_reached = [&](const Vec3& place) {
    return !spread_source(layout_, spacing_, regions_, place - parameters_.domain.min(),
                          source.radius)
                .cells.empty();
  };
  if (!is_reached(source.position)) return false;
  // A jet that the grid doesn't resolve sheds what it carries along its way, evenly: a share a
  // cell. What would come out in a solid comes out where the jet does.
  const double way = std::min(source.reach, parameters_.domain.diagonal().norm());
  const int count = 1 + static_cast<int>(way / spacing_.maxCoeff());
  GasSource part = source;
  part.reach = part.impulse = 0.0;
  part.gift.volume /= count, part.gift.heat /= count, part.gift.vapour /= count;
  for (int i = 0; i < count; ++i) {
    part.position = source.position + way * i / count * source.direction;
    if (i > 0 && !(parameters_.domain.contains(part.position) && is_reached(part.position)))
      part.position = source.position;
    state_.sources.push_back(part);
  }
  if (source.impulse != 0.0) push_along(source);
  return true;
}

/// The jet's momentum, evenly along its way: from half a cell on, so that tissue takes little of
/// it, and over one and a half cells at least, which gas is sampled over.
void GasGrid::push_along(const GasSource& source) {
  const double cell = spacing_.maxCoeff();
  const double first = 0.5 * cell, last = std::max(source.reach, 1.5 * cell);
  const int count = 2 + static_cast<int>((last - first) / cell);
  std::vector<Vec3f> places, impulses;
  for (int i = 0; i < count; ++i) {
    const double way = first + (last - first) * i / (count - 1);
    places.push_back((way * source.direction).cast<float>());
    impulses.push_back((source.impulse / count * source.direction).cast<float>());
  }
  place({source.position, StridedVectors<const float>(std::span<const Vec3f>(places))});
  add_momentum(StridedVectors<const float>(std::span<const Vec3f>(impulses)));
}

void GasGrid::move_contents(double dt) {
  state_.report.substeps = 0;
  state_.report.held = 0;
  if (!holds_any()) {
    state_.swelling.clear();
    return;
  }
  state_.swelling.assign(static_cast<std::size_t>(layout_.count), 0.0f);
  if (!felt_) return;
  std::ranges::fill(to_walls_, 0.0f);
  GasTransport::Flow flow;
  flow.velocity = &state_.velocity;
  flow.passes = &weight_;
  flow.solid = state_.solid;
  flow.sinks = sinks_;
  flow.walls = walls_;
  flow.spacing = spacing_;
  flow.diffusivity[kGasHeat] = parameters_.heat_diffusivity + parameters_.eddy_viscosity;
  flow.diffusivity[kGasVapour] = parameters_.vapour_diffusivity + parameters_.eddy_viscosity;
  flow.diffusivity[kGasDroplets] = parameters_.eddy_viscosity;
  flow.diffusivity[kGasAir] = parameters_.vapour_diffusivity + parameters_.eddy_viscosity;
  const GasTransport::Outcome outcome =
      transport_.move(flow, least(), dt, state_.contents, to_walls_);
  state_.report.substeps = outcome.substeps;
  state_.report.held = outcome.slowed;
  // What cools takes up less.
  const auto share = static_cast<float>(1.0 / (parameters_.mixture.full_heat() * dt));
  for_gas_rows(layout_, [&](std::ptrdiff_t c, int length, int, int) {
    for (auto i = static_cast<std::size_t>(c); i < static_cast<std::size_t>(c + length); ++i)
      state_.swelling[i] -= share * to_walls_[i];
  });
}

void GasGrid::take_sources(double dt) {
  const auto room = [&](GasKind kind) -> std::vector<float>& {
    std::vector<float>& values = state_.contents.of[kind];
    if (values.empty()) values.assign(static_cast<std::size_t>(layout_.count), 0.0f);
    return values;
  };
  const auto give_to = [&](const GasSpread& spread, GasKind kind, double amount) {
    if (amount == 0.0) return;
    std::vector<float>& values = room(kind);
    for (std::size_t i = 0; i < spread.cells.size(); ++i)
      values[static_cast<std::size_t>(spread.cells[i])] +=
          static_cast<float>(amount * spread.weights[i] / cell_volume());
  };
  GasBook& book = state_.contents.book;
  for (const GasSource& source : state_.sources) {
    const GasSpread spread = spread_source(
        layout_, spacing_, regions_, source.position - parameters_.domain.min(), source.radius);
    // Solids may have come over it since it was given.
    if (spread.cells.empty()) continue;
    give_to(spread, kGasHeat, source.gift.heat);
    give_to(spread, kGasVapour, source.gift.vapour);
    book.heat_given += source.gift.heat;
    book.water_given += source.gift.vapour;
    for (std::size_t i = 0; i < spread.cells.size(); ++i)
      state_.swelling[static_cast<std::size_t>(spread.cells[i])] +=
          static_cast<float>(source.gift.volume * spread.weights[i] / (cell_volume() * dt));
  }
  state_.sources.clear();
  const double air = 1.0 / parameters_.mixture.volume_of(gas::kAirMolarMass);
  for (std::size_t i = 0; i < state_.leaks.size(); ++i) {
    const double mass = -state_.leaks[i].flow * dt * air;
    if (!(mass > 0.0) || leak_cells_[i].cells.empty()) continue;
    give_to(leak_cells_[i], kGasAir, mass);
    book.air_given += mass;
  }
}

void GasGrid::condense(double dt) {
  GasContents& contents = state_.contents;
  if (!contents.has(kGasVapour) || state_.swelling.empty()) return;
  for (const GasKind kind : {kGasHeat, kGasDroplets})
    if (!contents.has(kind))
      contents.of[kind].assign(static_cast<std::size_t>(layout_.count), 0.0f);
  const GasMixture& mixture = parameters_.mixture;
  std::vector<float>&heat = contents.of[kGasHeat], &vapour = contents.of[kGasVapour],
  &droplets = contents.of[kGasDroplets];
  // Gas that isn't cooler than at rest saturates at no less than the resting gas.
  const auto dry =
      static_cast<float>(mixture.saturation(mixture.temperature) - mixture.resting_vapour());
  for_gas_rows(layout_, [&](std::ptrdiff_t c, int length, int, int) {
    for (auto i = static_cast<std::size_t>(c); i < static_cast<std::size_t>(c + length); ++i) {
      if (droplets[i] <= 0.0f && (vapour[i] <= 0.0f || (vapour[i] < dry && heat[i] >= 0.0f)))
        continue;
      auto condensed = static_cast<float>(mixture.condenses(contents.at(i), dt));
      // So little is gone at once.
      if (condensed <= 0.0f && droplets[i] + condensed < static_cast<float>(1e-2 * kLeastDroplets))
        condensed = -droplets[i];
      if (condensed == 0.0f) continue;
      vapour[i] -= condensed;
      droplets[i] += condensed;
      heat[i] += static_cast<float>(gas::kLatentHeat) * condensed;
      state_.swelling[i] +=
          static_cast<float>(mixture.swelling(static_cast<double>(condensed)) / dt);
    }
  });
}

/// Buoyancy: u' = g (rho0 - rho) / rho0, on faces between the cells that have it.
void GasGrid::lift(double dt) {
  const GasContents& contents = state_.contents;
  if (state_.swelling.empty() || !contents.any()) return;
  const double density = parameters_.mixture.density();
  for_gas_rows(layout_, [&](std::ptrdiff_t c, int length, int, int) {
    for (auto i = static_cast<std::size_t>(c); i < static_cast<std::size_t>(c + length); ++i)
      lack_[i] = static_cast<float>(parameters_.mixture.lack(contents.at(i)) / density);
  });
  const auto push = static_cast<float>(0.5 * parameters_.gravity * dt);
  const auto layer = static_cast<std::size_t>(layout_.stride[2]);
  for_gas_face_rows(layout_, 2, [&](std::ptrdiff_t c, int length, int, int) {
    for (auto f = static_cast<std::size_t>(c); f < static_cast<std::size_t>(c + length); ++f)
      if (free_[2][f]) state_.velocity[2][f] += push * (lack_[f] + lack_[f - layer]);
  });
}

/// What a cell that became solid held has gone.
void GasGrid::lose_contents(std::size_t cell) {
  GasContents& contents = state_.contents;
  if (!contents.any()) return;
  const GasContent held = contents.at(cell);
  const double volume = cell_volume();
  contents.book.heat_out += (held.heat - gas::kLatentHeat * held.droplets) * volume;
  contents.book.water_out += (held.vapour + held.droplets) * volume;
  contents.book.air_out += held.air * volume;
  for (std::vector<float>& kind : contents.of)
    if (!kind.empty()) kind[cell] = 0.0f;
}

void GasGrid::follow_contents() {
  felt_ = !transport_.box_of(state_.contents, least()).empty();
}

void GasGrid::find_eddies() {
  if (state_.at_rest) {
    std::ranges::fill(eddies_, 0.0f);
    return;
  }
  const double cell = std::cbrt(cell_volume());
  const auto scale = static_cast<float>(std::sqrt(2.0 / 3.0) * kLilly * kLilly / kYoshizawa * cell);
  const Vec3f per = spacing_.cwiseInverse().cast<float>();
  const auto& stride = layout_.stride;
  const GasFaces& u = state_.velocity;
  // Means over a cell's two faces, of a cell beside it: what crosses between the two is half their
  // difference's.
  const auto middle = [&](int axis, std::ptrdiff_t c) {
    return 0.5f * (u[axis][static_cast<std::size_t>(c)] +
                   u[axis][static_cast<std::size_t>(c + stride[axis])]);
  };
  const auto across = [&](int axis, int along, std::ptrdiff_t c) {
    return 0.5f * per[along] * (middle(axis, c + stride[along]) - middle(axis, c - stride[along]));
  };
  for_gas_rows(layout_, [&](std::ptrdiff_t c, int length, int, int) {
    for (std::ptrdiff_t i = c; i < c + length; ++i) {
      eddies_[static_cast<std::size_t>(i)] = 0.0f;
      if (state_.solid[static_cast<std::size_t>(i)]) continue;
      float square = 0.0f;
      for (int axis = 0; axis < 3; ++axis) {
        const float own = per[axis] * (u[axis][static_cast<std::size_t>(i + stride[axis])] -
                                       u[axis][static_cast<std::size_t>(i)]);
        const int b = (axis + 1) % 3;
        const float shear = across(axis, b, i) + across(b, axis, i);
        square += 2.0f * own * own + shear * shear;
      }
      eddies_[static_cast<std::size_t>(i)] = scale * std::sqrt(square);
    }
  });
}

GasContent GasGrid::content(int i, int j, int k) const {
  return state_.contents.at(static_cast<std::size_t>(layout_.index(i, j, k)));
}

double GasGrid::excess(const Vec3& world) const {
  if (!state_.contents.has(kGasHeat)) return 0.0;
  const Vec3f at = (world - parameters_.domain.min()).cwiseQuotient(spacing_).cast<float>();
  return parameters_.mixture.excess_of(static_cast<double>(
      interpolate(layout_, state_.contents.of[kGasHeat].data(), cell_stencil(layout_, at))));
}

double GasGrid::droplets(const Vec3& world) const {
  if (!state_.contents.has(kGasDroplets)) return 0.0;
  const Vec3f at = (world - parameters_.domain.min()).cwiseQuotient(spacing_).cast<float>();
  return static_cast<double>(
      interpolate(layout_, state_.contents.of[kGasDroplets].data(), cell_stencil(layout_, at)));
}

void GasGrid::eddies(std::span<float> speeds) const {
  stencils_.read_cells(eddies_, speeds);
}

void GasGrid::excess(std::span<float> kelvin) const {
  if (!state_.contents.has(kGasHeat)) {
    std::ranges::fill(kelvin, 0.0f);
    return;
  }
  stencils_.read_cells(state_.contents.of[kGasHeat], kelvin);
  parallel_for_each_index(kelvin.size(), 4096, [&](std::size_t i) {
    kelvin[i] = static_cast<float>(parameters_.mixture.excess_of(static_cast<double>(kelvin[i])));
  });
}

}  // namespace viscera
