#include "kernels/hive/nonlinear_hive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "kernels/contact/cell_pattern.h"
#include "kernels/hive/axial_tissue.h"
#include "kernels/hive/pressed_cells.h"

namespace viscera {
namespace {

using RingVector = AxialTissue::RingVector;
using RingMatrix = AxialTissue::RingMatrix;

/// A step this small [radii of the pattern] ends Newton's: the force of the linearisation is then
/// right to its square.
constexpr double kSettled = 0.015;
/// Tissue that gave way is followed again where its force is this near to what its last good
/// tangent foretells.
constexpr double kBelieved = 0.02;
/// No node goes farther in one step.
constexpr double kFarthestStep = 0.2;
/// Beyond this share of the ball's radius its profile goes on straight.
constexpr double kSteepest = 0.97;
/// A ring that moves aside on a steeper part would run away in one step; Newton's then takes more.
constexpr double kMostCurved = 2.0;
/// The force is asked again this much deeper [radii of the pattern], for its slope.
constexpr double kNudge = 1e-4;
constexpr int kFewestNodes = 28, kMostNodes = 2000;

/// Where the cells of a pattern of pitch 1 / (rings + 0.1) lie: ring of each; of each ring the
/// cells' radius, and where rings of the cells' areas end.
struct Pattern {
  std::vector<int> ring_of;
  std::vector<double> radius, end;
  std::vector<int> count;

  explicit Pattern(int rings) {
    radius.assign(static_cast<std::size_t>(rings + 1), 0.0);
    count.assign(radius.size(), 0);
    for (const Vec2& place : hexagonal_grid(1.0, rings).places) {
      // A ring's cells lie between sqrt(3)/2 j and j.
      const int ring = static_cast<int>(std::ceil(place.norm() - 1e-9));
      ring_of.push_back(ring);
      radius[static_cast<std::size_t>(ring)] += place.squaredNorm();
      ++count[static_cast<std::size_t>(ring)];
    }
    double area = 0.0;
    for (std::size_t j = 0; j < radius.size(); ++j) {
      radius[j] = std::sqrt(radius[j] / count[j]) / (rings + 0.1);
      area += count[j] * std::sqrt(0.75);
      end.push_back(std::sqrt(area / std::numbers::pi) / (rings + 0.1));
    }
  }
};

/// How far above its lowest point a ball of radius R is beside its axis, its slope and the slope's.
struct BallProfile {
  double height, slope, curvature;

  BallProfile(double r, double ball) {
    const double at = std::min(r, kSteepest * ball), across = std::sqrt(ball * ball - at * at);
    height = ball - across;
    slope = at / across;
    curvature = 1.0 / across + at * at / (across * across * across);
    if (r > at) {
      height += slope * (r - at);
      curvature = 0.0;
    }
  }
};

}  // namespace

struct NonlinearHive::Data {
  NonlinearSettings settings;
  Pattern pattern;
  AxialTissue tissue;
  RingMatrix linear_stiffness;  ///< of the linear grid
  int cells;
  std::vector<PressedCells> pressed;  ///< of each hive

  Tangent tangent;
  bool has_tangent = false;
  bool astray = false;  ///< the last good tangent answers until the tissue is found again
  Tangent good;         ///< with the state that the last settled tick left; none: empty
  std::vector<double> good_state;
  RingVector good_sums;
  RingVector force_sums;  ///< of the rings' cells, of the state's contact

  MatrixX left, shares;  ///< (cells x rings): A P^T; M P^T
  MatrixX compliance;    ///< M, cells x cells
  VectorX moved, wanted;

  explicit Data(const NonlinearSettings& wanted_settings)
      : settings(wanted_settings),
        pattern(settings.rings),
        tissue(AxialGrid::graded(pattern.end, settings.nodes), pattern.end, settings.model,
               settings.material.lame_lambda() / settings.material.shear_modulus()),
        cells(static_cast<int>(pattern.ring_of.size())) {
    for (std::size_t i = 0; i < kMostHives; ++i) pressed.emplace_back(cells);
    AxialTissue linear(AxialGrid::graded(pattern.end, settings.nodes), pattern.end,
                       HyperelasticModel::kLinear,
                       settings.material.lame_lambda() / settings.material.shear_modulus());
    const RingVector none = RingVector::Zero(linear.rings());
    linear.linearise(none, none);
    linear_stiffness = linear.linearisation().stiffness;
    good_state.resize(tissue.state().size());
    left.resize(cells, linear.rings());
    shares.resize(cells, linear.rings());
    compliance.resize(cells, cells);
    moved.resize(cells);
    wanted.resize(cells);
    force_sums.setZero(linear.rings());
  }

  int ring_of(int cell) const { return pattern.ring_of[static_cast<std::size_t>(cell)]; }
  double mean(int ring) const { return 1.0 / pattern.count[static_cast<std::size_t>(ring)]; }

  struct Contact {
    bool sound = false;
    double force = 0.0, energy = 0.0, stiffness = 0.0;
    int touching = 0, factorisations = 0;
    RingVector v, force_sums;
  };
  void release() noexcept;
  void keep() noexcept;
  void recall() noexcept;
  bool linearise(double ball, bool follow) noexcept;
  Contact touch(int which, const Hive& hive, double unit_length, double unit_compliance,
                std::span<const double> depths) noexcept;
  Contact touch_all(std::span<const Share> hives, std::span<const double> depths,
                    double across) noexcept;
};

void NonlinearHive::Data::release() noexcept {
  tissue.reset();
  force_sums.setZero();
  has_tangent = false;
  good.v.resize(0);
  astray = false;
}

void NonlinearHive::Data::keep() noexcept {
  good = tangent;
  std::copy(tissue.state().begin(), tissue.state().end(), good_state.begin());
  good_sums = force_sums;
}

void NonlinearHive::Data::recall() noexcept {
  if (good.v.size() == 0) return release();
  tangent = good;
  has_tangent = true;
  std::copy(good_state.begin(), good_state.end(), tissue.state().begin());
  force_sums = good_sums;
}

/// About the grid's present state -> tangent; false keeps the last one. `follow`: loads grow with
/// the ball's slope as rings move aside.
bool NonlinearHive::Data::linearise(double ball, bool follow) noexcept {
  const int g = tissue.rings();
  const RingVector aside = tissue.lateral();
  RingVector load(g), growth(g), offset(g), slope(g);
  for (int j = 0; j < g; ++j) {
    const double radius = pattern.radius[static_cast<std::size_t>(j)];
    const BallProfile rest(radius, ball),
        now(std::max(0.0, radius + (j > 0 ? aside[j] : 0.0)), ball);
    offset[j] = now.height - rest.height;
    slope[j] = now.slope;
    load[j] = force_sums[j] * now.slope;
    growth[j] = force_sums[j] * std::min(now.curvature, kMostCurved);
  }
  if (!follow) growth.setZero();
  if (!tissue.linearise(load, growth)) return false;
  tangent.grid = tissue.linearisation();
  tangent.v = tissue.displacement();
  tangent.load_factor = force_sums;
  tangent.offset = offset;
  tangent.slope = slope;
  tangent.at = aside;
  tangent.ball = ball;
  tangent.energy = tissue.energy();
  has_tangent = true;
  return true;
}

/// The cells' complementarity problem with the tangent. With K = S - S_L what the grid adds to the
/// rings' stiffness, T the ball's slopes, C and Y the grid's cross and yield, P means over rings
/// and P1 sums:
///   forces   (1 + P^T C^T T P1) f = (A^-1 + P^T K P) v + P^T h = M^-1 v + P^T h,
///            h = reaction - S v0 + C^T T f0
///   places   (1 + P1^T T C P) v + P1^T T Y T P1 f
///              >= depth - P1^T (offset + T (lateral - at - C v0 - Y T f0))
/// With B = 1 + P1^T T C P and v from the first, the matrix before f is B M B^T + P1^T T Y T P1,
/// which is symmetric.
NonlinearHive::Data::Contact NonlinearHive::Data::touch(int which, const Hive& hive,
                                                        double unit_length, double unit_compliance,
                                                        std::span<const double> depths) noexcept {
  Contact out;
  const int n = cells, g = tissue.rings();
  const auto a = hive.compliance();
  if (a.rows() != n) return out;
  const double scale = 1.0 / unit_compliance;
  const Tangent& t = tangent;

  // M = A - A P^T (1 + K P A P^T)^-1 K P A
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < g; ++j) left(k, j) = 0.0;
  for (int l = 0; l < n; ++l) {
    const double share = scale * mean(ring_of(l));
    for (int k = 0; k < n; ++k) left(k, ring_of(l)) += share * a(k, l);
  }
  RingMatrix ring_compliance = RingMatrix::Zero(g, g);
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < g; ++j) ring_compliance(ring_of(k), j) += mean(ring_of(k)) * left(k, j);
  const RingMatrix added = t.grid.stiffness - linear_stiffness;
  RingMatrix system = RingMatrix::Identity(g, g);
  system.noalias() += added.lazyProduct(ring_compliance);
  // Gauss with row exchanges on [system | added].
  RingMatrix inner = added;
  for (int k = 0; k < g; ++k) {
    int best = k;
    for (int i = k + 1; i < g; ++i)
      if (std::abs(system(i, k)) > std::abs(system(best, k))) best = i;
    if (!(std::abs(system(best, k)) > 1e-9)) return out;
    for (int j = 0; j < g; ++j) {
      std::swap(system(k, j), system(best, j));
      std::swap(inner(k, j), inner(best, j));
    }
    for (int i = 0; i < g; ++i) {
      if (i == k) continue;
      const double f = system(i, k) / system(k, k);
      for (int j = 0; j < g; ++j) {
        system(i, j) -= f * system(k, j);
        inner(i, j) -= f * inner(k, j);
      }
    }
  }
  for (int k = 0; k < g; ++k)
    for (int j = 0; j < g; ++j) inner(k, j) /= system(k, k);
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < g; ++j) {
      double sum = 0.0;
      for (int i = 0; i < g; ++i) sum += left(k, i) * inner(i, j);
      shares(k, j) = sum;
    }
  for (int l = 0; l < n; ++l)
    for (int k = l; k < n; ++k) {
      double sum = scale * a(k, l);
      for (int j = 0; j < g; ++j) sum -= shares(k, j) * left(l, j);
      compliance(k, l) = compliance(l, k) = sum;
    }
  // shares = M P^T from now on.
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < g; ++j) shares(k, j) = 0.0;
  for (int l = 0; l < n; ++l)
    for (int k = 0; k < n; ++k) shares(k, ring_of(l)) += mean(ring_of(l)) * compliance(k, l);
  RingMatrix ring_means = RingMatrix::Zero(g, g);  // P M P^T
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < g; ++j) ring_means(ring_of(k), j) += mean(ring_of(k)) * shares(k, j);

  const RingMatrix slanted = t.slope.asDiagonal() * t.grid.cross;  // T C
  // B M B^T + P1^T T Y T P1, B = 1 + P1^T T C P
  RingMatrix ring_part =
      slanted.lazyProduct(RingMatrix(ring_means.lazyProduct(slanted.transpose())));
  for (int i = 0; i < g; ++i)
    for (int j = 0; j < g; ++j) ring_part(i, j) += t.slope[i] * t.grid.yield(i, j) * t.slope[j];
  Eigen::Ref<MatrixX> matrix = pressed[static_cast<std::size_t>(which)].begin(n);
  for (int l = 0; l < n; ++l)
    for (int k = l; k < n; ++k) {
      double sum = compliance(k, l) + ring_part(ring_of(k), ring_of(l));
      for (int j = 0; j < g; ++j)
        sum += shares(k, j) * slanted(ring_of(l), j) + slanted(ring_of(k), j) * shares(l, j);
      matrix(k, l) = sum;
    }
  PressedCells& cells_of = pressed[static_cast<std::size_t>(which)];
  if (!cells_of.check()) return out;

  RingVector loads = t.slope.cwiseProduct(t.load_factor);
  RingVector h = t.grid.reaction;
  h -= t.grid.stiffness.lazyProduct(t.v);
  h += t.grid.cross.transpose().lazyProduct(loads);
  RingVector gap = t.grid.lateral - t.at;
  gap -= t.grid.cross.lazyProduct(t.v);
  gap -= t.grid.yield.lazyProduct(loads);
  const RingVector shift = t.offset + t.slope.cwiseProduct(gap);
  const RingVector ring_h = ring_means.lazyProduct(h);
  const RingVector slant_h = slanted.lazyProduct(ring_h);
  const auto fill = [&](double deeper) {
    for (int k = 0; k < n; ++k) {
      double sum = depths[static_cast<std::size_t>(k)] / unit_length + deeper - shift[ring_of(k)] +
                   slant_h[ring_of(k)];
      for (int j = 0; j < g; ++j) sum += shares(k, j) * h[j];
      wanted[k] = sum;
    }
  };
  const auto total = [&] {
    double sum = 0.0;
    for (const double f : cells_of.forces()) sum += f;
    return sum;
  };
  fill(kNudge);
  const std::span<const double> asked(wanted.data(), static_cast<std::size_t>(n));
  const bool deeper = cells_of.solve(asked).converged;
  const double more = total();
  fill(0.0);
  const PressedCells::Figures figures = cells_of.solve(asked);
  if (!figures.converged || !deeper) return out;
  const std::span<const double> forces = cells_of.forces();
  out.force = total();
  out.stiffness = std::max(0.0, (more - out.force) / kNudge);
  out.touching = figures.touching;
  out.factorisations = figures.factorisations;
  out.force_sums.setZero(g);
  for (int k = 0; k < n; ++k) out.force_sums[ring_of(k)] += forces[static_cast<std::size_t>(k)];
  // v = M (B^T f - P^T h);  A^-1 v = B^T f - P^T h - P^T K P v
  const RingVector aside = slanted.transpose().lazyProduct(out.force_sums);
  RingVector pull = aside - h;
  out.v.setZero(g);
  for (int k = 0; k < n; ++k) {
    double sum = 0.0;
    for (int l = 0; l < n; ++l) sum += compliance(k, l) * forces[static_cast<std::size_t>(l)];
    for (int j = 0; j < g; ++j) sum += shares(k, j) * pull[j];
    moved[k] = sum;
    out.v[ring_of(k)] += mean(ring_of(k)) * sum;
  }
  pull -= added.lazyProduct(out.v);
  double energy = 0.0;
  for (int k = 0; k < n; ++k)
    energy += 0.5 * moved[k] *
              (forces[static_cast<std::size_t>(k)] + mean(ring_of(k)) * pull[ring_of(k)]);
  // The grids', to second order about the state.
  const RingVector dv = out.v - t.v;
  energy += t.energy + dv.dot(t.grid.reaction) +
            0.5 * dv.dot(RingVector(t.grid.stiffness.lazyProduct(dv)));
  energy -= 0.5 * out.v.dot(RingVector(linear_stiffness.lazyProduct(out.v)));
  out.energy = energy;
  out.sound = true;
  return out;
}

NonlinearHive::Data::Contact NonlinearHive::Data::touch_all(std::span<const Share> hives,
                                                            std::span<const double> depths,
                                                            double across) noexcept {
  const int g = tissue.rings();
  Contact all;
  all.v.setZero(g);
  all.force_sums.setZero(g);
  double weights = 0.0;
  const double unit_compliance = 1.0 / (settings.material.shear_modulus() * across);
  for (std::size_t i = 0; i < hives.size(); ++i) {
    const double modulus = hives[i].hive->relative_modulus();
    const Contact one =
        touch(static_cast<int>(i), *hives[i].hive, across, unit_compliance / modulus, depths);
    if (!one.sound) return Contact();
    const double weight = hives[i].weight;
    weights += weight;
    all.force += weight * modulus * one.force;
    all.energy += weight * modulus * one.energy;
    all.stiffness += weight * modulus * one.stiffness;
    all.v += weight * one.v;
    all.force_sums += weight * one.force_sums;
    all.touching = std::max(all.touching, one.touching);
    all.factorisations += one.factorisations;
  }
  if (!(weights > 0.0)) return Contact();
  // The answer may be a share of a contact; the grid's state is that of a whole one.
  all.v /= weights;
  all.force_sums /= weights;
  all.sound = true;
  return all;
}

NonlinearHive::NonlinearHive(std::unique_ptr<Data> data) : data_(std::move(data)) {}
NonlinearHive::NonlinearHive(NonlinearHive&&) noexcept = default;
NonlinearHive& NonlinearHive::operator=(NonlinearHive&&) noexcept = default;
NonlinearHive::~NonlinearHive() = default;

Result<NonlinearHive> NonlinearHive::create(const NonlinearSettings& settings) {
  Error mistakes;
  const auto mistake = [&](std::string text) {
    mistakes.messages.push_back("non-linear hive: " + std::move(text));
  };
  if (settings.model == HyperelasticModel::kLinear)
    mistake("model: found linear, expected stvk or neo_hookean");
  if (settings.rings < 1 || settings.rings > AxialTissue::kMostRings - 1)
    mistake("rings: found " + std::to_string(settings.rings) + ", expected from 1 to " +
            std::to_string(AxialTissue::kMostRings - 1));
  if (settings.nodes < kFewestNodes || settings.nodes > kMostNodes)
    mistake("nodes: found " + std::to_string(settings.nodes) + ", expected from " +
            std::to_string(kFewestNodes) + " to " + std::to_string(kMostNodes));
  if (settings.most_steps < 1)
    mistake("steps: found " + std::to_string(settings.most_steps) + ", expected 1 or more");
  const IsotropicMaterial& material = settings.material;
  if (!(material.youngs_modulus > 0.0) || !std::isfinite(material.youngs_modulus))
    mistake("Young's modulus: found " + std::to_string(material.youngs_modulus) +
            " Pa, expected above 0");
  if (!(material.poisson_ratio >= 0.0 && material.poisson_ratio < 0.5))
    mistake("Poisson's ratio: found " + std::to_string(material.poisson_ratio) +
            ", expected from 0 to below 0.5");
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return NonlinearHive(std::make_unique<Data>(settings));
}

void NonlinearHive::release() noexcept {
  data_->release();
}

NonlinearForce NonlinearHive::press(std::span<const Share> hives, std::span<const double> depths,
                                    double across, double ball_radius, TimeIsUp time) noexcept {
  Data& d = *data_;
  NonlinearForce out;
  if (hives.empty() || hives.size() > kMostHives) return out;
  out.hive.verdict = HiveVerdict::kTooMany;
  if (depths.size() != static_cast<std::size_t>(d.cells)) return out;
  out.hive.verdict = HiveVerdict::kNotFinite;
  for (const double depth : depths)
    if (!std::isfinite(depth)) return out;
  if (!(across > 0.0) || !(ball_radius > 0.0) || !std::isfinite(across) ||
      !std::isfinite(ball_radius))
    return out;
  const double ball = std::max(ball_radius / across, 1.0);
  Data::Contact contact, foretold;
  bool settled = false;
  const bool astray = d.astray;
  if (astray) {
    d.recall();
    foretold = d.touch_all(hives, depths, across);
  }
  while (out.steps < d.settings.most_steps && !settled) {
    if (d.has_tangent && time) {
      out.out_of_time = true;
      break;
    }
    ++out.steps;
    bool good = false;
    for (const bool follow : {true, false}) {
      good = d.linearise(ball, follow);
      if (good) contact = d.touch_all(hives, depths, across);
      good = good && contact.sound;
      if (good) break;
    }
    if (!good) {
      // The tissue gives way, or the step went astray: back to where all was well.
      d.recall();
      contact = d.has_tangent ? d.touch_all(hives, depths, across) : Data::Contact();
      d.astray = d.has_tangent;
      break;
    }
    const RingVector loads =
        d.tangent.slope.cwiseProduct(RingVector(contact.force_sums - d.force_sums));
    double share = 1.0;
    const double far =
        d.tissue.advance(contact.v - d.tissue.displacement(), loads, kFarthestStep, share);
    d.force_sums += share * (contact.force_sums - d.force_sums);
    settled = far < kSettled;
  }
  // From where the tissue gave way there may be a way to another equilibrium, with another force.
  if (astray && foretold.sound &&
      !(settled && std::abs(contact.force - foretold.force) <= kBelieved * foretold.force)) {
    d.recall();
    contact = d.touch_all(hives, depths, across);  // what was foretold, with the cells' forces
    settled = false;
  } else if (settled) {
    d.keep();
    d.astray = false;
  }
  if (out.steps == 0) contact = d.touch_all(hives, depths, across);
  out.by_tangent = !settled;
  out.hive.verdict = contact.sound ? HiveVerdict::kSound : HiveVerdict::kNotPositive;
  if (!contact.sound) return out;
  const double unit_force = d.settings.material.shear_modulus() * across * across;
  for (std::size_t i = 0; i < hives.size(); ++i) {
    const std::span<const double> forces = d.pressed[i].forces();
    for (std::size_t k = 0; k < forces.size(); ++k)
      d.moved[static_cast<Eigen::Index>(k)] =
          unit_force * hives[i].hive->relative_modulus() * forces[k];
    hives[i].hive->load({d.moved.data(), forces.size()});
  }
  out.hive.force = Vec3(0.0, 0.0, unit_force * contact.force);
  out.hive.energy = std::max(0.0, unit_force * across * contact.energy);
  out.hive.touching = contact.touching;
  out.hive.factorisations = contact.factorisations;
  out.stiffness = unit_force / across * contact.stiffness;
  return out;
}

NonlinearHive::State NonlinearHive::state() const {
  const Data& d = *data_;
  const std::span<const double> displacements = std::as_const(d.tissue).state();
  State state;
  state.now = {{displacements.begin(), displacements.end()}, d.force_sums};
  state.has_tangent = d.has_tangent;
  if (d.has_tangent) state.tangent = d.tangent;
  state.astray = d.astray;
  state.has_good = d.good.v.size() > 0;
  if (state.has_good) {
    state.good = d.good;
    state.good_place = {d.good_state, d.good_sums};
  }
  for (std::size_t i = 0; i < kMostHives; ++i)
    state.pressed[i].active = d.pressed[i].state().active;  // its matrix is made in every step
  return state;
}

void NonlinearHive::restore(const State& state) {
  Data& d = *data_;
  std::copy(state.now.displacements.begin(), state.now.displacements.end(),
            d.tissue.state().begin());
  d.force_sums = state.now.force_sums;
  d.tangent = state.tangent;
  d.has_tangent = state.has_tangent;
  d.astray = state.astray;
  d.good = state.good;
  if (state.has_good) {
    d.good_state = state.good_place.displacements;
    d.good_sums = state.good_place.force_sums;
  }
  for (std::size_t i = 0; i < kMostHives; ++i) d.pressed[i].restore(state.pressed[i]);
}

bool NonlinearHive::fits(const State& state) const noexcept {
  const Data& d = *data_;
  const Eigen::Index g = d.tissue.rings();
  const auto ring = [&](const RingVector& one, bool there) {
    return one.size() == (there ? g : 0);
  };
  const auto matrix = [&](const RingMatrix& one, bool there) {
    return one.rows() == (there ? g : 0) && one.cols() == (there ? g : 0);
  };
  const auto tangent = [&](const Tangent& one, bool there) {
    return ring(one.grid.reaction, there) && ring(one.grid.lateral, there) &&
           matrix(one.grid.stiffness, there) && matrix(one.grid.cross, there) &&
           matrix(one.grid.yield, there) && ring(one.v, there) && ring(one.load_factor, there) &&
           ring(one.offset, there) && ring(one.slope, there) && ring(one.at, there);
  };
  const auto place = [&](const Place& one, bool there) {
    return one.displacements.size() == (there ? d.good_state.size() : 0) &&
           ring(one.force_sums, there);
  };
  if (state.astray && !state.has_good) return false;
  if (!place(state.now, true) || !place(state.good_place, state.has_good)) return false;
  if (!tangent(state.tangent, state.has_tangent) || !tangent(state.good, state.has_good))
    return false;
  for (std::size_t i = 0; i < kMostHives; ++i) {
    const PressedCells::State& one = state.pressed[i];
    const bool sized = one.active.empty() || one.active.size() == static_cast<std::size_t>(d.cells);
    if (!sized || !one.factored.empty() || !d.pressed[i].fits(one)) return false;
  }
  return true;
}

int NonlinearHive::nodes() const noexcept {
  return data_->tissue.nodes();
}
int NonlinearHive::unknowns() const noexcept {
  return data_->tissue.unknowns();
}
const NonlinearSettings& NonlinearHive::settings() const noexcept {
  return data_->settings;
}

}  // namespace viscera
