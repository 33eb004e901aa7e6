// One organ's surface and burn on the GPU; only what changed is uploaded.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/render/burn_atlas.h"
#include "engine/render/canvas.h"
#include "engine/render/triangle_clusters.h"
#include "engine/render/view.h"
#include "kernels/base/result.h"
#include "kernels/points/curved_refinement.h"

namespace viscera {

class OrganBuffers {
 public:
  /// Fails when positions or normals don't match the rest surface.
  Result<void> update(const OrganView& view);
  /// Draws what may show on the canvas from where the organ lies.
  void draw(const Canvas& canvas, const Pose& pose) const;
  const BurnAtlas* burn() const { return burn_.empty() ? nullptr : &burn_; }

 private:
  void upload_rest(const TriangleSurface& rest, std::span<const float> depths);
  void take_surface(const OrganView& view);

  Buffer positions_, normals_, rest_, rest_normals_, depths_, elements_;
  VertexArray array_;
  BurnAtlas burn_;
  CurvedRefinement refinement_;  ///< of a surface whose facets would show
  TriangleClusters clusters_;
  const TriangleSurface* rest_source_ = nullptr;
  std::size_t vertices_ = 0, triangles_ = 0;
  std::vector<Vec3f> fine_positions_, fine_normals_;
  std::optional<std::uint64_t> surface_version_, burn_version_;
};

}  // namespace viscera
