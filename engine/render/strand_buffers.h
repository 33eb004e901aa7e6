// The strands of one bed on the GPU: one tube for all of them, and where each half of each lies.
#pragma once

#include <cstddef>

#include "engine/gpu/buffer.h"
#include "engine/render/view.h"

namespace viscera {

class StrandBuffers {
 public:
  StrandBuffers();
  void update(const BedView& view);
  void draw() const;

 private:
  Buffer rings_, elements_, halves_;
  VertexArray array_;
  std::size_t count_ = 0;
};

}  // namespace viscera
