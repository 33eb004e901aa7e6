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

Vec3 tangential(const Vec3& v, const Vec3& up) {
  return v - v.dot(up) * up;
}

}  // namespace

ToolFoot::ToolFoot(double radius, int rings)
    : radius_(radius), pattern_(hexagonal_grid(1.0, rings).places), rings_(rings) {
  cells_.resize(pattern_.size());
  depths_.resize(pattern_.size());
  heights_.resize(pattern_.size());
  pushes_.resize(pattern_.size());
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
  spot_ = spot;
  centre_ = centre;
  up_ = spot.normal;
  depth_ = radius_ - (centre - spot.position).dot(up_);
  side_ = tangential(side_, up_);
  if (side_.squaredNorm() < 0.1) {
    const Vec3 other = std::abs(up_.x()) < 0.7 ? Vec3::UnitX() : Vec3::UnitY();
    side_ = up_.cross(other);
  }
  side_.normalize();
}

Vec3 ToolFoot::mean_normal(const WalkableSurface& surface, const SurfaceSpot& spot) const noexcept {
  const double ring = std::max(kRingRadii * radius_, kRingEdges * surface.mean_edge());
  const Vec3 x = side_, y = up_.cross(side_);
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
  SurfaceSpot spot = spot_;
  for (int step = 0; step < kMostSteps; ++step) {
    up_ = mean_normal(surface, spot);
    const Vec3 beside = tangential(centre - spot.position, up_);
    if (beside.norm() > reach) return false;
    if (beside.norm() < kCloseEnough) break;
    if (surface.straight(beside, spot) != WalkEnd::kFound) return false;
  }
  const double height = (centre - spot.position).dot(up_);
  if (!(std::abs(height) < reach)) return false;
  // Carried along without turning about `up`, so that the pattern doesn't spin.
  side_ = tangential(side_, up_).normalized();
  spot_ = spot;
  centre_ = centre;
  depth_ = radius_ - height;
  return true;
}

void ToolFoot::lay_cells(const WalkableSurface& surface) noexcept {
  // [Hertz1882]: a ball that is d deep touches within sqrt(R d); the pattern is a little wider, and
  // never narrower than a third of the ball.
  const double touching = std::sqrt(radius_ * std::max(0.0, depth_));
  across_ = std::clamp(1.35 * touching + 0.15 * radius_, 0.3 * radius_, 0.97 * radius_);
  const double pitch = across_ / (rings_ + 0.1);
  const double area = std::sqrt(0.75) * pitch * pitch;
  const Vec3 x = side_, y = up_.cross(side_);
  for (std::size_t k = 0; k < pattern_.size(); ++k) {
    const Vec3 offset = pitch * (pattern_[k].x() * x + pattern_[k].y() * y);
    ContactCell& cell = cells_[k];
    SurfaceSpot spot = spot_;
    // A geodesic of that length ends a little short of the line through centre + offset along up.
    bool there = surface.straight(offset, spot) == WalkEnd::kFound;
    if (there)
      there = surface.straight(tangential(centre_ + offset - spot.position, up_), spot) ==
              WalkEnd::kFound;
    cell.position = there ? spot.position : spot_.position;
    cell.normal = there ? spot.normal : spot_.normal;
    cell.area = area;
    cell.direction = -up_;
    const Vec3 beside = tangential(cell.position - centre_, up_);
    const double drop = radius_ * radius_ - beside.squaredNorm();
    const double lowest = -std::sqrt(std::max(0.0, drop));  // over the centre, along up
    depths_[k] = there && drop > 0.0 ? (cell.position - centre_).dot(up_) - lowest : -kNowhere;
    heights_[k] = there ? (cell.position - centre_).dot(up_) : kNoHeight;
    cell.depth = depths_[k];
  }
  for (std::size_t k = 0; k < pattern_.size(); ++k) lean(k, pitch);
}

// From neighbours a pitch away, not from the facet: as a cell passes an edge its push turns slowly.
void ToolFoot::lean(std::size_t cell, double pitch) noexcept {
  Vec2 slope = Vec2::Zero();
  if (heights_[cell] != kNoHeight)
    for (const Neighbour& one : neighbours_[cell])
      if (heights_[one.cell] != kNoHeight)
        slope += (heights_[one.cell] - heights_[cell]) / pitch * one.weight;
  pushes_[cell] = up_ - slope.x() * side_ - slope.y() * up_.cross(side_);
}

}  // namespace viscera
