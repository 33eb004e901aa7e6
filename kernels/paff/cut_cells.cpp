#include "kernels/paff/cut_cells.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "kernels/base/parallel.h"
#include "kernels/base/random.h"
#include "kernels/paff/tissue_paths.h"
#include "kernels/points/closed_pieces.h"

namespace viscera {
namespace {

// Volume and first moments of (body ∩ cell) from the surface alone: by the divergence theorem along
// x, with X the length of the cell's row that lies before the surface,
//   V = ∮ X dA,  M_x = ∮ X²/2 dA,  M_y = ∮ y X dA,  M_z = ∮ z X dA,   dA = n_x dS,
//   M_xx = ∮ X³/3 dA,  M_xy = ∮ y X²/2 dA,  M_yy = ∮ y² X dA, and so on
// over the surface inside the cell's (y, z) column; X = x − x0 inside the cell, the side beyond it,
// 0 before it. Signs need no care: dA is the signed area projected on the (y, z) plane.

/// A triangle clipped to a column: convex, at most 3 + 4 corners, two more after splitting at x,
/// and room for the doubles that round-off may leave.
struct Polygon {
  std::array<Vec3, 12> corners;
  int count = 0;

  void add(const Vec3& corner) {
    if (count < static_cast<int>(corners.size()))
      corners[static_cast<std::size_t>(count++)] = corner;
  }
  double lowest(int axis) const {
    double value = corners[0][axis];
    for (int i = 1; i < count; ++i)
      value = std::min(value, corners[static_cast<std::size_t>(i)][axis]);
    return value;
  }
  double highest(int axis) const {
    double value = corners[0][axis];
    for (int i = 1; i < count; ++i)
      value = std::max(value, corners[static_cast<std::size_t>(i)][axis]);
    return value;
  }
};

/// The part with coordinate[axis] <= limit (keep_below) or >= limit.
Polygon clip(const Polygon& polygon, int axis, double limit, bool keep_below) {
  const double sign = keep_below ? 1.0 : -1.0;
  Polygon kept;
  for (int i = 0; i < polygon.count; ++i) {
    const Vec3& a = polygon.corners[static_cast<std::size_t>(i)];
    const Vec3& b = polygon.corners[static_cast<std::size_t>((i + 1) % polygon.count)];
    const double outside_a = sign * (a[axis] - limit);
    const double outside_b = sign * (b[axis] - limit);
    if (outside_a <= 0.0) kept.add(a);
    if ((outside_a < 0.0 && outside_b > 0.0) || (outside_a > 0.0 && outside_b < 0.0)) {
      Vec3 crossing = a + (b - a) * (outside_a / (outside_a - outside_b));
      crossing[axis] = limit;
      kept.add(crossing);
    }
  }
  return kept;
}

/// Appends the part of `polygon` over the column [low, low + side)² of (y, z), if any.
void clip_to_column(const Polygon& polygon, double low_y, double low_z, double side,
                    std::vector<Polygon>& out) {
  if (polygon.highest(1) < low_y || polygon.lowest(1) > low_y + side ||
      polygon.highest(2) < low_z || polygon.lowest(2) > low_z + side) {
    return;
  }
  Polygon part = clip(polygon, 1, low_y, false);
  if (part.count > 2) part = clip(part, 1, low_y + side, true);
  if (part.count > 2) part = clip(part, 2, low_z, false);
  if (part.count > 2) part = clip(part, 2, low_z + side, true);
  if (part.count > 2) out.push_back(part);
}

struct CellMoments {
  double volume = 0.0;
  Vec3 first = Vec3::Zero();   ///< relative to the cell's low corner
  Mat3 second = Mat3::Zero();  ///< the same; only for degree 2, only the upper triangle

  /// About a corner that lies so far below.
  void shift(const Vec3& by) {
    second += by * first.transpose() + first * by.transpose() + volume * by * by.transpose();
    first += volume * by;
  }
  void operator+=(const CellMoments& other) {
    volume += other.volume;
    first += other.first;
    second += other.second;
  }
};

/// Adds one convex piece, wholly inside the cell's range of x or wholly beyond it.
/// Edge midpoints of the fan's triangles integrate quadratics exactly, as degree 1 needs.
void add_piece(const Polygon& piece, const Vec3& low, double side, bool beyond, int degree,
               CellMoments& moments) {
  for (int i = 1; i + 1 < piece.count; ++i) {
    const Vec3 a = piece.corners[0] - low;
    const Vec3 b = piece.corners[static_cast<std::size_t>(i)] - low;
    const Vec3 c = piece.corners[static_cast<std::size_t>(i + 1)] - low;
    const double projected =
        0.5 * ((b.y() - a.y()) * (c.z() - a.z()) - (b.z() - a.z()) * (c.y() - a.y()));
    const Vec3 midpoints[3] = {0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)};
    for (const Vec3& p : midpoints) {
      const double length = beyond ? side : p.x();
      const double share = projected / 3.0 * length;
      moments.volume += share;
      moments.first += share * Vec3(0.5 * length, p.y(), p.z());
    }
    if (degree < 2) continue;
    // Second moments have cubic integrands: corners, midpoints and centre, weighted 3, 8 and 27.
    const auto add_second = [&](const Vec3& p, double weight) {
      const double length = beyond ? side : p.x();
      const double share = weight * projected * length;
      moments.second(0, 0) += share * length * length / 3.0;
      moments.second(0, 1) += share * 0.5 * length * p.y();
      moments.second(0, 2) += share * 0.5 * length * p.z();
      moments.second(1, 1) += share * p.y() * p.y();
      moments.second(1, 2) += share * p.y() * p.z();
      moments.second(2, 2) += share * p.z() * p.z();
    };
    for (const Vec3& p : {a, b, c}) add_second(p, 3.0 / 60.0);
    for (const Vec3& p : midpoints) add_second(p, 8.0 / 60.0);
    add_second((a + b + c) / 3.0, 27.0 / 60.0);
  }
}

CellMoments cell_moments(const std::vector<Polygon>& polygons, const Vec3& low, double side,
                         int degree) {
  CellMoments moments;
  const double x0 = low.x(), x1 = low.x() + side;
  for (const Polygon& polygon : polygons) {
    if (polygon.highest(0) <= x0) continue;
    if (polygon.lowest(0) >= x1) {
      add_piece(polygon, low, side, true, degree, moments);
      continue;
    }
    const Polygon after = polygon.lowest(0) < x0 ? clip(polygon, 0, x0, false) : polygon;
    if (after.count < 3) continue;
    if (after.highest(0) <= x1) {
      add_piece(after, low, side, false, degree, moments);
      continue;
    }
    add_piece(clip(after, 0, x1, true), low, side, false, degree, moments);
    add_piece(clip(after, 0, x1, false), low, side, true, degree, moments);
  }
  return moments;
}

/// L with L Lᵀ the covariance of the part: four points centroid + L t of equal weight, t every
/// other corner of the cube [−1, 1]³ (Σ t tᵀ = 4 identity), have its moments up to degree 2.
Mat3 spread(const CellMoments& moments, const Vec3& centroid) {
  Mat3 covariance = moments.second.selfadjointView<Eigen::Upper>();
  covariance = covariance / moments.volume - centroid * centroid.transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(covariance);
  // Slivers: round-off may leave a variance a little below zero.
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

/// Whether walls in the cell face each other across air.
bool is_divided(const std::vector<Polygon>& polygons, double x0, double side) {
  struct Wall {
    Vec3 centre, area;
  };
  std::vector<Wall> walls;
  for (const Polygon& polygon : polygons) {
    if (polygon.highest(0) <= x0 || polygon.lowest(0) >= x0 + side) continue;
    const Polygon inside = clip(clip(polygon, 0, x0, false), 0, x0 + side, true);
    if (inside.count < 3) continue;
    Wall wall{Vec3::Zero(), Vec3::Zero()};
    for (int i = 0; i < inside.count; ++i)
      wall.centre += inside.corners[static_cast<std::size_t>(i)] / inside.count;
    for (int i = 1; i + 1 < inside.count; ++i)
      wall.area += (inside.corners[static_cast<std::size_t>(i)] - inside.corners[0])
                       .cross(inside.corners[static_cast<std::size_t>(i + 1)] - inside.corners[0]);
    wall.area.stableNormalize();
    walls.push_back(wall);
  }
  constexpr double kOpposed = 0.01;  // a right angle isn't a gap
  const double slack = 1e-6 * side;
  for (std::size_t a = 0; a < walls.size(); ++a)
    for (std::size_t b = a + 1; b < walls.size(); ++b) {
      const Vec3 across = walls[b].centre - walls[a].centre;
      if (walls[a].area.dot(walls[b].area) < -kOpposed && across.dot(walls[a].area) > slack &&
          -across.dot(walls[b].area) > slack)
        return true;
    }
  return false;
}

/// Every other corner of a cube: what they sum up to has the moments of degree 2 of a ball.
const std::array<Vec3, 4> kCorners{Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1),
                                   Vec3(-1, -1, 1)};

/// Leaves of one base column, in order, with the first defect found.
struct ColumnResult {
  std::vector<Vec3> positions;
  std::vector<double> weights;
  std::size_t cut_cells = 0;
  bool sound = true;
  Vec3 defect = Vec3::Zero();
};

class ColumnBuilder {
 public:
  ColumnBuilder(const LocalSpacing& spacing, int degree, const TissuePaths* paths, SmallCells small,
                ColumnResult& out)
      : spacing_(spacing), degree_(degree), paths_(paths), small_(small), out_(out) {}

  void cell(const Vec3& low, double side, const std::vector<Polygon>& polygons) {
    const double x0 = low.x(), x1 = low.x() + side;
    bool cut = false, any = false;
    for (const Polygon& polygon : polygons) {
      any = any || polygon.highest(0) > x0;
      cut = cut || (polygon.highest(0) > x0 && polygon.lowest(0) < x1);
    }
    if (!any) return;
    if (cut && side > 0.5 * spacing_(low + Vec3::Constant(0.5 * side))) {
      split(low, side, polygons);
      return;
    }
    const CellMoments moments = cell_moments(polygons, low, side, degree_);
    const double share = moments.volume / (side * side * side);
    constexpr double kSlack = 1e-6;  // round-off of the clipping is some 1e-12 of a cell
    const bool sound = std::isfinite(share) && share > -kSlack && share < 1.0 + kSlack &&
                       (cut || share < kSlack || share > 1.0 - kSlack);
    if (!sound) {
      if (out_.sound) out_.defect = low + Vec3::Constant(0.5 * side);
      out_.sound = false;
      return;
    }
    if (!cut) {
      if (share > 0.5) whole(low, side);
      return;
    }
    // Dropping by a larger threshold would spoil the compatibility of the consistent gradients.
    if (share < 1e-9) return;
    ++out_.cut_cells;
    if (!paths_) {
      add_cut(low, side, moments);
    } else if (is_divided(polygons, x0, side) || !add_within(low, side, moments)) {
      add_parts(low, side, polygons);
    }
  }

 private:
  /// A piece of a cell, put together with others again.
  struct SmallBox {
    CellMoments moments;  ///< about the whole cell's low corner
    Vec3 centroid;
  };

  /// The points of a part that the cell holds; of degree 2 they are turned by `turn`.
  void add_cut(const Vec3& low, double side, const CellMoments& moments,
               const Mat3& turn = Mat3::Identity()) {
    const Vec3 centroid = (moments.first / moments.volume).cwiseMax(0.0).cwiseMin(side);
    if (degree_ < 2) {
      add(low + centroid, moments.volume);
      return;
    }
    const Mat3 reach = spread(moments, centroid) * turn;
    for (const Vec3& corner : kCorners) {
      add(low + centroid + reach * corner, 0.25 * moments.volume);
    }
  }

  /// Adds a part, unless its points of degree 2 leave the tissue however they are turned: any turn
  /// leaves their moments as they are.
  bool add_within(const Vec3& low, double side, const CellMoments& moments) {
    constexpr std::uint64_t kTurns = 32;
    constexpr double kWithin = 1.001;  // a point on a wall might be seen from beyond it
    if (degree_ < 2) {
      add_cut(low, side, moments);
      return true;
    }
    const Vec3 centroid = (moments.first / moments.volume).cwiseMax(0.0).cwiseMin(side);
    const Mat3 reach = spread(moments, centroid);
    const Random random(1, 0);
    std::vector<SurfaceTree::Crossing> found;
    for (std::uint64_t k = 0; k < kTurns; ++k) {
      const Mat3 turn = k == 0 ? Mat3(Mat3::Identity())
                               : Mat3(Eigen::AngleAxisd(std::numbers::pi * random.uniform(100 + k),
                                                        random.direction(k)));
      const bool within = std::all_of(kCorners.begin(), kCorners.end(), [&](const Vec3& corner) {
        const Vec3 from = low + centroid;
        paths_->tree().crossings(from, from + kWithin * (reach * (turn * corner)), found);
        return found.empty();
      });
      if (!within) continue;
      add_cut(low, side, moments, turn);
      return true;
    }
    return false;
  }

  /// Parts of a cell that air divides: smaller boxes, halved wherever walls still face each other,
  /// put together again by what sees the largest.
  void add_parts(const Vec3& low, double side, const std::vector<Polygon>& polygons) {
    std::vector<SmallBox> boxes;
    gather(low, low, side, 0, polygons, boxes);
    std::stable_sort(boxes.begin(), boxes.end(), [](const SmallBox& a, const SmallBox& b) {
      return a.moments.volume > b.moments.volume;
    });
    double left = 0.0;
    for (const SmallBox& box : boxes) left += box.moments.volume;
    const double whole = left;
    std::vector<std::vector<SmallBox>> parts;
    std::vector<Vec3> seeds;
    std::vector<char> taken(boxes.size(), 0);
    // The last slivers, which no seed sees, go to the nearest part.
    for (std::size_t first = 0; first < boxes.size(); ++first) {
      if (taken[first]) continue;
      if (!parts.empty() && left < kSliver * whole) break;
      seeds.push_back(boxes[first].centroid);
      parts.emplace_back();
      for (std::size_t k = first; k < boxes.size(); ++k) {
        if (taken[k] || (k != first && !paths_->straight(seeds.back(), boxes[k].centroid)))
          continue;
        taken[k] = 1;
        parts.back().push_back(boxes[k]);
        left -= boxes[k].moments.volume;
      }
    }
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      if (taken[k]) continue;
      std::size_t nearest = 0;
      for (std::size_t p = 1; p < seeds.size(); ++p)
        if ((seeds[p] - boxes[k].centroid).norm() < (seeds[nearest] - boxes[k].centroid).norm())
          nearest = p;
      parts[nearest].push_back(boxes[k]);
    }
    for (const std::vector<SmallBox>& part : parts) add_part(low, side, part, kLeastHalvings);
  }

  /// One point or four; where these leave the tissue, those of each eighth about the centroid.
  void add_part(const Vec3& low, double side, const std::vector<SmallBox>& boxes, int splits) {
    CellMoments moments;
    for (const SmallBox& box : boxes) moments += box.moments;
    if (add_within(low, side, moments)) return;
    if (boxes.size() == 1 || splits == 0) {
      add_cut(low, side, moments);
      return;
    }
    const Vec3 centroid = low + moments.first / moments.volume;
    std::array<std::vector<SmallBox>, 8> eighths;
    for (const SmallBox& box : boxes) {
      std::size_t at = 0;
      for (int a = 0; a < 3; ++a) at = 2 * at + (box.centroid[a] > centroid[a] ? 1 : 0);
      eighths[at].push_back(box);
    }
    for (const std::vector<SmallBox>& eighth : eighths)
      if (!eighth.empty()) add_part(low, side, eighth, splits - 1);
  }

  static constexpr int kHalvings = 4, kLeastHalvings = 2;
  static constexpr double kSliver = 1e-3;

  void gather(const Vec3& cell, const Vec3& low, double side, int halvings,
              const std::vector<Polygon>& polygons, std::vector<SmallBox>& out) {
    const double volume = side * side * side;
    const bool divided = halvings < kHalvings && is_divided(polygons, low.x(), side);
    if (divided || (degree_ == 2 && halvings < kLeastHalvings)) {
      for_each_eighth(low, side, polygons,
                      [&](const Vec3& corner, double half, const std::vector<Polygon>& narrower) {
                        gather(cell, corner, half, halvings + 1, narrower, out);
                      });
      return;
    }
    CellMoments moments = cell_moments(polygons, low, side, degree_);
    if (!(moments.volume > 1e-12 * volume)) return;
    const Vec3 centroid = (moments.first / moments.volume).cwiseMax(0.0).cwiseMin(side);
    moments.shift(low - cell);
    out.push_back({moments, low + centroid});
  }

  template <class Visit>
  static void for_each_eighth(const Vec3& low, double side, const std::vector<Polygon>& polygons,
                              const Visit& visit) {
    const double half = 0.5 * side;
    std::vector<Polygon> narrower;
    for (int k = 0; k < 2; ++k) {
      for (int j = 0; j < 2; ++j) {
        const double y = low.y() + j * half, z = low.z() + k * half;
        narrower.clear();
        for (const Polygon& polygon : polygons) {
          if (polygon.highest(0) > low.x()) clip_to_column(polygon, y, z, half, narrower);
        }
        for (int i = 0; i < 2; ++i) visit(Vec3(low.x() + i * half, y, z), half, narrower);
      }
    }
  }

  void split(const Vec3& low, double side, const std::vector<Polygon>& polygons) {
    for_each_eighth(low, side, polygons,
                    [&](const Vec3& corner, double half, const std::vector<Polygon>& narrower) {
                      cell(corner, half, narrower);
                    });
  }

  /// A cell that the surface doesn't meet, though it may meet its neighbours of one parent.
  void whole(const Vec3& low, double side) {
    const Vec3 centre = low + Vec3::Constant(0.5 * side);
    if (small_ == SmallCells::kOne && degree_ < 2 && side <= 0.5 * spacing_(centre))
      add(centre, side * side * side);
    else
      inside(low, side);
  }

  void inside(const Vec3& low, double side) {
    const Vec3 centre = low + Vec3::Constant(0.5 * side);
    const double h = spacing_(centre);
    const double half = 0.5 * side;
    if (side > h) {
      for (int i = 0; i < 8; ++i) {
        inside(low + half * Vec3(i & 1, (i >> 1) & 1, (i >> 2) & 1), half);
      }
      return;
    }
    const double gauss = half / std::sqrt(3.0);
    for (int i = 0; i < 8; ++i) {
      const Vec3 direction((i & 1) ? 1.0 : -1.0, (i & 2) ? 1.0 : -1.0, (i & 4) ? 1.0 : -1.0);
      add(centre + gauss * direction, 0.125 * side * side * side);
    }
  }

  void add(const Vec3& position, double weight) {
    out_.positions.push_back(position);
    out_.weights.push_back(weight);
  }

  const LocalSpacing& spacing_;
  int degree_;
  const TissuePaths* paths_;  // null: cells aren't parted
  SmallCells small_;
  ColumnResult& out_;
};

/// Cells are halved until they fit the local spacing; the side to start from, within a factor of
/// two, is the one that wastes the fewest cells on this cloud.
double base_side(const LocalSpacing& spacing) {
  constexpr int kCandidates = 16;
  double best = spacing.largest(), fewest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kCandidates; ++k) {
    const double side = spacing.largest() * std::exp2(-static_cast<double>(k) / kCandidates);
    double cells = 0.0;
    for (const double h : spacing.spacings()) {
      const double leaf = side * std::exp2(-std::max(0.0, std::ceil(std::log2(side / h))));
      cells += std::pow(h / leaf, 3);
    }
    if (cells < fewest) {
      fewest = cells;
      best = side;
    }
  }
  return best;
}

}  // namespace

namespace {

Result<VolumeQuadrature> quadrature_of_piece(const TriangleSurface& surface,
                                             const LocalSpacing& spacing, int degree,
                                             const TissuePaths* paths, SmallCells small) {
  const Box box = bounds(surface);
  const double side = base_side(spacing);
  // Off the round numbers, so that flat faces of a model don't lie in planes of cells.
  const Vec3 low = box.min() - side * Vec3(0.3719, 0.4337, 0.2953);
  const Eigen::Vector3i size =
      ((box.max() - low) / side).array().floor().cast<int>() + Eigen::Array3i::Ones();
  const auto column_of = [&](double value, int axis) {
    return std::clamp(static_cast<int>((value - low[axis]) / side), 0, size[axis] - 1);
  };

  const std::size_t columns =
      static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(size.z());
  std::vector<std::vector<int>> triangles_over(columns);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    Box extent;
    for (const int v : surface.triangles[t])
      extent.extend(surface.vertices[static_cast<std::size_t>(v)]);
    for (int k = column_of(extent.min().z(), 2); k <= column_of(extent.max().z(), 2); ++k) {
      for (int j = column_of(extent.min().y(), 1); j <= column_of(extent.max().y(), 1); ++j) {
        triangles_over[static_cast<std::size_t>(k * size.y() + j)].push_back(static_cast<int>(t));
      }
    }
  }

  std::vector<ColumnResult> results(columns);
  parallel_for_each_index(columns, 4, [&](std::size_t column) {
    const double y =
        low.y() + side * static_cast<double>(column % static_cast<std::size_t>(size.y()));
    const double z =
        low.z() + side * static_cast<double>(column / static_cast<std::size_t>(size.y()));
    std::vector<Polygon> polygons;
    for (const int t : triangles_over[column]) {
      Polygon triangle;
      for (const int v : surface.triangles[static_cast<std::size_t>(t)]) {
        triangle.add(surface.vertices[static_cast<std::size_t>(v)]);
      }
      clip_to_column(triangle, y, z, side, polygons);
    }
    ColumnBuilder builder(spacing, degree, paths, small, results[column]);
    for (int i = 0; i < size.x(); ++i) builder.cell(Vec3(low.x() + i * side, y, z), side, polygons);
  });

  VolumeQuadrature all;
  for (const ColumnResult& result : results) {
    if (!result.sound) {
      std::ostringstream message;
      message << "surface: near (" << result.defect.transpose() * 1e3
              << ") mm it encloses no definite volume; expected a closed surface oriented outwards";
      return failure(message.str());
    }
    all.positions.insert(all.positions.end(), result.positions.begin(), result.positions.end());
    all.weights.insert(all.weights.end(), result.weights.begin(), result.weights.end());
    all.cut_cells += result.cut_cells;
  }
  if (all.positions.empty()) {
    return failure("surface: it encloses no volume; expected a closed surface oriented outwards");
  }
  return all;
}

}  // namespace

Result<VolumeQuadrature> background_quadrature(const TriangleSurface& surface,
                                               const LocalSpacing& spacing, int degree,
                                               const TissuePaths* paths, SmallCells small) {
  if (!paths) return quadrature_of_piece(surface, spacing, degree, nullptr, small);
  VolumeQuadrature all;
  for (const TriangleSurface& piece : closed_pieces(surface)) {
    Result<VolumeQuadrature> one = quadrature_of_piece(piece, spacing, degree, paths, small);
    if (!one) return one;
    all.positions.insert(all.positions.end(), one->positions.begin(), one->positions.end());
    all.weights.insert(all.weights.end(), one->weights.begin(), one->weights.end());
    all.cut_cells += one->cut_cells;
  }
  return all;
}

}  // namespace viscera
