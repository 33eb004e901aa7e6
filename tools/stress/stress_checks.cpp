#include "tools/stress/stress_checks.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/paff/local_spacing.h"
#include "kernels/paff/surface_quadrature.h"

namespace viscera {
namespace {

constexpr double kDouble = 0x1.0p-53;  // relative error of one rounding
constexpr double kSingle = 0x1.0p-24;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// PatchContact adds 1e-6 of itself to the diagonal of the contact matrix A. Scaled to a diagonal
/// of one (which Cholesky's round-off doesn't see), A has eigenvalues between 1e-6 and the number
/// of unknowns n: a solve is off by n / 1e-6 times the rounding error, relative.
double contact_round_off(const ContactMoment& moment) {
  double unknowns = 0.0;
  for (const ContactCell& cell : moment.cells) unknowns += cell.held ? 3.0 : 1.0;
  return unknowns * kDouble / 1e-6;
}

/// What a cell is told to do, along which its force works [m].
Vec3 wanted(const ContactCell& cell) {
  return cell.held ? cell.displacement : Vec3(cell.depth * cell.direction);
}

double work(const ContactMoment& force, const ContactMoment& path) {
  double sum = 0.0;
  for (std::size_t k = 0; k < force.cells.size(); ++k)
    sum += force.forces[k].dot(wanted(path.cells[k]));
  return sum;
}

/// Sum of |f| |d|: what the energies are differences of.
double exchanged(const ContactMoment& force, const ContactMoment& path) {
  double sum = 0.0;
  for (std::size_t k = 0; k < force.cells.size(); ++k)
    sum += force.forces[k].norm() * wanted(path.cells[k]).norm();
  return sum;
}

bool is_symmetric(const SurfaceCompliance& compliance) {
  const std::vector<std::size_t> rows = compliance.touchable_rows();
  for (std::size_t j = 0; j < rows.size(); ++j)
    for (std::size_t i = 0; i < j; ++i)
      if (compliance.columns[j * compliance.rows() + rows[i]] !=
          compliance.columns[i * compliance.rows() + rows[j]])
        return false;
  return true;
}

// Storing rounds each entry by a share of 2^-24, the mean of two mirrored ones by 2^-24 again: the
// matrix of these errors is in 2-norm at most 2^-23 of the Frobenius norm. So the least eigenvalue
// may be negative by that much, and no more. Whether C + 2^-23 |C| is positive is what a Cholesky
// factorisation tells. Dense and apart from smallest_compliance_eigenvalue() (kernels/paff), which
// is what preparation goes by.
/// Least eigenvalue of the symmetric part of the touchable square over its Frobenius norm, where it
/// is below what rounding explains; else 0. NaN where an entry isn't finite.
double negative_eigenvalue(const SurfaceCompliance& compliance) {
  constexpr double kRounding = 0x1.0p-23;
  const std::vector<std::size_t> rows = compliance.touchable_rows();
  const auto n = static_cast<Eigen::Index>(rows.size());
  MatrixX part(n, n);
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = 0; i < n; ++i)
      part(i, j) = compliance.columns[static_cast<std::size_t>(j) * compliance.rows() +
                                      rows[static_cast<std::size_t>(i)]];
  part = (0.5 * (part + part.transpose())).eval();
  const double size = part.norm();
  if (!std::isfinite(size)) return std::numeric_limits<double>::quiet_NaN();
  if (size == 0.0) return 0.0;
  part.diagonal().array() += kRounding * size;
  if (const Eigen::LLT<MatrixX> factor(part); factor.info() == Eigen::Success) return 0.0;
  part.diagonal().array() -= kRounding * size;
  const Eigen::SelfAdjointEigenSolver<MatrixX> modes(part, Eigen::EigenvaluesOnly);
  return modes.eigenvalues()[0] / size;
}

/// visit(J, phi_J) for the fields at a place.
template <class Visit>
void for_each_field(const SurfacePlaces& places, std::size_t place, const Visit& visit) {
  const SparseWeights& fields = places.fields;
  for (int e = fields.row_begin[place]; e < fields.row_begin[place + 1]; ++e) {
    const auto entry = static_cast<std::size_t>(e);
    visit(static_cast<std::size_t>(fields.nodes[entry]), static_cast<double>(fields.values[entry]));
  }
}

}  // namespace

std::string unclear_refusal(const std::string& reason) {
  if (reason.empty()) return "no reason given";
  for (const char* word : {"expected", "use ", "make ", "must ", "remove ", "raise ", "choose "})
    if (reason.find(word) != std::string::npos) return "";
  return "the reason names nothing to change: " + reason;
}

// u = G (x - x0) with a G of every component: tension, shear and turning in one. The stress is
// constant, so that tractions sigma n on the free surface and u on the held one are all its loads.
// Moving least squares carry linear fields exactly, hence any formulation owes this one to
// round-off: 1e-9 of it. But the quadratures of volume and surface may disagree by 1e-11 of what
// they sum (consistent_gradients.cpp), as if so much of the stress were missing from the surface,
// and a long thin body near incompressible moves far under little: 55 nodes of a wall held at its
// end, nu 0.499, erred by 6e-9. So 1e-11 of what tractions of the stress's size do, along each
// axis, is let pass, too.
Result<StressFigure> check_linear_field(const StressBody& body, const Formulation& formulation,
                                        ElasticSolver& solver, const TouchableSurface& touch) {
  Mat3 gradient;
  gradient << 0.7, -0.3, 0.2, 0.5, -0.4, 0.6, -0.1, 0.8, 0.3;
  const Mat3 strain = 0.5 * (gradient + gradient.transpose());
  const double lambda = body.material.lame_lambda(), mu = body.material.shear_modulus();
  const Mat3 stress = lambda * strain.trace() * Mat3::Identity() + 2.0 * mu * strain;
  const Vec3 centre = bounds(body.surface).center();
  StaticLoads loads;
  loads.traction = [&](const Vec3&, const Vec3& normal) -> Vec3 { return stress * normal; };
  loads.held_displacement = [&](const Vec3& x) -> Vec3 { return gradient * (x - centre); };
  auto unknowns = solver.solve_static(loads);
  if (!unknowns) return std::unexpected(unknowns.error());

  std::array<std::vector<double>, 3> moved;
  for (int axis = 0; axis < 3; ++axis) {
    StaticLoads pull;
    pull.traction = [&](const Vec3&, const Vec3&) -> Vec3 {
      return stress.norm() * Vec3::Unit(axis);
    };
    auto found = solver.solve_static(pull);
    if (!found) return std::unexpected(found.error());
    moved[static_cast<std::size_t>(axis)] = std::move(*found);
  }

  // The stored weights are single: here the fields themselves are asked.
  const ShapeFunctions fields = formulation.fields(body.surface, body.cloud);
  ShapeValues values;
  const auto at_place = [&](const std::vector<double>& of) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t j = 0; j < values.nodes.size(); ++j)
      sum += values.values[j] * Vec3::Map(of.data() + 3 * values.nodes[j]);
    return sum;
  };
  double greatest = 0.0, error = 0.0, farthest = 0.0;
  bool finite = true;
  for (std::size_t s = 0; s < touch.size(); ++s) {
    if (!fields.evaluate(touch.positions[s], false, values)) continue;
    const Vec3 found = at_place(*unknowns);
    for (const std::vector<double>& one : moved)
      farthest = std::max(farthest, at_place(one).norm());
    const Vec3 exact = gradient * (touch.positions[s] - centre);
    finite = finite && found.allFinite();
    greatest = std::max(greatest, exact.norm());
    error = std::max(error, (found - exact).norm());
  }
  const double let_pass = std::max(1e-9, 1e-11 * farthest / greatest);
  return StressFigure{"linear field", finite ? error / greatest : kInfinite, let_pass, ""};
}

StressFigure check_finite(const SurfaceCompliance& compliance) {
  const auto broken = std::count_if(compliance.columns.begin(), compliance.columns.end(),
                                    [](float c) { return !std::isfinite(c); });
  return {"finite compliance", static_cast<double>(broken), 0.0, ""};
}

StressFigure check_positive(const SurfaceCompliance& compliance) {
  StressFigure figure{"positive compliance", -negative_eigenvalue(compliance), 0.0, ""};
  if (compliance.symmetric && !is_symmetric(compliance)) {
    figure.figure = kInfinite;
    figure.detail = "not symmetric";
  }
  return figure;
}

// Single precision is kept while one answer errs by 1e-5; others may err ten times as much. Still
// well below what any discretisation errs.
Result<StressFigure> check_against_solver(ElasticSolver& solver, const SurfacePlaces& places,
                                          const SurfaceCompliance& compliance, Draws draws) {
  std::vector<double> loads(solver.figures().unknowns, 0.0);
  std::vector<double> stored(compliance.rows(), 0.0);
  for (int i = 0; i < 3; ++i) {
    const auto t =
        static_cast<std::size_t>(draws.below(static_cast<int>(compliance.touchable.size())));
    const Vec3 force = draws.direction();
    for_each_field(
        places, static_cast<std::size_t>(compliance.touchable[t]),
        [&](std::size_t node, double phi) { Vec3::Map(loads.data() + 3 * node) += phi * force; });
    for (int a = 0; a < 3; ++a) {
      const float* column =
          compliance.columns.data() + (3 * t + static_cast<std::size_t>(a)) * compliance.rows();
      for (std::size_t row = 0; row < stored.size(); ++row)
        stored[row] += static_cast<double>(column[row]) * force[a];
    }
  }
  if (auto solved = solver.solve(loads, 1); !solved) return std::unexpected(solved.error());

  double greatest = 0.0, difference = 0.0;
  bool finite = true;
  for (std::size_t p = 0; p < places.size(); ++p) {
    Vec3 own = Vec3::Zero();
    for_each_field(places, p, [&](std::size_t node, double phi) {
      own += phi * Vec3::Map(loads.data() + 3 * node);
    });
    const Vec3 by_columns = Vec3::Map(stored.data() + 3 * p);
    finite = finite && own.allFinite() && by_columns.allFinite();
    greatest = std::max(greatest, own.norm());
    difference = std::max(difference, (own - by_columns).norm());
  }
  return StressFigure{"compliance against solver", finite ? difference / greatest : kInfinite, 1e-4,
                      ""};
}

StressFigure check_conditions(const ContactMoment& moment) {
  StressFigure figure{"contact conditions", 0.0, 1.0, ""};
  const auto fail = [&](std::string what) {
    figure.figure = kInfinite;
    figure.detail = std::move(what);
  };
  if (!moment.converged) {
    fail("not solved: the contact's compliance isn't positive");
    return figure;
  }
  double greatest_force = 0.0, greatest_way = 0.0, greatest_give = 0.0;
  for (std::size_t k = 0; k < moment.cells.size(); ++k) {
    if (!moment.forces[k].allFinite() || !moment.displacements[k].allFinite()) {
      fail(fmt::format("cell {} has a force or displacement that isn't finite", k));
      return figure;
    }
    const double force = moment.forces[k].norm();
    greatest_force = std::max(greatest_force, force);
    greatest_give = std::max(greatest_give, force * moment.softness[k]);
    greatest_way = std::max({greatest_way, moment.displacements[k].norm(),
                             moment.cells[k].held ? moment.cells[k].displacement.norm()
                                                  : std::abs(moment.cells[k].depth)});
  }
  // Beside the rounding of the solve, each displacement sums coefficients that are products in
  // single precision, of some 100 terms: 16 = 100^(2/3) roundings, between the expected ten and the
  // possible hundred. The solver's ridge lets a cell give way by 1e-6 of what its own force alone
  // would move it.
  const double force_floor = (1e-11 + contact_round_off(moment)) * greatest_force;
  const double way_floor = 16.0 * kSingle * std::max(greatest_way, greatest_give);
  constexpr double kSmallest = std::numeric_limits<double>::min();
  if (!(moment.smallest_eigenvalue > 0.0) && greatest_force > 0.0)
    fail("the least eigenvalue of the contact's compliance isn't positive");
  for (std::size_t k = 0; k < moment.cells.size(); ++k) {
    const ContactCell& cell = moment.cells[k];
    const Vec3& force = moment.forces[k];
    const double way_limit = 2e-6 * moment.softness[k] * force.norm() + way_floor + kSmallest;
    const double force_limit = force_floor + kSmallest;
    double off = 0.0;
    if (cell.held) {
      off = (moment.displacements[k] - cell.displacement).norm() / way_limit;
    } else {
      const double push = force.dot(cell.direction);
      const double gap = moment.displacements[k].dot(cell.direction) - cell.depth;
      // Coulomb's cone is kept to the solver's residual.
      const double drag = (force - push * cell.direction).norm() - cell.friction * push;
      const double cone_limit = force_limit + (cell.friction > 0.0 ? 1e-8 * greatest_force : 0.0);
      off = std::max({-push / cone_limit, drag / cone_limit, -gap / way_limit});
      // Force only where it touches.
      if (push > cone_limit) off = std::max(off, gap / way_limit);
    }
    if (!(off <= figure.figure)) {
      figure.figure = off;
      figure.detail = fmt::format("cell {}, in tolerances", k);
    }
  }
  return figure;
}

StressFigure check_energy(std::span<const ContactMoment> history) {
  StressFigure figure{"no energy from a closed path", 0.0, 0.0, ""};
  for (std::size_t a = 0; a < history.size(); ++a) {
    figure.limit = std::max(figure.limit, 8.0 * contact_round_off(history[a]));
    const double own = 0.5 * work(history[a], history[a]);
    for (std::size_t b = 0; b < history.size(); ++b) {
      const double energy_b = 0.5 * work(history[b], history[b]);
      // W_b - W_a - f_a.(d_b - d_a) >= 0; the other side is the same with a and b exchanged.
      const double excess = energy_b + own - work(history[a], history[b]);
      const double scale = exchanged(history[a], history[a]) + exchanged(history[b], history[b]) +
                           exchanged(history[a], history[b]);
      if (scale == 0.0) continue;
      const double violation = -excess / scale;
      if (!(violation <= figure.figure)) {
        figure.figure = violation;
        figure.detail = fmt::format("moments {} and {}", a, b);
      }
    }
  }
  return figure;
}

StressFigure check_closed_path(std::span<const ContactMoment> path) {
  StressFigure figure{"work around a closed path", 0.0, 0.0, ""};
  double sum = 0.0, scale = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const ContactMoment &from = path[i], &to = path[(i + 1) % path.size()];
    figure.limit = std::max(figure.limit, 8.0 * contact_round_off(from));
    sum += 0.5 * (work(from, to) - work(from, from) + work(to, to) - work(to, from));
    scale += exchanged(from, from) + exchanged(from, to);
  }
  figure.figure = scale > 0.0 ? std::abs(sum) / scale : 0.0;
  return figure;
}

// The compliance A of the cells is symmetric and positive, W = f.A f / 2 the energy stored, convex
// in u = A f. So f' .(u' - u) >= W' - W for one step, primes being what is after it. A cell with
// force f' touches: along the direction u' is the depth, and u was the old depth at least; across
// it u' is displacement + slip', displacement being u and the tool's step where the caller carries
// the slips. With D the tool's way, f'.(D' - D) >= f'.(u' - u) - f'.slip', and the last term is
// what friction takes, f' being against the slip. Around a path that ends without force as it began
// the sum of f'.(D' - D) + f'.slip' is thus >= 0. The ridge, 1e-6 of a cell's own softness, stands
// in A and not in the displacements that are carried on, and the solver's residual is 1e-9 of the
// greatest force.
StressFigure check_friction(std::span<const ContactMoment> path, std::span<const Vec3> way) {
  StressFigure figure{"friction gives nothing", 0.0, 0.0, "gained, over the work exchanged"};
  double left = 0.0, scale = 0.0, allowed = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const ContactMoment &from = path[i], &to = path[i + 1];
    const Vec3 step = way[i + 1] - way[i];
    double greatest = 0.0;
    for (const Vec3& force : to.forces) greatest = std::max(greatest, force.norm());
    for (std::size_t k = 0; k < to.forces.size(); ++k) {
      const double force = to.forces[k].norm();
      const double moved = step.norm() + to.slips[k].norm();
      left += to.forces[k].dot(step) + to.forces[k].dot(to.slips[k]);
      scale += force * moved;
      allowed += 4e-6 * to.softness[k] * force * (force + from.forces[k].norm()) +
                 (1e-8 * greatest + contact_round_off(to) * force) * moved;
    }
  }
  if (scale == 0.0) return figure;
  figure.figure = std::max(0.0, -left / scale);
  if (!std::isfinite(left)) figure.figure = kInfinite;
  figure.limit = allowed / scale;
  return figure;
}

StressFigure check_honest(const ContactMoment& moment) {
  StressFigure figure{"finite or said to fail", 0.0, 0.0, "cells"};
  for (std::size_t k = 0; k < moment.cells.size(); ++k) {
    const bool finite = moment.forces[k].allFinite() && moment.displacements[k].allFinite();
    const bool honest = moment.converged || moment.forces[k] == Vec3::Zero();
    figure.figure += !finite || !honest;
  }
  return figure;
}

// Dirichlet's principle. The contact energy W(d) is the least energy of all displacements v of the
// discrete body whose cell means reach the depths d, so W(d) <= U(v) for any single one that does.
// The near field makes cells softer still, and only lowers W. Two fields serve:
//  - the whole body moves by t: no strain, but its hold resists by Nitsche's penalty,
//    2 U = int beta |t|^2 dS over the held surface, beta = 100 (lambda + 2 mu) / h (galerkin.cpp).
//    Cell means of a constant are that constant.
//  - above a plane base, v = (z / z0) t, z the height, z0 the least height of a touchable sample:
//    v vanishes on the base and is linear, so the discrete body knows it exactly, cell means reach
//    t (their weights are positive and of sum 1, and carry z exactly), and 2 U = V [lambda (t.n)^2
//    + mu (|t|^2 + (t.n)^2)] / z0^2 <= V (lambda + 2 mu) |t|^2 / z0^2.
// With 2 U = k |t|^2 and cells of one direction pressed to at most `depth`: W <= k depth^2 / 2. For
// the force, W is convex in a further advance s and never negative: F s <= W(depth + s), best at
// s = depth: F <= 2 k depth. Held cells have F.d = 2 W <= k |d|^2 (the shift alone moves them
// exactly alike).
//
// From below by Thomson's principle: W is the greatest of f.d - f.A f / 2 over all forces f that
// push, so any single one is a bound. A force on one cell alone, at its best, gives d^2 / (2 A_kk).
// A_kk is the compliance's mean over the places that carry the cell, as positive weights of sum 1,
// hence at most the softest place's (a convex function of the weights); and its near field, at most
// the response of a half-space to the cell's disc, 16 (1 - nu^2) / (3 pi^2 E a), 1.5 times that
// across. Where the tool's cells go to d at most, F d >= 2 W. Lifting (tissue_contact.cpp) may make
// a cell twice as soft: its scaled diagonal rises by at most the eigenvalue that was negative.
EnergyBound::EnergyBound(const StressBody& body, const TouchableSurface& touch,
                         const SurfaceCompliance& compliance)
    : material_(body.material) {
  const std::vector<std::size_t> rows = compliance.touchable_rows();
  for (std::size_t t = 0; t < rows.size(); t += 3) {
    Mat3 own;
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        own(static_cast<int>(b), static_cast<int>(a)) =
            static_cast<double>(compliance.columns[(t + a) * compliance.rows() + rows[t + b]]);
    const Eigen::SelfAdjointEigenSolver<Mat3> modes(0.5 * (own + own.transpose()),
                                                    Eigen::EigenvaluesOnly);
    softest_ = std::max(softest_, modes.eigenvalues()[2]);
  }
  const double modulus = body.material.lame_lambda() + 2.0 * body.material.shear_modulus();
  const LocalSpacing spacing(body.cloud);
  const SurfaceQuadrature held = surface_quadrature(body.surface, spacing, body.is_fixed);
  const ShapeFunctions fields =
      find_formulation(body.formulation)->fields(body.surface, body.cloud);
  ShapeValues values;
  for (std::size_t b = 0; b < held.size(); ++b) {
    if (!held.fixed[b] || !fields.evaluate(held.positions[b], false, values)) continue;
    double h = 0.0;
    for (std::size_t j = 0; j < values.nodes.size(); ++j)
      h += values.values[j] * fields.cloud().spacings[static_cast<std::size_t>(values.nodes[j])];
    shift_ += held.weights[b] * 100.0 * modulus / h;
  }
  stretch_ = kInfinite;
  if (body.base_is_plane) {
    double lowest = kInfinite;
    for (const Vec3& x : touch.positions) lowest = std::min(lowest, (x - body.origin).dot(body.up));
    if (lowest > 0.0) stretch_ = modulus * volume(body.surface) / (lowest * lowest);
  }
}

StressFigure EnergyBound::pressed(const ContactMoment& moment) const {
  double depth = 0.0, force = 0.0;
  for (std::size_t k = 0; k < moment.cells.size(); ++k) {
    depth = std::max(depth, moment.cells[k].depth);
    force += moment.forces[k].dot(moment.cells[k].direction);
  }
  const double stiffness = std::min(shift_, stretch_);
  const double energy = 0.5 * work(moment, moment);
  StressFigure figure{"force against its bound", 0.0, 1.0 + 1e-6, "force or energy over its bound"};
  if (depth > 0.0)
    figure.figure =
        std::max(force / (2.0 * stiffness * depth), energy / (0.5 * stiffness * depth * depth));
  else if (force > 0.0)
    figure.figure = kInfinite;
  return figure;
}

StressFigure EnergyBound::held(const ContactMoment& moment) const {
  StressFigure figure{"force against its bound", 0.0, 1.0 + 1e-6, "energy over its bound"};
  const double way2 = moment.cells.front().displacement.squaredNorm();
  if (way2 > 0.0) figure.figure = work(moment, moment) / (shift_ * way2);
  return figure;
}

StressFigure EnergyBound::least(const ContactMoment& moment) const {
  StressFigure figure{"force from below", 0.0, 2.0, "least force or energy over what was found"};
  const double nu = material_.poisson_ratio, pi = std::numbers::pi;
  double least = 0.0, deepest = 0.0;  // of the energy, twice [J]; of the ways [m]
  for (const ContactCell& cell : moment.cells) {
    const double way = cell.held ? cell.displacement.norm() : std::max(0.0, cell.depth);
    const double disc = 16.0 * (1.0 - nu * nu) /
                        (3.0 * pi * pi * material_.youngs_modulus * std::sqrt(cell.area / pi));
    least = std::max(least, way * way / (softest_ + 1.5 * disc));
    deepest = std::max(deepest, way);
  }
  if (deepest == 0.0) return figure;
  Vec3 force = Vec3::Zero();
  for (const Vec3& one : moment.forces) force += one;
  const double energy = work(moment, moment);
  figure.figure =
      std::max(energy > 0.0 ? least / energy : kInfinite, least / (deepest * force.norm()));
  return figure;
}

StressFigure check_same_force(const ContactMoment& one, const ContactMoment& other,
                              std::string check) {
  Vec3 difference = Vec3::Zero();
  double size = 0.0;
  for (std::size_t k = 0; k < one.forces.size(); ++k) {
    difference += one.forces[k] - other.forces[k];
    size += one.forces[k].norm() + other.forces[k].norm();
  }
  return {std::move(check), size > 0.0 ? difference.norm() / size : 0.0,
          8.0 * contact_round_off(one), ""};
}

}  // namespace viscera
