#include "kernels/points/point_octree.h"

namespace viscera {

PointOctree::PointOctree(const Box& box) {
  Cell root;
  root.centre = box.center();
  root.half = 0.5 * box.sizes().maxCoeff();
  cells_.push_back(root);
}

int PointOctree::octant(const Cell& cell, const Vec3& x) {
  return (x.x() >= cell.centre.x() ? 1 : 0) | (x.y() >= cell.centre.y() ? 2 : 0) |
         (x.z() >= cell.centre.z() ? 4 : 0);
}

void PointOctree::split(int index) {
  const int children = static_cast<int>(cells_.size());
  cells_.resize(cells_.size() + 8);
  Cell& cell = cells_[index];
  for (int i = 0; i < 8; ++i) {
    Cell& child = cells_[children + i];
    child.half = 0.5 * cell.half;
    child.centre = cell.centre + child.half * Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
  }
  for (const Vec3& point : cell.points) {
    Cell& child = cells_[children + octant(cell, point)];
    child.points[child.count++] = point;
  }
  cell.children = children;
  cell.count = 0;
}

void PointOctree::insert(const Vec3& point) {
  int index = 0;
  for (;;) {
    if (cells_[index].children < 0 && cells_[index].count == kLeafSize) split(index);
    if (cells_[index].children < 0) break;
    index = cells_[index].children + octant(cells_[index], point);
  }
  Cell& leaf = cells_[index];
  leaf.points[leaf.count++] = point;
}

bool PointOctree::any_nearer(const Vec3& x, double radius) const {
  const double radius2 = radius * radius;
  // Each level leaves at most seven siblings behind; doubles tell about 50 halvings apart.
  std::array<int, 512> stack;
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Cell& cell = cells_[stack[--depth]];
    const Vec3 outside = ((x - cell.centre).cwiseAbs() - Vec3::Constant(cell.half)).cwiseMax(0.0);
    if (outside.squaredNorm() >= radius2) continue;
    if (cell.children < 0) {
      for (int i = 0; i < cell.count; ++i) {
        if ((cell.points[i] - x).squaredNorm() < radius2) return true;
      }
      continue;
    }
    // The octant that holds x comes off the stack first: a near point is likeliest there.
    const int home = octant(cell, x);
    for (int i = 7; i >= 0; --i) stack[depth++] = cell.children + (i ^ home);
  }
  return false;
}

}  // namespace viscera
