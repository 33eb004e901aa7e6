#include "engine/render/organ_buffers.h"

#include <epoxy/gl.h>

#include <string>
#include <vector>

namespace viscera {

void OrganBuffers::upload_rest(const TriangleSurface& rest) {
  std::vector<Vec3f> places, normals;
  for (const Vec3& vertex : rest.vertices) places.push_back(vertex.cast<float>());
  for (const Vec3& normal : vertex_normals(rest)) normals.push_back(normal.cast<float>());
  rest_.upload(std::span<const Vec3f>(places));
  rest_normals_.upload(std::span<const Vec3f>(normals));
  clusters_ = TriangleClusters(rest);
  elements_.upload(std::span<const std::array<int, 3>>(clusters_.triangles()));
  array_.attribute(2, rest_, 3, sizeof(Vec3f));
  array_.attribute(3, rest_normals_, 3, sizeof(Vec3f));
  array_.elements(elements_);
  rest_source_ = &rest;
  vertices_ = rest.vertices.size();
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
      view.rest->triangles.size() != clusters_.triangles().size()) {
    upload_rest(*view.rest);
  }
  if (surface_version_ != view.surface_version) {
    take_surface(view);
    clusters_.fit(view.positions);
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
  const std::size_t offset = device.first_vertex * sizeof(Vec3f);
  if (device.positions != nullptr) {
    array_.attribute(0, *device.positions, 3, sizeof(Vec3f), offset);
    array_.attribute(1, *device.normals, 3, sizeof(Vec3f), offset);
    return;
  }
  positions_.upload(view.positions);
  normals_.upload(view.normals);
  array_.attribute(0, positions_, 3, sizeof(Vec3f));
  array_.attribute(1, normals_, 3, sizeof(Vec3f));
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
