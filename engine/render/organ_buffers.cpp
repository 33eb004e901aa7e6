#include "engine/render/organ_buffers.h"

#include <epoxy/gl.h>

#include <string>
#include <vector>

namespace viscera {

namespace {

/// Edges that a curved surface would leave by more than this [m] are divided: a pixel, ten
/// centimetres before the lens.
constexpr double kFlat = 1.5e-4;
/// Shorter ones [m] are kept: what is meshed so finely has its shape.
constexpr double kShortest = 4e-3;

bool shows_a_facet(const Vec3& a, const Vec3& b, const Vec3& middle) {
  return (middle - 0.5 * (a + b)).norm() > kFlat && (b - a).norm() > kShortest;
}

}  // namespace

void OrganBuffers::upload_rest(const TriangleSurface& rest, std::span<const float> depths) {
  std::vector<Vec3f> places, normals;
  for (const Vec3& vertex : rest.vertices) places.push_back(vertex.cast<float>());
  for (const Vec3& normal : vertex_normals(rest)) normals.push_back(normal.cast<float>());
  refinement_ = CurvedRefinement(rest, shows_a_facet);
  refinement_.extend(places, normals);
  rest_.upload(std::span<const Vec3f>(places));
  rest_normals_.upload(std::span<const Vec3f>(normals));
  TriangleSurface fine{{}, refinement_.triangles()};
  for (const Vec3f& place : places) fine.vertices.push_back(place.cast<double>());
  clusters_ = TriangleClusters(fine);
  elements_.upload(std::span<const std::array<int, 3>>(clusters_.triangles()));
  array_.attribute(2, rest_, 3, sizeof(Vec3f));
  array_.attribute(3, rest_normals_, 3, sizeof(Vec3f));
  array_.elements(elements_);
  if (!depths.empty()) {
    // Divided edges without normals stay straight: means of their ends.
    std::vector<Vec3f> along, none(depths.size(), Vec3f::Zero());
    for (const float depth : depths) along.emplace_back(depth, 0.0f, 0.0f);
    refinement_.extend(along, none);
    depths_.upload(std::span<const Vec3f>(along));
    array_.attribute(4, depths_, 1, sizeof(Vec3f));
  }
  rest_source_ = &rest;
  vertices_ = rest.vertices.size();
  triangles_ = rest.triangles.size();
  surface_version_.reset();
  burn_version_.reset();
}

Result<void> OrganBuffers::update(const OrganView& view) {
  if (view.rest == nullptr || view.positions.size() != view.rest->vertices.size() ||
      view.normals.size() != view.rest->vertices.size()) {
    return failure("organ " + view.name + ": " + std::to_string(view.positions.size()) +
                   " positions and " + std::to_string(view.normals.size()) +
                   " normals, expected one for each of the " +
                   std::to_string(view.rest != nullptr ? view.rest->vertices.size() : 0) +
                   " vertices at rest");
  }
  if (view.rest != rest_source_ || view.rest->vertices.size() != vertices_ ||
      view.rest->triangles.size() != triangles_) {
    upload_rest(*view.rest, view.depths);
  }
  if (surface_version_ != view.surface_version) {
    take_surface(view);
    surface_version_ = view.surface_version;
  }
  if (view.burn != nullptr && burn_version_ != view.burn_version) {
    burn_.update(*view.burn);
    burn_version_ = view.burn_version;
  }
  return {};
}

void OrganBuffers::take_surface(const OrganView& view) {
  const DeviceSurface& device = view.device;
  const bool refined = refinement_.divides_any();
  if (device.positions != nullptr && !refined) {
    const std::size_t offset = device.first_vertex * sizeof(Vec3f);
    array_.attribute(0, *device.positions, 3, sizeof(Vec3f), offset);
    array_.attribute(1, *device.normals, 3, sizeof(Vec3f), offset);
    clusters_.fit(view.positions);
    return;
  }
  std::span<const Vec3f> positions = view.positions, normals = view.normals;
  if (refined) {
    fine_positions_.assign(positions.begin(), positions.end());
    if (device.normals != nullptr)  // the view's are older there
      fine_normals_ =
          device.normals->download<Vec3f>(device.first_vertex * sizeof(Vec3f), normals.size());
    else
      fine_normals_.assign(normals.begin(), normals.end());
    refinement_.extend(fine_positions_, fine_normals_);
    positions = fine_positions_;
    normals = fine_normals_;
  }
  positions_.upload(positions);
  normals_.upload(normals);
  array_.attribute(0, positions_, 3, sizeof(Vec3f));
  array_.attribute(1, normals_, 3, sizeof(Vec3f));
  clusters_.fit(positions);
}

void OrganBuffers::draw(const Canvas& canvas, const Pose& pose) const {
  // Neighbours in the order are neighbours in space: what shows is a few runs of clusters.
  std::vector<GLsizei> counts;
  std::vector<const void*> offsets;
  std::size_t drawn_to = 0;
  std::size_t first = 0;
  for (std::size_t i = 0; i < clusters_.count(); ++i) {
    const std::size_t triangles = clusters_.cluster(i).size();
    if (canvas.may_show(clusters_.bounds(i), pose)) {
      if (counts.empty() || drawn_to != first) {
        counts.push_back(0);
        offsets.push_back(reinterpret_cast<const void*>(first * sizeof(std::array<int, 3>)));
      }
      counts.back() += static_cast<GLsizei>(3 * triangles);
      drawn_to = first + triangles;
    }
    first += triangles;
  }
  if (counts.empty()) return;
  glBindVertexArray(array_.id());
  glMultiDrawElements(GL_TRIANGLES, counts.data(), GL_UNSIGNED_INT, offsets.data(),
                      static_cast<GLsizei>(counts.size()));
}

}  // namespace viscera
