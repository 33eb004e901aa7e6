#include "engine/render/instrument_buffers.h"

#include <epoxy/gl.h>

#include "engine/render/instrument_mesh.h"

namespace viscera {

void InstrumentBuffers::update(const InstrumentView& view) {
  const bool same = valid_ && built_.kind == view.kind && built_.mesh == view.mesh &&
                    built_.shaft_radius == view.shaft_radius &&
                    built_.shaft_length == view.shaft_length &&
                    built_.tip_radius == view.tip_radius && built_.jaw == view.jaw;
  if (same) return;
  const InstrumentMesh mesh = make_instrument(view);
  vertices_.upload(std::span<const InstrumentVertex>(mesh.vertices));
  elements_.upload(std::span<const std::uint32_t>(mesh.indices));
  constexpr std::size_t kStride = sizeof(InstrumentVertex);
  array_.attribute(0, vertices_, 3, kStride, offsetof(InstrumentVertex, position));
  array_.attribute(1, vertices_, 3, kStride, offsetof(InstrumentVertex, normal));
  array_.attribute(2, vertices_, 1, kStride, offsetof(InstrumentVertex, finish));
  array_.elements(elements_);
  indices_ = static_cast<int>(mesh.indices.size());
  built_ = view;
  valid_ = true;
}

void InstrumentBuffers::draw() const {
  glBindVertexArray(array_.id());
  glDrawElements(GL_TRIANGLES, indices_, GL_UNSIGNED_INT, nullptr);
}

}  // namespace viscera
