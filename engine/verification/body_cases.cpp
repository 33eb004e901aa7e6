#include "engine/verification/body_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/verification/reference_solid.h"
#include "kernels/contact/cell_pattern.h"

namespace viscera {
namespace {

constexpr double kHair = 1e-6;
constexpr int kRings = 6;           // of cells: 127
constexpr double kBallReach = 1.5;  // how far cells reach under a ball
constexpr int kPressRings = 8;
/// The ball, and the cap by which it is glued, over its radius.
constexpr double kBodyBallRadius = 1.0 / 0.3, kGlued = 0.4;
constexpr double kSlabRadius = 8.0;

double across(const Vec3& x) {
  return std::hypot(x.x(), x.y());
}

double pressure_at(double r) {
  const double fall = std::max(0.0, 1.0 - r * r);
  return fall * fall;
}

/// How far a place at rest must come down, at least.
double depth_at(const BodyCase& body, BodyLoad load, const Vec3& x) {
  const double depth = depth_of(body, load);
  if (load == BodyLoad::kBall) return depth - 0.5 * x.head<2>().squaredNorm() / kBodyBall;
  if (load == BodyLoad::kPlate) return depth + x.z();
  return depth;
}

std::array<bool, 3> all_if(bool held) {
  return {held, held, held};
}

/// What a load does at the nodes and faces of a reference solid. `is_fixed` as the body's own;
/// `mirrored`: the half y >= 0 stands for the whole.
SolidConditions conditions_of(const BodyCase& body, BodyLoad load, bool mirrored) {
  SolidConditions conditions;
  const bool moves = load == BodyLoad::kStick || load == BodyLoad::kFlat;
  const double cap = body.cap, depth = depth_of(body, load);
  const auto on_top = [cap](const Vec3& x) {
    return cap > 0.0 ? std::abs((x + Vec3(0, 0, cap)).norm() - cap) < kHair && x.z() > -cap
                     : x.z() > -kHair;
  };
  const auto in_patch = [=](const Vec3& x) {
    return moves && on_top(x) && across(x) < 1.0 + kHair;
  };
  if (moves) conditions.is_tool = in_patch;
  const auto is_fixed = body.is_fixed;
  conditions.held = [=](const Vec3& x) {
    const bool inside = cap > 0.0 && (x + Vec3(0, 0, cap)).norm() < cap - kHair;
    auto held = all_if(!inside && is_fixed(x));
    if (in_patch(x))
      held = {held[0] || load == BodyLoad::kStick, held[1] || load == BodyLoad::kStick, true};
    if (mirrored && std::abs(x.y()) < kHair) held[1] = true;
    return held;
  };
  conditions.displacement = [=](const Vec3& x) {
    return Vec3(0.0, 0.0, in_patch(x) ? -depth : 0.0);
  };
  conditions.is_loaded = [=](const Vec3& x) { return on_top(x) && across(x) < 2.0; };
  if (load == BodyLoad::kPress)
    conditions.pressure = [](const Vec3& x) { return pressure_at(across(x)); };
  if (load == BodyLoad::kBall || load == BodyLoad::kPlate)
    conditions.depth = [body = &body, load](const Vec3& x) { return depth_at(*body, load, x); };
  return conditions;
}

/// Of the turned bodies, finest at the contact's rim; of the raised ones.
Grading turned_grading(int refinement) {
  if (refinement < 0) return {0.02, 1.8, 1.0};
  return refinement == 0 ? Grading{0.0025, 1.5, 0.5} : Grading{0.001, 1.3, 0.25};
}
Grading raised_grading(BodyLoad load, int refinement) {
  // A smooth pressure has no rim to be fine at.
  if (load == BodyLoad::kPress) return {refinement > 0 ? 0.06 : 0.12, 1.6, 0.9};
  if (refinement < 0) return {0.06, 2.0, 2.0};
  return refinement == 0 ? Grading{0.015, 1.8, 1.2} : Grading{0.008, 1.6, 0.9};
}

/// Samples at places of a line, each standing for half the way to its neighbours, times what
/// `measure` says of it. Every other node: the corners of elements, or their middles.
template <class Measure>
void add_line(std::vector<std::pair<double, std::size_t>> line, const std::vector<Vec3>& nodes,
              const SolidAnswer& answer, const Measure& measure,
              std::vector<BodyReference::Sample>& samples) {
  std::sort(line.begin(), line.end());
  std::vector<std::pair<double, std::size_t>> kept;
  for (std::size_t i = 0; i < line.size(); i += 2) kept.push_back(line[i]);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const double before = i > 0 ? kept[i - 1].first : kept[i].first;
    const double after = i + 1 < kept.size() ? kept[i + 1].first : kept[i].first;
    const std::size_t n = kept[i].second;
    samples.push_back(
        {nodes[n], answer.displacements[n], 0.5 * (after - before) * measure(nodes[n])});
  }
}

Result<BodyReference> reference_of(const BodyCase& body, const ReferenceSolid& solid,
                                   BodyLoad load) {
  const auto answer = solid.solve(conditions_of(body, load, !body.turned));
  if (!answer) return std::unexpected(answer.error());
  if (!answer->converged)
    return failure("reference of " + body.name + ": found no settled contact");
  BodyReference reference;
  reference.force = body.turned ? answer->force : 2.0 * answer->force;
  const std::vector<Vec3>& nodes = solid.nodes();
  std::vector<std::pair<double, std::size_t>> top, side_by_side, down;
  double right = 0.0;
  for (const Vec3& x : nodes) right = std::max(right, x.x());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const Vec3& x = nodes[n];
    if (body.cap > 0.0) {
      const Vec3 from_middle = x + Vec3(0.0, 0.0, body.cap);
      const double polar = std::atan2(x.x(), from_middle.z());
      if (std::abs(from_middle.norm() - body.cap) < kHair && polar < 2.4)
        top.emplace_back(polar * body.cap, n);
    } else if (std::abs(x.y()) < kHair && x.z() > -kHair) {
      top.emplace_back(x.x(), n);
    }
    if (body.turned) continue;
    if (std::abs(x.x()) < kHair && x.z() > -kHair) side_by_side.emplace_back(x.y(), n);
    if (std::abs(x.y()) < kHair && x.x() > right - kHair) down.emplace_back(-x.z(), n);
  }
  const auto ring = [](const Vec3& x) { return 2.0 * std::numbers::pi * x.x(); };
  const auto one = [](const Vec3&) { return 1.0; };
  if (body.turned) {
    add_line(std::move(top), nodes, *answer, ring, reference.samples);
  } else {
    for (auto* line : {&top, &side_by_side, &down})
      add_line(std::move(*line), nodes, *answer, one, reference.samples);
  }
  return reference;
}

/// Steps of .25 within 2 of a place, growing away from it.
std::vector<double> surface_lines(double from, double to, double about) {
  std::vector<double> lines;
  const auto leave = [&](double length, double sign) {
    std::vector<double> places;
    double at = 0.0, step = 0.25;
    while (at < length - 1e-9) {
      if (at > 2.0) step = std::min(1.0, 1.3 * step);
      at += step;
      places.push_back(at);
    }
    // The last ones share what is left over.
    const double scale = places.empty() ? 1.0 : length / places.back();
    for (double& place : places) place = about + sign * scale * place;
    return places;
  };
  auto left = leave(about - from, -1.0);
  lines.assign(left.rbegin(), left.rend());
  lines.push_back(about);
  const auto right = leave(to - about, 1.0);
  lines.insert(lines.end(), right.begin(), right.end());
  return lines;
}

/// A box around the contact's middle: how far it goes to either side along x, along y, and down.
struct Raised {
  double left, right, side, depth;
  bool held_below;
};

Result<BodyReference> solve_turned(const BodyCase& body, double thickness, BodyLoad load,
                                   double poisson_ratio, int refinement) {
  Grading grading = turned_grading(refinement);
  QuadMesh mesh;
  if (body.cap > 0.0) {
    const double radius = body.cap;
    const Grading angular{grading.finest / radius, grading.growth, grading.coarsest / radius};
    auto radii = graded_borders(radius, grading);
    for (double& r : radii) r = radius - r;
    std::reverse(radii.begin(), radii.end());
    radii.front() = 0.0;
    mesh = polar_mesh(
        borders_about(0.0, std::numbers::pi,
                      {std::asin(1.0 / radius), std::numbers::pi - std::asin(kGlued)}, angular),
        radii);
    for (Vec2& x : mesh.nodes) x.y() -= radius;
  } else {
    mesh = rectangle_mesh(borders_about(0.0, kSlabRadius, {1.0}, grading),
                          borders_about(-thickness, 0.0, {0.0}, grading));
  }
  return reference_of(body, *turned_solid(std::move(mesh), poisson_ratio), load);
}

Result<BodyReference> solve_raised(const BodyCase& body, const Raised& shape, BodyLoad load,
                                   double poisson_ratio, int refinement) {
  const Grading grading = raised_grading(load, refinement);
  const QuadMesh mesh =
      disc_in_rectangle({shape.left, shape.right, shape.side, grading, refinement < 0 ? 8 : 16});
  return reference_of(
      body, *raised_solid(mesh, borders_about(-shape.depth, 0.0, {0.0}, grading), poisson_ratio),
      load);
}

BodyCase ball() {
  BodyCase body;
  body.name = "ball";
  body.what = "a ball glued to a plate by a cap of .4 R, pressed from above; a = .3 R";
  body.loads = {BodyLoad::kStick, BodyLoad::kPlate};
  const double radius = kBodyBallRadius;
  body.cap = radius;
  std::vector<Vec2> outline;
  // The cap's rim is one of the rings: what is held is asked within triangles.
  constexpr int kFree = 36, kHeld = 6;
  const double rim = std::numbers::pi - std::asin(kGlued);
  for (int i = 0; i <= kFree + kHeld; ++i) {
    const double angle =
        i <= kFree ? rim * i / kFree : rim + (std::numbers::pi - rim) * (i - kFree) / kHeld;
    outline.emplace_back(radius * std::sin(angle), radius * (std::cos(angle) - 1.0));
  }
  outline.front().x() = outline.back().x() = 0.0;
  body.surface = turned_surface(outline);
  const double glued_at = -radius - radius * std::sqrt(1.0 - kGlued * kGlued);
  body.is_fixed = [=](const Vec3& x) { return x.z() < glued_at + kHair; };
  body.is_touchable = [=](const Vec3& x) { return x.z() > -radius; };
  body.solve = [](const BodyCase& self, BodyLoad load, double nu, int refinement) {
    return solve_turned(self, 0.0, load, nu, refinement);
  };
  return body;
}

/// A disc of radius kSlabRadius on a rigid base.
BodyCase slab(double thickness, const std::string& name) {
  BodyCase body;
  body.name = name;
  body.what = fmt::format("a slab {:g} a thick on a rigid base", thickness);
  body.loads = {BodyLoad::kFlat, BodyLoad::kBall, BodyLoad::kPress};
  std::vector<Vec2> outline;
  for (const double r : surface_lines(0.0, kSlabRadius, 0.0)) outline.emplace_back(r, 0.0);
  const int layers = std::max(3, static_cast<int>(thickness / 0.6));
  for (int i = 1; i <= layers; ++i) outline.emplace_back(kSlabRadius, -thickness * i / layers);
  const int rings = static_cast<int>(kSlabRadius / 0.8);
  for (int i = rings - 1; i >= 0; --i) outline.emplace_back(kSlabRadius * i / rings, -thickness);
  body.surface = turned_surface(outline);
  body.is_fixed = [=](const Vec3& x) { return x.z() < -thickness + kHair; };
  body.is_touchable = [](const Vec3& x) { return x.z() > -kHair && across(x) < 5.5; };
  body.solve = [=](const BodyCase& self, BodyLoad load, double nu, int refinement) {
    return solve_turned(self, thickness, load, nu, refinement);
  };
  return body;
}

BodyCase raised(const Raised& shape, const std::string& name, const std::string& what) {
  BodyCase body;
  body.name = name;
  body.what = what;
  body.turned = false;
  // Between 0 and 1 blocks change by 0.1 % in force, the bar by 0.9 %.
  body.refinement = shape.held_below ? 0 : 1;
  // A flat end that doesn't turn would have to pull at a bar that does.
  body.loads = {shape.held_below ? BodyLoad::kFlat : BodyLoad::kStick, BodyLoad::kPress};
  std::vector<double> z;
  for (const double off : surface_lines(0.0, shape.depth, 0.0)) z.insert(z.begin(), -off);
  body.surface = lined_box(surface_lines(-shape.left, shape.right, 0.0),
                           surface_lines(-shape.side, shape.side, 0.0), z);
  body.is_fixed = [=](const Vec3& x) {
    return shape.held_below ? x.z() < -shape.depth + kHair : x.x() < -shape.left + kHair;
  };
  const auto is_fixed = body.is_fixed;
  body.is_touchable = [is_fixed](const Vec3& x) { return !is_fixed(x) && x.norm() < 5.5; };
  body.solve = [=](const BodyCase& self, BodyLoad load, double nu, int refinement) {
    return solve_raised(self, shape, load, nu, refinement);
  };
  return body;
}

/// Cells of a pattern on the body's top.
std::vector<ContactCell> laid(const BodyCase& body, const CellPattern& pattern) {
  if (body.cap > 0.0) {
    auto cells = cap_cells(body.cap, pattern);
    for (ContactCell& cell : cells) cell.position.z() -= body.cap;
    return cells;
  }
  Vec3 low = body.surface.vertices.front(), high = low;
  for (const Vec3& x : body.surface.vertices) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  std::vector<ContactCell> cells;
  for (std::size_t k = 0; k < pattern.places.size(); ++k) {
    const Vec2& place = pattern.places[k];
    const bool inside =
        place.x() > low.x() && place.x() < high.x() && place.y() > low.y() && place.y() < high.y();
    if (!inside) continue;
    ContactCell cell;
    cell.position = Vec3(place.x(), place.y(), 0.0);
    cell.area = pattern.areas[k];
    cells.push_back(cell);
  }
  return cells;
}

/// Lambert's projection of a cap within radius 1 of the axis.
double reach_on(const BodyCase& body) {
  return body.cap > 0.0 ? 2.0 * body.cap * std::sin(0.5 * std::asin(1.0 / body.cap)) : 1.0;
}

}  // namespace

std::string_view name_of(BodyLoad load) {
  switch (load) {
    case BodyLoad::kStick:
      return "stick";
    case BodyLoad::kFlat:
      return "flat";
    case BodyLoad::kBall:
      return "ball";
    case BodyLoad::kPlate:
      return "plate";
    case BodyLoad::kPress:
      return "press";
  }
  return "";
}

double depth_of(const BodyCase& body, BodyLoad load) {
  switch (load) {
    case BodyLoad::kStick:
    case BodyLoad::kFlat:
      return 0.1;
    case BodyLoad::kBall:
      return 1.0 / kBodyBall;
    case BodyLoad::kPlate:
      return 1.0 / body.cap;
    case BodyLoad::kPress:
      return 0.0;
  }
  return 0.0;
}

double half_space_force(const BodyCase& body, BodyLoad load, double poisson_ratio) {
  const double depth = depth_of(body, load);
  const double modulus = 1.0 / (1.0 - poisson_ratio * poisson_ratio);
  const double e = 1.0 - 2.0 * poisson_ratio;
  switch (load) {
    case BodyLoad::kStick:
      return 2.0 / (1.0 + poisson_ratio) * depth * std::log1p(2.0 * e) / e;
    case BodyLoad::kFlat:
      return 2.0 * modulus * depth;
    case BodyLoad::kBall:
      return 4.0 / 3.0 * modulus * std::sqrt(kBodyBall) * std::pow(depth, 1.5);
    case BodyLoad::kPlate:
      return 4.0 / 3.0 * modulus * std::sqrt(body.cap) * std::pow(depth, 1.5);
    case BodyLoad::kPress:
      return std::numbers::pi / 3.0;
  }
  return 0.0;
}

const std::vector<BodyCase>& body_cases() {
  static const std::vector<BodyCase> cases = {
      ball(),
      slab(2.0, "slab_2"),
      slab(3.5, "slab_3.5"),
      slab(5.0, "slab_5"),
      raised({10.8, 1.2, 6.0, 6.0, true}, "edge_1.2", "a block, pressed 1.2 a from its edge"),
      raised({10.0, 2.0, 6.0, 6.0, true}, "edge_2", "a block, pressed 2 a from its edge"),
      raised({8.0, 4.0, 6.0, 6.0, true}, "edge_4", "a block, pressed 4 a from its edge"),
      raised({14.0, 2.0, 2.0, 4.0, false}, "bar",
             "a bar of 16 x 4 x 4 a held at its end, pressed 2 a from the other")};
  return cases;
}

Result<std::unique_ptr<PressedBody>> prepare_body(const BodyCase& body, double poisson_ratio,
                                                  std::size_t nodes, const std::string& formulation,
                                                  const Progress& progress) {
  TriangleSurface surface = body.surface;
  for (Vec3& x : surface.vertices) x *= kBodyUnit;
  const auto spacing = even_spacing_for(surface, nodes, progress);
  if (!spacing) return std::unexpected(spacing.error());
  const auto over_unit = [](std::function<bool(const Vec3&)> is) {
    return [is = std::move(is)](const Vec3& x) { return is(x / kBodyUnit); };
  };
  return PressedBody::prepare({std::move(surface),
                               {kBodyModulus, poisson_ratio},
                               [h = *spacing](const Vec3&) { return h; },
                               over_unit(body.is_fixed),
                               over_unit(body.is_touchable),
                               formulation},
                              progress);
}

std::vector<ContactCell> cells_of(const BodyCase& body, BodyLoad load, double poisson_ratio) {
  const bool moves = load == BodyLoad::kStick || load == BodyLoad::kFlat;
  CellPattern pattern;
  if (moves)
    pattern = fitted_to_punch(ringed_disc(1.0, kRings), reach_on(body), poisson_ratio,
                              load == BodyLoad::kStick);
  else if (load == BodyLoad::kPress)
    pattern = ringed_disc(reach_on(body), kPressRings);
  else
    pattern = hexagonal_grid(kBallReach / kRings, kRings);
  std::vector<ContactCell> cells = laid(body, pattern);
  for (ContactCell& cell : cells) {
    cell.direction = -Vec3::UnitZ();
    cell.depth = kBodyUnit * depth_at(body, load, cell.position);
    cell.held = load == BodyLoad::kStick;
    cell.displacement = cell.held ? Vec3(0.0, 0.0, -cell.depth) : Vec3(Vec3::Zero());
    cell.position *= kBodyUnit;
    cell.area *= kBodyUnit * kBodyUnit;
  }
  return cells;
}

PressedAnswer press_body(PressedBody& prepared, const BodyCase& body, BodyLoad load) {
  const auto cells = cells_of(body, load, prepared.material().poisson_ratio);
  if (load != BodyLoad::kPress) return prepared.press(cells);
  // Scaled to the pressure's own force, which sums over cells miss by 0.3 %.
  double whole = 0.0;
  for (const ContactCell& cell : cells)
    whole += pressure_at(across(cell.position) / kBodyUnit) * cell.area / (kBodyUnit * kBodyUnit) *
             cell.normal.z();
  const double scale = std::numbers::pi / 3.0 / whole;
  std::vector<Vec3> forces;
  for (const ContactCell& cell : cells)
    forces.push_back(-scale * kBodyModulus * pressure_at(across(cell.position) / kBodyUnit) *
                     cell.area * cell.normal);
  return prepared.load(cells, forces);
}

BodyErrors errors_of(const PressedBody& prepared, const BodyCase& body, const PressedAnswer& answer,
                     const BodyReference& reference) {
  BodyErrors errors;
  errors.force = -answer.force.z() / (kBodyModulus * kBodyUnit * kBodyUnit) / reference.force - 1.0;
  double error = 0.0, size = 0.0;
  const int turns = body.turned ? 6 : 1;
  for (const BodyReference::Sample& sample : reference.samples)
    for (int turn = 0; turn < turns; ++turn) {
      // A seventh of a turn off, so that samples don't follow the surface's own lines.
      const Eigen::AngleAxisd about(
          body.turned ? 2.0 * std::numbers::pi * (turn + 1.0 / 7.0) / turns : 0.0, Vec3::UnitZ());
      const Vec3 found =
          prepared.displacement_at(answer, kBodyUnit * (about * sample.place)) / kBodyUnit;
      error += sample.weight * (found - about * sample.displacement).squaredNorm();
      size += sample.weight * sample.displacement.squaredNorm();
    }
  errors.profile = std::sqrt(error / size);
  return errors;
}

}  // namespace viscera
