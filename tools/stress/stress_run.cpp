#include "tools/stress/stress_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numbers>

#include "kernels/contact/deformation.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/hive/hive_contact.h"
#include "tools/stress/stress_tools.h"

namespace viscera {
namespace {

/// Keeps of each check the figure nearest to its limit or farthest beyond it.
class Figures {
 public:
  void add(const StressFigure& figure) {
    const auto same = [&](const StressFigure& other) { return other.check == figure.check; };
    const auto at = std::find_if(all_.begin(), all_.end(), same);
    if (at == all_.end()) {
      all_.push_back(figure);
    } else if (share(figure) > share(*at)) {
      *at = figure;
    }
  }
  std::vector<StressFigure> take() { return std::move(all_); }

  /// Of the limit; a figure that isn't a number is worse than all.
  static double share(const StressFigure& figure) {
    if (std::isnan(figure.figure)) return std::numeric_limits<double>::infinity();
    return figure.limit > 0.0 ? figure.figure / figure.limit : figure.figure;
  }

 private:
  std::vector<StressFigure> all_;
};

/// A body ready for contact; stays where it is made.
struct Prepared {
  const Formulation* formulation = nullptr;
  std::unique_ptr<ShapeFunctions> fields;
  std::unique_ptr<ElasticSolver> solver;
  SurfacePlaces places;
  TouchableSurface touch;
  DrawnSurface drawn;
  SurfaceCompliance compliance;
};

Result<Prepared> prepare(const StressBody& body, const IsotropicMaterial& material,
                         const Progress& progress) {
  if (!body.refused.empty()) return failure(body.refused);
  Prepared ready;
  ready.formulation = find_formulation(body.formulation);
  const ElasticProblem problem{&body.surface, &body.cloud, material, body.is_fixed};
  auto solver = ready.formulation->prepare(problem, progress);
  if (!solver) return std::unexpected(solver.error());
  ready.solver = std::move(*solver);
  ready.fields =
      std::make_unique<ShapeFunctions>(ready.formulation->fields(body.surface, body.cloud));
  auto places = place_on_surface(body.surface, *ready.fields);
  if (!places) return std::unexpected(places.error());
  ready.places = std::move(*places);
  auto touch = touchable_part(ready.places, body.is_touchable);
  if (!touch) return std::unexpected(touch.error());
  ready.touch = std::move(*touch);
  ready.drawn = carry_surface(body.surface, ready.places);
  auto compliance = ready.solver->compliance(ready.places.fields, ready.touch.places, progress);
  if (!compliance) return std::unexpected(compliance.error());
  ready.compliance = std::move(*compliance);
  return ready;
}

/// A diagonal entry of the touchable place in the middle.
void flip_compliance(Prepared& ready) {
  SurfaceCompliance& compliance = ready.compliance;
  const std::size_t column = 3 * (ready.touch.size() / 2);
  const std::size_t row = compliance.touchable_rows()[column];
  float& entry = compliance.columns[column * compliance.rows() + row];
  entry = -entry;
}

/// A kind of tissue that answers for the body, without memory of what was before.
using MakeTissue = std::function<std::unique_ptr<TissueContact>()>;

MakeTissue prepared_tissue(const Prepared& ready, const IsotropicMaterial& material) {
  return [&ready, material] {
    auto tissue = std::make_unique<PatchContact>(ready.compliance, ready.touch, material);
    tissue->draw_on(ready.drawn, nullptr);
    return tissue;
  };
}

/// Contact on one body with everything that came of it, whatever kind of tissue answers.
class Contact {
 public:
  Contact(MakeTissue make, const DrawnSurface& drawn, StressFault fault)
      : make_(std::move(make)), drawn_(drawn), fault_(fault), solver_(make_()) {}

  ContactMoment solve(std::vector<ContactCell> cells) {
    return solve_with(*solver_, std::move(cells));
  }
  ContactMoment solve_afresh(std::vector<ContactCell> cells) {
    return solve_with(*make_(), std::move(cells));
  }

  /// Positions and normals of the drawn surface under the last solve that aren't finite.
  StressFigure check_drawn(const ContactMoment& moment) {
    std::vector<float> displacements;
    std::vector<Vec3f> positions, normals;
    solver_->place_displacements(response_, displacements);
    solver_->draw(displacements, moment.cells, solution_, positions);
    deformed_normals(drawn_, positions, normals);
    double broken = 0.0;
    for (std::size_t v = 0; v < positions.size(); ++v)
      broken += !positions[v].allFinite() || !normals[v].allFinite();
    return {"finite drawn surface", broken, 0.0, ""};
  }

 private:
  ContactMoment solve_with(TissueContact& solver, std::vector<ContactCell> cells) {
    std::vector<double> softness;
    for (const ContactCell& cell : cells) softness.push_back(softness_of(cell));
    solver.solve(cells, solution_, response_);
    ContactMoment moment{
        std::move(cells),    solution_.forces,    solver.cell_displacements(),  solution_.slips,
        std::move(softness), solution_.converged, solution_.smallest_eigenvalue};
    if (fault_ == StressFault::kForce && solution_.touching > 0) {
      const auto strongest = std::max_element(
          moment.forces.begin(), moment.forces.end(),
          [](const Vec3& a, const Vec3& b) { return a.squaredNorm() < b.squaredNorm(); });
      *strongest = -*strongest;
    }
    return moment;
  }

  /// Greatest displacement of a cell under a unit force of its own; each place asked once.
  double softness_of(const ContactCell& cell) {
    const auto [known, fresh] = softness_.try_emplace(
        {cell.position.x(), cell.position.y(), cell.position.z(), cell.area}, 0.0);
    if (!fresh || !cell.position.allFinite()) return known->second;
    const auto alone = make_();
    Mat3 stiffness;
    for (int a = 0; a < 3; ++a) {
      ContactCell held = cell;
      held.held = true;
      held.friction = 0.0;
      held.depth = 0.0;
      held.displacement = Vec3::Unit(a);
      alone->solve(std::span(&held, 1), solution_, response_);
      if (!solution_.converged) return 0.0;
      stiffness.col(a) = solution_.forces[0];
    }
    return known->second = stiffness.inverse().norm();
  }

  MakeTissue make_;
  const DrawnSurface& drawn_;
  StressFault fault_;
  std::unique_ptr<TissueContact> solver_;
  std::map<std::array<double, 4>, double> softness_;
  ContactSolution solution_;
  ContactResponse response_;
};

/// What a tool at rest, clear of the tissue or not moved, is to the others.
constexpr double kClear = -0.2;

std::vector<ContactCell> cells_of(const std::vector<StressTool>& tools,
                                  const std::vector<double>& shares, double angle) {
  std::vector<ContactCell> cells;
  for (std::size_t t = 0; t < tools.size(); ++t) tools[t].add_cells(shares[t], angle, cells);
  return cells;
}

/// Each tool alone: in and out again, against the derived bounds.
void press_alone(Contact& contact, const EnergyBound& bound, const std::vector<StressTool>& tools,
                 Figures& figures) {
  for (const StressTool& tool : tools) {
    std::vector<ContactMoment> history;
    for (const double share : {kClear, 0.1, 0.4, 0.7, 1.0, 0.55, 0.25, kClear}) {
      std::vector<ContactCell> cells;
      tool.add_cells(tool.held ? std::max(0.0, share) : share, 0.0, cells);
      history.push_back(contact.solve(std::move(cells)));
      figures.add(check_conditions(history.back()));
      if (!history.back().converged) return;
      figures.add(tool.held ? bound.held(history.back()) : bound.pressed(history.back()));
      figures.add(bound.least(history.back()));
    }
    figures.add(check_energy(history));
  }
}

/// All tools together: random moments (each a teleport from the one before), zero and huge steps,
/// a closed path of the jaws, and back.
void press_together(Contact& contact, const std::vector<StressTool>& tools, Draws& draws,
                    Figures& figures) {
  std::vector<ContactMoment> history;
  const std::vector<double> rest(tools.size(), kClear);
  std::vector<double> shares = rest;
  const auto visit = [&](double angle) {
    history.push_back(contact.solve(cells_of(tools, shares, angle)));
    figures.add(check_conditions(history.back()));
    return history.back().converged;
  };
  bool jaws_only = true;
  for (const StressTool& tool : tools) jaws_only = jaws_only && tool.held;

  constexpr int kMoments = 8;
  for (int i = 0; i < kMoments; ++i) {
    for (std::size_t t = 0; t < shares.size(); ++t)
      shares[t] = tools[t].with_last ? shares[t - 1] : draws.uniform(kClear, 1.0);
    const double angle = draws.uniform(0.0, 2.0 * std::numbers::pi);
    if (!visit(angle)) return;
    // A step of nothing, then the same from nothing.
    if (i % 3 == 0) {
      if (!visit(angle)) return;
      figures.add(check_same_force(history[history.size() - 2], history.back(), "zero step"));
      figures.add(contact.check_drawn(history.back()));
      figures.add(check_same_force(contact.solve_afresh(history.back().cells), history.back(),
                                   "history forgotten"));
    }
  }
  for (double& share : shares) share = 1e6;
  if (!visit(0.0)) return;
  for (double& share : shares) share = -1e6;
  if (!visit(0.0)) return;
  shares = rest;
  if (!visit(0.0)) return;
  figures.add(check_energy(history));

  if (!jaws_only) return;
  std::vector<ContactMoment> path;
  constexpr int kSteps = 12;
  for (int i = 0; i < kSteps; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / kSteps;
    for (std::size_t t = 0; t < shares.size(); ++t)
      shares[t] =
          tools[t].with_last ? shares[t - 1] : 0.5 + 0.5 * std::sin(turn + static_cast<double>(t));
    path.push_back(contact.solve(cells_of(tools, shares, 2.0 * turn)));
  }
  figures.add(check_closed_path(path));
}

/// Each tip alone, with friction: in, around a loop across its direction that is wide enough to
/// slip, and out again.
void drag_alone(Contact& contact, const std::vector<StressTool>& tools, Draws& draws,
                Figures& figures) {
  for (const StressTool& tool : tools) {
    const double friction = draws.log_uniform(0.05, 1.0), reach = draws.log_uniform(0.05, 2.0);
    if (tool.held) continue;
    const Vec3 down = tool.cells.front().direction;
    const Vec3 across = down.unitOrthogonal(), along = down.cross(across);
    const double deep = 0.7 * tool.greatest_depth, wide = reach * deep;
    // From clear of the tissue: a cell that is pressed there already has taken energy unseen.
    const double clear = kClear * tool.greatest_depth - tool.clearance();
    std::vector<Vec3> way{clear * down, 0.5 * deep * down, deep * down};
    constexpr int kSteps = 8;
    for (int i = 1; i <= kSteps; ++i) {
      const double turn = 2.0 * std::numbers::pi * i / kSteps;
      way.push_back(deep * down + wide * (std::cos(turn) - 1.0) * across +
                    wide * std::sin(turn) * along);
    }
    way.push_back(0.4 * deep * down);
    way.push_back(way.front());

    std::vector<ContactMoment> path;
    std::vector<ContactCell> cells = tool.cells;
    for (std::size_t i = 0; i < way.size(); ++i) {
      const Vec3 step = i == 0 ? Vec3(Vec3::Zero()) : Vec3(way[i] - way[i - 1]);
      for (std::size_t k = 0; k < cells.size(); ++k) {
        cells[k].friction = friction;
        cells[k].depth = tool.cells[k].depth + way[i].dot(down);
        if (i == 0) continue;
        // Where it slipped it clings from there on.
        cells[k].displacement += path.back().slips[k] + step - down.dot(step) * down;
      }
      path.push_back(contact.solve(cells));
      figures.add(check_conditions(path.back()));
      if (!path.back().converged) return;
    }
    figures.add(check_friction(path, way));
  }
}

/// A tip whose foot goes over the surface, its cells laid anew at every step.
void slide(Contact& contact, const StressSurface& surface, const std::vector<StressTool>& tools,
           Figures& figures) {
  for (const StressTool& tool : tools) {
    if (tool.held) continue;
    const ContactCell& foot = tool.cells.front();
    const Vec3 across = foot.direction.unitOrthogonal();
    const double radius = 1.2 * std::sqrt(foot.area);
    for (const double steps : {0.0, 0.3, 1.1, 4.0}) {
      StressTool moved =
          tool_at(surface, foot.position + steps * radius * across, radius, 1, false);
      if (moved.cells.empty()) continue;  // as random_tools() does
      moved.greatest_depth = tool.greatest_depth;
      std::vector<ContactCell> cells;
      moved.add_cells(0.5, 0.0, cells);
      figures.add(check_conditions(contact.solve(std::move(cells))));
    }
  }
}

/// Contact on a compliance that promises nothing of energy: every moment finite or said to fail.
void press_without_energy(Contact& contact, const std::vector<StressTool>& tools,
                          Figures& figures) {
  for (const double share : {kClear, 0.1, 0.5, 1.0, 1e6, -1e6, 0.3}) {
    const ContactMoment moment =
        contact.solve(cells_of(tools, std::vector<double>(tools.size(), share), share));
    figures.add(check_honest(moment));
    if (moment.converged) figures.add(contact.check_drawn(moment));
  }
}

// Continuity. While a tool advances by s along its direction and the others stand, its force along
// it grows at the slope 1.(A_aa^-1)_11.1 of the cells a that touch. More constraints make the body
// stiffer (Dirichlet's principle again), so the slope is never above S: the force when its cells
// are moved by a unit as if held, all others held still. So F(s') - F(s) lies between 0 and S (s' -
// s): it's bisected towards the greater jump, and the last jump must fall with the step. The ridge
// on held cells isn't quite that on pressed ones (by component, against along the direction: at
// most 3 times), hence a factor of 4.
StressFigure check_continuity(Contact& contact, const std::vector<StressTool>& tools,
                              std::size_t moving) {
  StressFigure figure{"force continuous in the step", 0.0, 4.0, "jump over its greatest slope"};
  std::vector<ContactCell> all_held;
  std::size_t begin = 0, end = 0;
  for (std::size_t t = 0; t < tools.size(); ++t) {
    if (t == moving) begin = all_held.size();
    tools[t].add_cells(0.0, 0.0, all_held);
    if (t == moving) end = all_held.size();
  }
  for (std::size_t k = 0; k < all_held.size(); ++k) {
    ContactCell& cell = all_held[k];
    cell.held = true;
    cell.displacement =
        k >= begin && k < end ? tools[moving].greatest_depth * cell.direction : Vec3(Vec3::Zero());
  }
  const auto push = [&](const ContactMoment& moment) {
    double sum = 0.0;
    for (std::size_t k = begin; k < end; ++k)
      sum += moment.forces[k].dot(moment.cells[k].direction);
    return sum;
  };
  const ContactMoment stiffest = contact.solve(all_held);
  if (!stiffest.converged) {
    figure.figure = std::numeric_limits<double>::infinity();
    figure.detail = "not solved";
    return figure;
  }
  const double slope = push(stiffest);  // per share of the depth
  const auto push_at = [&](double share) {
    std::vector<double> shares(tools.size(), 0.3);
    shares[moving] = share;
    return push(contact.solve(cells_of(tools, shares, 0.0)));
  };
  double low = 0.0, high = 1.0, force_low = push_at(low), force_high = push_at(high);
  const double whole = std::abs(force_high) + std::abs(force_low);
  const double round_off = 1e-7 * whole;
  constexpr int kHalvings = 12;
  for (int i = 0; i <= kHalvings; ++i) {
    const double jump = force_high - force_low;
    const double allowed = slope * (high - low) + round_off;
    if (allowed > 0.0)
      figure.figure = std::max({figure.figure, jump / allowed, -4.0 * jump / round_off});
    const double middle = 0.5 * (low + high), force = push_at(middle);
    if (force - force_low > force_high - force) {
      high = middle;
      force_high = force;
    } else {
      low = middle;
      force_low = force;
    }
  }
  return figure;
}

/// Cells that no tool makes: the contact must decline them without forces.
StressFigure check_bad_cells(Contact& contact, const StressTool& tool) {
  StressFigure figure{"bad cells declined", 0.0, 0.0, ""};
  for (int bad = 0; bad < 4; ++bad) {
    std::vector<ContactCell> cells;
    tool.add_cells(1.0, 0.0, cells);
    if (bad == 0) cells.back().depth = std::nan("");
    if (bad == 1) cells.back().area = 0.0;
    if (bad == 2) cells.back().position.x() = std::numeric_limits<double>::infinity();
    if (bad == 3) cells.back().displacement.y() = std::nan("");
    const ContactMoment moment = contact.solve(cells);
    Vec3 sum = Vec3::Zero();
    for (const Vec3& force : moment.forces) sum += force;
    if (moment.converged || sum != Vec3::Zero()) ++figure.figure;
  }
  return figure;
}

/// The same tools on the same surface where hives alone answer. Surfaces that can't be walked over
/// are refused by scenes, too.
void press_hives(const StressBody& body, const std::vector<StressTool>& tools,
                 const DrawnSurface& drawn, StressFault fault, Draws& draws, Figures& figures) {
  const auto walkable = WalkableSurface::make(body.surface);
  if (!walkable) return;
  HiveSettings settings;
  settings.material = body.material;
  settings.nodes = 80;
  for (const StressTool& tool : tools)
    for (const ContactCell& cell : tool.cells)
      settings.radius =
          std::max(settings.radius, 4.0 * (cell.position - tool.cells.front().position).norm());
  if (!HiveContact::create(*walkable, settings)) return;
  Contact contact([&] { return std::move(*HiveContact::create(*walkable, settings)); }, drawn,
                  fault);
  Figures own;
  press_together(contact, tools, draws, own);
  drag_alone(contact, tools, draws, own);
  own.add(check_bad_cells(contact, tools.front()));
  for (StressFigure figure : own.take()) {
    figure.check = "hives: " + figure.check;
    figures.add(figure);
  }
}

Result<StressFigure> check_stiffness_ratio(const StressBody& body, const Prepared& ready,
                                           const std::vector<StressTool>& tools,
                                           const Progress& progress) {
  IsotropicMaterial stiff = body.material;
  stiff.youngs_modulus *= body.second_stiffness;
  auto second = prepare(body, stiff, progress);
  if (!second) return std::unexpected(second.error());
  PatchContact soft_contact(ready.compliance, ready.touch, body.material);
  PatchContact stiff_contact(second->compliance, second->touch, stiff);
  StressFigure figure{"forces 1 : 1,000", 0.0, 0.0, ""};
  for (const double share : {0.3, 1.0}) {
    const std::vector<ContactCell> cells =
        cells_of(tools, std::vector<double>(tools.size(), share), 0.0);
    ContactSolution soft_solution, stiff_solution;
    ContactResponse ignored;
    soft_contact.solve(cells, soft_solution, ignored);
    stiff_contact.solve(cells, stiff_solution, ignored);
    Vec3 difference = Vec3::Zero();
    double size = 0.0;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      difference += stiff_solution.forces[k] / body.second_stiffness - soft_solution.forces[k];
      size += soft_solution.forces[k].norm();
    }
    if (size > 0.0) figure.figure = std::max(figure.figure, difference.norm() / size);
  }
  // Stiffness scales exactly; single-precision entries round differently, and the contact's
  // coefficients are known to 1e-4 (compliance against solver).
  figure.limit = 1e-4;
  return figure;
}

}  // namespace

bool StressOutcome::passed() const {
  if (!refused.empty()) return unclear_refusal(refused).empty();
  if (to_be_refused) return false;
  return std::all_of(figures.begin(), figures.end(),
                     [](const StressFigure& figure) { return figure.sound(); });
}

Result<StressOutcome> run_stress_case(std::uint64_t seed, int number, StressFault fault,
                                      const Progress& progress) {
  const StressBody body = make_stress_body(seed, number);
  StressOutcome outcome;
  outcome.number = number;
  outcome.kind = body.kind;
  outcome.formulation = body.formulation;
  outcome.description = body.description;
  outcome.to_be_refused = body.to_be_refused;
  const auto refuse = [&](const Error& error) -> Result<StressOutcome> {
    if (error.text() == kCancelled) return std::unexpected(error);
    outcome.refused = error.text().empty() ? "(nothing)" : error.text();
    return outcome;
  };
  auto prepared = prepare(body, body.material, progress);
  if (!prepared) return refuse(prepared.error());
  Prepared& ready = *prepared;
  if (fault == StressFault::kCompliance) flip_compliance(ready);

  Figures figures;
  figures.add(check_finite(ready.compliance));
  // A formulation that warns is let pass with a compliance that isn't positive, as in a scene.
  if (ready.formulation->warning().empty()) figures.add(check_positive(ready.compliance));
  // A stream apart from the body's own.
  Draws draws(seed ^ 0x746f6f6c73ull, static_cast<std::uint64_t>(number));
  auto linear = check_linear_field(body, *ready.formulation, *ready.solver, ready.touch);
  if (!linear) return refuse(linear.error());
  figures.add(*linear);
  auto agreed = check_against_solver(*ready.solver, ready.places, ready.compliance, draws);
  if (!agreed) return refuse(agreed.error());
  figures.add(*agreed);
  const StressSurface surface(body);
  const std::vector<StressTool> tools = random_tools(surface, draws);
  if (tools.empty())
    return refuse(
        Error("tools: found no place with tissue straight under it; expected one: make the "
              "touchable part wider"));
  for (const StressTool& tool : tools) {
    if (!outcome.tools.empty()) outcome.tools += "; ";
    outcome.tools +=
        fmt::format("{}, {} cells, {:.3g} m", tool.place, tool.cells.size(), tool.greatest_depth);
  }
  Contact contact(prepared_tissue(ready, body.material), ready.drawn, fault);
  // The force of an unsymmetric compliance has no energy: it promises none of what follows.
  if (!ready.compliance.symmetric) {
    press_without_energy(contact, tools, figures);
    figures.add(check_bad_cells(contact, tools.front()));
    outcome.figures = figures.take();
    return outcome;
  }
  press_alone(contact, EnergyBound(body, ready.touch, ready.compliance), tools, figures);
  press_together(contact, tools, draws, figures);
  drag_alone(contact, tools, draws, figures);
  slide(contact, surface, tools, figures);
  for (std::size_t t = 0; t < tools.size(); ++t)
    if (!tools[t].held) figures.add(check_continuity(contact, tools, t));
  figures.add(check_bad_cells(contact, tools.front()));
  if (body.second_stiffness != 1.0) {
    auto ratio = check_stiffness_ratio(body, ready, tools, progress);
    if (!ratio) return refuse(ratio.error());
    figures.add(*ratio);
  }
  press_hives(body, tools, ready.drawn, fault, draws, figures);
  outcome.figures = figures.take();
  return outcome;
}

std::string replay_command(const StressOptions& options, int number) {
  std::string command = fmt::format("viscera stress --seed {} --case {}", options.seed, number);
  if (options.fault == StressFault::kCompliance) command += " --inject-fault";
  if (options.fault == StressFault::kForce) command += " --inject-fault force";
  return command;
}

}  // namespace viscera
