// One instrument's mesh on the GPU; made again only when its shape changes (a jaw that moves).
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/render/view.h"

namespace viscera {

class InstrumentBuffers {
 public:
  void update(const InstrumentView& view);
  void draw() const;

 private:
  Buffer vertices_, elements_;
  VertexArray array_;
  int indices_ = 0;
  InstrumentView built_;  // what the mesh was made from
  bool valid_ = false;
};

}  // namespace viscera
