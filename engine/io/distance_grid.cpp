#include "engine/io/distance_grid.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/LevelSetRebuild.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/io/vdb_volume.h"

namespace viscera {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;

// A mesh as OpenVDB's own library is compiled for, which takes a minute to compile for another
// kind.
struct GridMesh {
  std::vector<openvdb::Vec3s> points;     ///< in grid units
  std::vector<openvdb::Vec3I> triangles;  ///< as indices of points
};

GridMesh grid_mesh(const TriangleSurface& surface, const DistanceGrid& grid) {
  GridMesh mesh;
  mesh.points.reserve(surface.vertices.size());
  for (const Vec3& vertex : surface.vertices) {
    const Eigen::Vector3f x = ((vertex - grid.origin) / grid.voxel).cast<float>();
    mesh.points.emplace_back(x.x(), x.y(), x.z());
  }
  mesh.triangles.reserve(surface.triangles.size());
  for (const auto& corners : surface.triangles)
    mesh.triangles.emplace_back(static_cast<openvdb::Index32>(corners[0]),
                                static_cast<openvdb::Index32>(corners[1]),
                                static_cast<openvdb::Index32>(corners[2]));
  return mesh;
}

CoordBBox box_of(const DistanceGrid& grid) {
  return {Coord(0), Coord(grid.size.x() - 1, grid.size.y() - 1, grid.size.z() - 1)};
}

void copy_values(const FloatGrid& from, DistanceGrid& to) {
  to.values.resize(static_cast<std::size_t>(to.size.x()) * to.size.y() * to.size.z());
  openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box_of(to), to.values.data());
  openvdb::tools::copyToDense(from, dense);
}

}  // namespace

double DistanceGrid::operator()(const Vec3& x) const {
  const Vec3 place = (x - origin) / voxel;
  Eigen::Vector3i base;
  Vec3 t;
  for (int axis = 0; axis < 3; ++axis) {
    const double within = std::clamp(place[axis], 0.0, static_cast<double>(size[axis] - 1));
    base[axis] = std::min(static_cast<int>(within), size[axis] - 2);
    t[axis] = within - base[axis];
  }
  const auto along_x = [&](int j, int k) {
    const float* pair = values.data() + at(base.x(), base.y() + j, base.z() + k);
    return (1.0 - t.x()) * pair[0] + t.x() * pair[1];
  };
  return (1.0 - t.z()) * ((1.0 - t.y()) * along_x(0, 0) + t.y() * along_x(1, 0)) +
         t.z() * ((1.0 - t.y()) * along_x(0, 1) + t.y() * along_x(1, 1));
}

Result<DistanceGrid> unsigned_distance(const TriangleSurface& surface, double voxel, double band,
                                       double margin) {
  const Box box = bounds(surface);
  DistanceGrid grid;
  grid.voxel = voxel;
  const Vec3 points = ((box.sizes().array() + 2.0 * margin) / voxel).ceil() + 2.0;
  if (!(points.prod() <= kMostGridPoints)) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "found a voxel of %.3g mm, which makes %.2g grid points; expected at most %.2g: "
                  "a greater voxel",
                  1e3 * voxel, points.prod(), kMostGridPoints);
    return failure(text);
  }
  grid.size = points.cast<int>();
  grid.origin = box.center() - 0.5 * voxel * (points.array() - 1.0).matrix();
  try {
    ensure_openvdb();
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    const auto width = static_cast<float>(std::ceil(band / voxel) + 1.0);
    const GridMesh mesh = grid_mesh(surface, grid);
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(
        mesh.points, mesh.triangles);
    openvdb::util::NullInterrupter uninterrupted;
    const FloatGrid::Ptr distance =
        openvdb::tools::meshToVolume<FloatGrid>(uninterrupted, adapter, *transform, width, width,
                                                openvdb::tools::UNSIGNED_DISTANCE_FIELD, nullptr);
    copy_values(*distance, grid);
  } catch (const std::exception& error) {
    return failure(std::string("OpenVDB: ") + error.what());
  }
  for (float& value : grid.values) value = std::min(value, static_cast<float>(band));
  return grid;
}

Result<DistanceGrid> distance_to_zero_set(const DistanceGrid& field, double outside,
                                          double inside) {
  try {
    ensure_openvdb();
    const FloatGrid::Ptr volume = FloatGrid::create(static_cast<float>(outside));
    const openvdb::tools::Dense<const float, openvdb::tools::LayoutXYZ> dense(box_of(field),
                                                                              field.values.data());
    openvdb::tools::copyFromDense(dense, *volume, /*tolerance=*/0.0f);
    volume->setGridClass(openvdb::GRID_LEVEL_SET);
    volume->setTransform(openvdb::math::Transform::createLinearTransform(field.voxel));
    const FloatGrid::Ptr rebuilt = openvdb::tools::levelSetRebuild(
        *volume, 0.0f, static_cast<float>(outside / field.voxel + 1.0),
        static_cast<float>(inside / field.voxel + 1.0));
    if (!rebuilt || rebuilt->empty()) return failure("found no surface to measure from");
    DistanceGrid grid = field;
    copy_values(*rebuilt, grid);
    return grid;
  } catch (const std::exception& error) {
    return failure(std::string("OpenVDB: ") + error.what());
  }
}

}  // namespace viscera
