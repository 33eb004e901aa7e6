#include "engine/features/contact/contact_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/contact/cell_pattern.h"

namespace viscera {
namespace {

/// Cells further than this from the tool can't be reached in one frame [m].
constexpr double kGreatestGap = 2e-3;
/// Drags shorter than this say nothing about what the tissue follows [m].
constexpr double kLeastDrag = 1e-7;
/// Walls steeper than this are met sideways: the cosine between the way out of the tissue and the
/// tool's normal.
constexpr double kSteepestWall = -0.1;
/// Rings of the hexagonal pattern: 3 give 37 cells.
constexpr int kPressRings = 3;
constexpr int kGraspRings = 2;

}  // namespace

/// What the spots around had, carried on with the tool; far from them, where no tissue has clung,
/// its own. Weights by the inverse of distance^4: a cell that hasn't moved over the tissue takes
/// over its spot's unchanged.
Vec3 clinging_displacement(const Cling* cling, const Vec3& rest, const Vec3& own,
                           const Vec3& moved) {
  if (!cling) return own;
  const double unit = cling->pitch * cling->pitch;
  double weights = 1.0;
  Vec3 sum = own;
  for (const Cling::Spot& spot : cling->spots) {
    const double near = (spot.rest - rest).squaredNorm() / unit + 1e-8;
    weights += 1.0 / (near * near);
    sum += spot.displacement / (near * near);
  }
  return sum / weights + moved;
}

/// What clings about a cell says where it was carried aside, not how far it lies down the tool's
/// wall: that the tool's own surface says, or the wall would drag the cell along itself.
void put_on_tool(const Vec3& up, ContactCell& cell) {
  const double lowers = up.dot(cell.direction);
  if (lowers > kSteepestWall) return;
  cell.displacement += (cell.depth - cell.displacement.dot(cell.direction)) / lowers * up;
}

Vec3 jaw_travel(const Grasp& grasp, const InstrumentState& state, const Pose& organ) {
  return state.tip - grasp.tip_at_start - (organ.position - grasp.organ_at_start) - grasp.slipped;
}

bool press_cells(const ToolShape& tool, const Foot& foot, const Rubbing& rubbing,
                 const OrganModel& model, const TissueSheet& drawn, const TissueSheet& met,
                 std::vector<ContactCell>& cells, CellRange& range) {
  const TissueSheet& sheet = rubbing.friction > 0.0 ? drawn : met;
  const Vec3& up = foot.outward;
  const auto [e1, e2] = plane_across(up);

  const double a = tool.radius, depth = std::max(0.0, -foot.clearance);
  const double across =
      tool.kind == TipDescription::Shape::kMesh ? a : ball_pattern_radius(a, depth);
  // A capsule lying on the tissue needs a pattern as long as its shadow, in pitches of the same
  // size.
  Vec3 along = Vec3::Zero();
  if (tool.kind == TipDescription::Shape::kCapsule)
    along = tool.length * (tool.shaft - tool.shaft.dot(up) * up);
  const double shadow = along.norm();
  const double pitch = std::max(across, 0.15 * (shadow + across)) / (kPressRings + 0.1);

  static const std::vector<Vec2> kDisc = hexagonal_grid(1.0, kPressRings).places;
  std::vector<Vec3> places;
  if (shadow < 0.3 * a) {
    for (const Vec2& o : kDisc) places.push_back(foot.probe + pitch * (o.x() * e1 + o.y() * e2));
  } else {
    const Vec3 x = along / shadow, y = up.cross(x);
    const double row = std::sqrt(0.75) * pitch;
    const int rows = static_cast<int>(across / row);
    const int columns = static_cast<int>((shadow + 2.0 * across) / pitch);
    for (int j = -rows; j <= rows; ++j)
      for (int i = 0; i <= columns; ++i)
        places.push_back(tool.tip + (i * pitch - across + (j & 1 ? 0.5 * pitch : 0.0)) * x +
                         (j * row) * y);
  }

  const double hexagon_area = std::sqrt(0.75) * pitch * pitch;
  const double span = 2.0 * a + kFrameReach + depth;
  range.begin = cells.size();
  range.outward = up;
  range.tip = tool.tip;
  range.pitch = pitch;
  range.moved = rubbing.cling ? Vec3(tool.tip - rubbing.cling->tip) : Vec3::Zero();
  // The tissue that will be under the tool is sought where it will be dragged from, as it is drawn.
  Vec3 drag = Vec3::Zero();
  if (rubbing.cling) drag = rubbing.cling->followed * range.moved + rubbing.undrawn;
  drag -= drag.dot(up) * up;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vec3& place : places) {
    const auto low = tool.lowest(place, up);
    if (!low) continue;
    const auto hit = tissue_under(place - drag, foot, span, sheet);
    if (!hit) continue;
    const Vec3 lowest = place + low->along * up;
    const double gap = (lowest - hit->position).dot(up);
    if (gap > kGreatestGap) continue;
    ContactCell cell;
    cell.position = position(model.surface, hit->point);
    cell.normal = corner_mean(model.rest_normals, model.surface, hit->point).normalized();
    cell.area = hexagon_area;
    cell.direction = low->outward;
    cell.depth = (lowest - cell.position).dot(cell.direction);
    cell.friction = rubbing.friction;
    if (rubbing.friction > 0.0) {
      cell.displacement =
          clinging_displacement(rubbing.cling, cell.position,
                                hit->position + rubbing.undrawn - cell.position, range.moved);
      put_on_tool(up, cell);
    }
    range.points.push_back(hit->point);
    cells.push_back(cell);
    const double off = (place - foot.probe).norm();
    if (off < nearest) {
      nearest = off;
      range.rest_centre = cell.position;
      range.centre = drawn.position(hit->point);
    }
  }
  range.end = cells.size();
  return range.end > range.begin;
}

Vec3 undrawn_drag(const Cling& cling, const OrganState& state, const OrganModel& model) {
  Vec3 sum = Vec3::Zero();
  for (const Cling::Spot& spot : cling.spots)
    sum += spot.rest + spot.displacement - corner_mean(state.positions, model.surface, spot.point);
  return sum / static_cast<double>(cling.spots.size());
}

Cling clinging_tissue(const CellRange& range, const std::vector<ContactCell>& cells,
                      const ContactSolution& solution, const Cling* last) {
  Cling cling;
  cling.instrument = range.instrument;
  cling.tip = range.tip;
  cling.pitch = range.pitch;
  double pressed = 0.0;
  Vec3 slip = Vec3::Zero();  // times force [m N]
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const ContactCell& cell = cells[k];
    const double push = solution.forces[k].dot(cell.direction);
    if (push <= 0.0) continue;
    const Vec3 across = cell.displacement - cell.displacement.dot(cell.direction) * cell.direction;
    cling.spots.push_back({range.points[k - range.begin], cell.position,
                           across + solution.slips[k] + cell.depth * cell.direction});
    pressed += push;
    slip += push * solution.slips[k];
  }
  cling.followed = last ? last->followed : 1.0;
  const Vec3 dragged = range.moved - range.moved.dot(range.outward) * range.outward;
  if (pressed > 0.0 && dragged.norm() > kLeastDrag)
    cling.followed =
        std::clamp(1.0 + slip.dot(dragged) / (pressed * dragged.squaredNorm()), 0.0, 1.0);
  return cling;
}

std::vector<ContactCell> grasp_cells(const Foot& foot, double radius, const OrganModel& model,
                                     const TissueContact& tissue, const TissueSheet& drawn,
                                     std::vector<SurfacePoint>& points) {
  const auto [e1, e2] = plane_across(foot.outward);
  // A jaw's edge is known: the pattern that answers as a flat disc of this radius.
  const CellPattern pattern =
      fitted_to_punch(hexagonal_grid(1.0, kGraspRings), radius, model.material.poisson_ratio, true);
  std::vector<ContactCell> cells;
  for (std::size_t i = 0; i < pattern.places.size(); ++i) {
    const Vec3 place = foot.position + pattern.places[i].x() * e1 + pattern.places[i].y() * e2;
    const auto hit = tissue_under(place, foot, 2.0 * radius, drawn);
    if (!hit) continue;
    ContactCell cell;
    cell.held = true;
    cell.position = position(model.surface, hit->point);
    cell.normal = corner_mean(model.rest_normals, model.surface, hit->point).normalized();
    cell.area = pattern.areas[i];
    cell.displacement = hit->position - cell.position;
    if (!tissue.touchable(cell.position)) continue;
    cells.push_back(cell);
    points.push_back(hit->point);
  }
  return cells;
}

void let_move(const FreeShape& shape, const TriangleSurface& surface,
              std::span<const SurfacePoint> points, std::span<ContactCell> cells) {
  for (std::size_t k = 0; k < cells.size(); ++k)
    cells[k].free = corner_mean(shape.vertices, surface, points[k]);
}

}  // namespace viscera
