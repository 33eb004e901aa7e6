#include "kernels/paff/nodal_measures.h"

#include <array>
#include <cmath>
#include <map>
#include <span>

#include "kernels/paff/cut_cells.h"
#include "kernels/paff/local_spacing.h"
#include "kernels/paff/point_fields.h"
#include "kernels/paff/shape_functions.h"
#include "kernels/paff/true_neighbours.h"
#include "kernels/points/kd_tree.h"

namespace viscera {
namespace {

using Corners = std::array<Vec3, 3>;

/// Sums the area of a triangle's parts by the node nearest to each.
class TriangleDivider {
 public:
  explicit TriangleDivider(const PointCloud& cloud)
      : cloud_(cloud), nodes_(std::span<const Vec3>(cloud.positions).first(cloud.surface_count)) {}

  void divide(const Corners& corners, std::map<int, double>& area_of_node) {
    std::size_t longest = 0;
    double length2 = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double edge2 = (corners[(i + 1) % 3] - corners[i]).squaredNorm();
      if (edge2 > length2) {
        length2 = edge2;
        longest = i;
      }
    }
    const Vec3 centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    nodes_.nearest(centre, 1, -1, found_);
    const int node = found_.front().index;
    const double h = cloud_.spacings[static_cast<std::size_t>(node)];
    if (length2 > h * h / 16.0) {
      const Vec3& a = corners[longest];
      const Vec3& b = corners[(longest + 1) % 3];
      const Vec3& c = corners[(longest + 2) % 3];
      const Vec3 middle = 0.5 * (a + b);
      divide({a, middle, c}, area_of_node);
      divide({middle, b, c}, area_of_node);
      return;
    }
    area_of_node[node] += 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
  }

 private:
  const PointCloud& cloud_;
  KdTree nodes_;
  std::vector<KdTree::Found> found_;
};

}  // namespace

SurfacePatches::SurfacePatches(const TriangleSurface& surface, const PointCloud& cloud)
    : begin_(cloud.surface_count + 1, 0),
      areas_(cloud.surface_count, 0.0),
      normals_(cloud.surface_count, Vec3::Zero()) {
  if (cloud.surface_count == 0) return;
  TriangleDivider divider(cloud);
  std::vector<std::pair<int, Part>> all;
  std::map<int, double> area_of_node;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const Vec3 normal = area_vector(surface, t).stableNormalized();
    if (normal.isZero()) continue;  // a triangle without area
    const auto& corners = surface.triangles[static_cast<std::size_t>(t)];
    const auto corner = [&](std::size_t i) {
      return surface.vertices[static_cast<std::size_t>(corners[i])];
    };
    area_of_node.clear();
    divider.divide({corner(0), corner(1), corner(2)}, area_of_node);
    for (const auto& [node, area] : area_of_node) all.push_back({node, {normal, area}});
  }
  for (const auto& [node, part] : all) {
    const auto i = static_cast<std::size_t>(node);
    ++begin_[i + 1];
    areas_[i] += part.area;
    normals_[i] += part.area * part.normal;
  }
  for (std::size_t i = 0; i < cloud.surface_count; ++i) {
    begin_[i + 1] += begin_[i];
    if (areas_[i] > 0.0) normals_[i] /= areas_[i];
  }
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  parts_.resize(all.size());
  for (const auto& [node, part] : all) parts_[next[static_cast<std::size_t>(node)]++] = part;
}

Result<std::vector<double>> nodal_volumes(const TriangleSurface& surface, const PointCloud& cloud) {
  constexpr double kSupportFactor = 1.8;  // that of `galerkin`
  return nodal_volumes(surface, cloud, ShapeFunctions(cloud, kSupportFactor));
}

Result<std::vector<double>> nodal_volumes(
    const TriangleSurface& surface, const PointCloud& cloud, const ShapeFunctions& fields,
    const std::function<double(const Vec3& x, double edge)>& density) {
  const TissuePaths* paths =
      fields.true_neighbours() ? &fields.true_neighbours()->paths() : nullptr;
  auto volume = background_quadrature(surface, LocalSpacing(cloud), 1, paths);
  if (!volume) return std::unexpected(volume.error());
  auto values = evaluate_fields(fields, volume->positions, false);
  if (!values) return std::unexpected(values.error());
  std::vector<double> volumes(fields.cloud().size(), 0.0);
  for (std::size_t q = 0; q < volume->size(); ++q) {
    double weight = volume->weights[q];
    if (density) weight *= density(volume->positions[q], std::cbrt(weight));
    for (std::size_t e = values->begin[q]; e < values->begin[q + 1]; ++e) {
      volumes[static_cast<std::size_t>(values->nodes[e])] += weight * values->values[e];
    }
  }
  return volumes;
}

}  // namespace viscera
