#include "haptics/tool_foot.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/contact/cell_pattern.h"

namespace viscera {
namespace {

/// The ring over which normals are averaged, in radii of the ball and in edges of the surface:
/// wider than the dent and than a facet.
constexpr double kRingRadii = 2.0, kRingEdges = 1.5;
/// Steps of a tick towards the foot; each leaves a share depth / (radius of curvature) of the
/// error.
constexpr int kMostSteps = 8;
constexpr double kCloseEnough = 1e-8;  // [m]
/// Cells of a hexagonal pattern whose slopes are taken together are this near [pitches].
constexpr double kNextCell = 1.1;
/// A cell that found no surface stands this far off [m].
constexpr double kNowhere = 1e-2;
constexpr double kNoHeight = -1e9;
/// Of the cosine between the normals of two cells: below, an edge lies under the tool.
constexpr double kEdge = 0.5;

Vec3 tangential(const Vec3& v, const Vec3& up) {
  return v - v.dot(up) * up;
}

}  // namespace

ToolFoot::ToolFoot(double radius, int rings, CellWays ways)
    : radius_(radius), ways_(ways), pattern_(hexagonal_grid(1.0, rings).places), rings_(rings) {
  state_.cells.resize(pattern_.size());
  state_.depths.resize(pattern_.size());
  state_.heights.resize(pattern_.size());
  state_.pushes.assign(pattern_.size(), Vec3::Zero());
  neighbours_.resize(pattern_.size());
  for (std::size_t k = 0; k < pattern_.size(); ++k) {
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (std::size_t j = 0; j < pattern_.size(); ++j) {
      const Vec2 apart = pattern_[j] - pattern_[k];
      if (j == k || apart.norm() > kNextCell) continue;
      neighbours_[k].push_back({j, apart});
      spread += apart * apart.transpose();
    }
    const Eigen::Matrix2d inverse = spread.inverse();
    for (Neighbour& one : neighbours_[k]) one.weight = inverse * one.weight;
  }
}

void ToolFoot::start(const SurfaceSpot& spot, const Vec3& centre) noexcept {
  state_.spot = spot;
  state_.centre = centre;
  state_.up = spot.normal;
  state_.depth = radius_ - (centre - spot.position).dot(state_.up);
  state_.side = tangential(state_.side, state_.up);
  if (state_.side.squaredNorm() < 0.1) {
    const Vec3 other = std::abs(state_.up.x()) < 0.7 ? Vec3::UnitX() : Vec3::UnitY();
    state_.side = state_.up.cross(other);
  }
  state_.side.normalize();
}

Vec3 ToolFoot::mean_normal(const WalkableSurface& surface, const SurfaceSpot& spot) const noexcept {
  const double ring = std::max(kRingRadii * radius_, kRingEdges * surface.mean_edge());
  const Vec3 x = state_.side, y = state_.up.cross(state_.side);
  Vec3 sum = spot.normal;
  constexpr double kSixty = 0.86602540378443865;
  constexpr std::array<std::array<double, 2>, 6> kAround{
      {{1, 0}, {.5, kSixty}, {-.5, kSixty}, {-1, 0}, {-.5, -kSixty}, {.5, -kSixty}}};
  for (const double share : {1.0, 0.55})
    for (const auto& [a, b] : kAround) {
      SurfaceSpot there = spot;
      if (surface.straight(share * ring * (a * x + b * y), there) == WalkEnd::kFound)
        sum += there.normal;
    }
  return sum.normalized();
}

bool ToolFoot::follow(const WalkableSurface& surface, const Vec3& centre, double reach) noexcept {
  if (!standing() || !centre.allFinite()) return false;
  SurfaceSpot spot = state_.spot;
  for (int step = 0; step < kMostSteps; ++step) {
    state_.up = mean_normal(surface, spot);
    const Vec3 beside = tangential(centre - spot.position, state_.up);
    if (beside.norm() > reach) return false;
    if (beside.norm() < kCloseEnough) break;
    if (surface.straight(beside, spot) != WalkEnd::kFound) return false;
  }
  const double height = (centre - spot.position).dot(state_.up);
  if (!(std::abs(height) < reach)) return false;
  // Carried along without turning about `up`, so that the pattern doesn't spin.
  state_.side = tangential(state_.side, state_.up).normalized();
  state_.spot = spot;
  state_.centre = centre;
  state_.depth = radius_ - height;
  return true;
}

void ToolFoot::lay_cells(const WalkableSurface& surface) noexcept {
  state_.across = ball_pattern_radius(radius_, state_.depth);
  const double pitch = state_.across / (rings_ + 0.1);
  const double area = std::sqrt(0.75) * pitch * pitch;
  const Vec3 x = state_.side, y = state_.up.cross(state_.side);
  for (std::size_t k = 0; k < pattern_.size(); ++k) {
    const Vec3 offset = pitch * (pattern_[k].x() * x + pattern_[k].y() * y);
    ContactCell& cell = state_.cells[k];
    SurfaceSpot spot = state_.spot;
    // A geodesic of that length ends a little short of the line through centre + offset along up.
    bool there = surface.straight(offset, spot) == WalkEnd::kFound;
    if (there)
      there = surface.straight(tangential(state_.centre + offset - spot.position, state_.up),
                               spot) == WalkEnd::kFound;
    cell.position = there ? spot.position : state_.spot.position;
    cell.normal = there ? spot.normal : state_.spot.normal;
    cell.area = area;
    cell.direction = -state_.up;
    const Vec3 beside = tangential(cell.position - state_.centre, state_.up);
    const double drop = radius_ * radius_ - beside.squaredNorm();
    const double lowest = -std::sqrt(std::max(0.0, drop));  // over the centre, along up
    if (ways_ == CellWays::kOwnNormals && there && drop > 0.0)
      cell.direction = (beside + lowest * state_.up) / radius_;
    state_.depths[k] =
        there && drop > 0.0
            ? deepening(k) * ((cell.position - state_.centre).dot(state_.up) - lowest)
            : -kNowhere;
    state_.heights[k] = there ? (cell.position - state_.centre).dot(state_.up) : kNoHeight;
    cell.depth = state_.depths[k];
  }
  for (std::size_t k = 0; k < pattern_.size(); ++k) lean(k, pitch);
}

bool ToolFoot::whole() const {
  for (std::size_t k = 0; k < pattern_.size(); ++k)
    for (std::size_t l = 0; l < k; ++l)
      if (!(state_.cells[k].normal.dot(state_.cells[l].normal) > kEdge)) return false;
  return true;
}

bool ToolFoot::fits(const State& state, const WalkableSurface& surface) const {
  const std::size_t n = pattern_.size();
  return surface.has(state.spot.point) && state.cells.size() == n && state.depths.size() == n &&
         state.heights.size() == n && state.pushes.size() == n;
}

// From neighbours a pitch away, not from the facet: as a cell passes an edge its push turns slowly.
void ToolFoot::lean(std::size_t cell, double pitch) noexcept {
  Vec2 slope = Vec2::Zero();
  if (state_.heights[cell] != kNoHeight)
    for (const Neighbour& one : neighbours_[cell])
      if (state_.heights[one.cell] != kNoHeight)
        slope += (state_.heights[one.cell] - state_.heights[cell]) / pitch * one.weight;
  state_.pushes[cell] = deepening(cell) * (state_.up - slope.x() * state_.side -
                                           slope.y() * state_.up.cross(state_.side));
}

}  // namespace viscera
