#include "engine/gpu/compute.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace viscera {

void ComputeQueue::dispatch(Program& program, std::size_t groups, std::initializer_list<Use> reads,
                            std::initializer_list<Use> writes) {
  if (groups == 0) return;
  bool wait = false;
  for (const Use& use : reads) wait |= written_.contains(use.buffer->id());
  for (const Use& use : writes) {
    wait |= written_.contains(use.buffer->id()) || read_.contains(use.buffer->id());
  }
  if (wait) {
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    read_.clear();
    written_.clear();
  }
  for (const Use& use : reads) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, use.binding, use.buffer->id());
    read_.insert(use.buffer->id());
  }
  for (const Use& use : writes) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, use.binding, use.buffer->id());
    written_.insert(use.buffer->id());
  }
  program.set("groups", static_cast<int>(groups));
  program.use();
  const std::size_t across = std::min(groups, groups_per_axis_);
  glDispatchCompute(static_cast<GLuint>(across),
                    static_cast<GLuint>((groups + across - 1) / across), 1);
}

void ComputeQueue::make_readable() {
  glMemoryBarrier(GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                  GL_SHADER_STORAGE_BARRIER_BIT);
  read_.clear();
  written_.clear();
}

}  // namespace viscera
