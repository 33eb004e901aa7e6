#include "kernels/smoke/solid_cells.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace viscera {
namespace {

/// Twice the signed area of (a, b, p); the same but for the sign when a and b change places.
double side(const Vec3& a, const Vec3& b, double x, double y) {
  const bool ordered = a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  const Vec3& from = ordered ? a : b;
  const Vec3& to = ordered ? b : a;
  const double area = (to.x() - from.x()) * (y - from.y()) - (to.y() - from.y()) * (x - from.x());
  return ordered ? area : -area;
}

/// Whether a point on the line through an edge of a triangle that runs counter-clockwise belongs to
/// it: to one of the two triangles at the edge, whichever they are.
bool owns(const Vec3& a, const Vec3& b) {
  return a.y() != b.y() ? a.y() > b.y() : a.x() > b.x();
}

/// A height at which a column meets the surface.
struct Crossing {
  std::size_t column;
  double height;  // in cells

  bool operator<(const Crossing& other) const {
    return column != other.column ? column < other.column : height < other.height;
  }
};

/// Corners in cells, middles at whole numbers.
void cross(Vec3 a, Vec3 b, Vec3 c, const std::array<int, 3>& cells,
           std::vector<Crossing>& crossings) {
  if (side(a, b, c.x(), c.y()) < 0.0) std::swap(b, c);
  const auto first = [](double least) { return std::max(0, static_cast<int>(std::ceil(least))); };
  const auto last = [](double greatest, int count) {
    return std::min(count - 1, static_cast<int>(std::floor(greatest)));
  };
  const int x_last = last(std::max({a.x(), b.x(), c.x()}), cells[0]);
  const int y_last = last(std::max({a.y(), b.y(), c.y()}), cells[1]);
  for (int y = first(std::min({a.y(), b.y(), c.y()})); y <= y_last; ++y) {
    for (int x = first(std::min({a.x(), b.x(), c.x()})); x <= x_last; ++x) {
      const double wa = side(b, c, x, y), wb = side(c, a, x, y), wc = side(a, b, x, y);
      const bool inside = (wa > 0.0 || (wa == 0.0 && owns(b, c))) &&
                          (wb > 0.0 || (wb == 0.0 && owns(c, a))) &&
                          (wc > 0.0 || (wc == 0.0 && owns(a, b)));
      const double sum = wa + wb + wc;
      if (!inside || sum <= 0.0) continue;
      crossings.push_back({static_cast<std::size_t>(x) +
                               static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(y),
                           (wa * a.z() + wb * b.z() + wc * c.z()) / sum});
    }
  }
}

}  // namespace

void mark_solid(std::span<const Vec3f> vertices, std::span<const std::array<int, 3>> triangles,
                const Pose& pose, const SolidGrid& grid, std::span<std::uint8_t> solid) {
  assert(solid.size() == grid.size());
  const Mat3 turn = pose.orientation.toRotationMatrix();
  const Vec3 per_cell = grid.spacing.cwiseInverse();
  const Vec3 shift = pose.position - grid.origin;
  std::vector<Vec3> places(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v)
    places[v] =
        ((turn * vertices[v].cast<double>() + shift).cwiseProduct(per_cell).array() - 0.5).matrix();
  std::vector<Crossing> crossings;
  for (const std::array<int, 3>& t : triangles)
    cross(places[static_cast<std::size_t>(t[0])], places[static_cast<std::size_t>(t[1])],
          places[static_cast<std::size_t>(t[2])], grid.cells, crossings);
  std::sort(crossings.begin(), crossings.end());

  const std::size_t layer =
      static_cast<std::size_t>(grid.cells[0]) * static_cast<std::size_t>(grid.cells[1]);
  for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
    if (crossings[i].column != crossings[i + 1].column) continue;  // the surface isn't closed
    const int from = std::max(0, static_cast<int>(std::ceil(crossings[i].height)));
    const int to =
        std::min(grid.cells[2] - 1, static_cast<int>(std::floor(crossings[i + 1].height)));
    for (int z = from; z <= to; ++z)
      solid[crossings[i].column + layer * static_cast<std::size_t>(z)] = 1;
    ++i;
  }
}

}  // namespace viscera
