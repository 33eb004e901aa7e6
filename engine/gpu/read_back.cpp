#include "engine/gpu/read_back.h"

#include <epoxy/gl.h>

namespace viscera {

ReadBack::ReadBack(std::size_t size) : size_(size) {
  constexpr GLbitfield kAccess = GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  const auto bytes = static_cast<GLsizeiptr>(size > 0 ? size : 1);
  glCreateBuffers(1, &id_);
  glNamedBufferStorage(id_, bytes, nullptr, kAccess | GL_CLIENT_STORAGE_BIT);
  data_ = glMapNamedBufferRange(id_, 0, bytes, kAccess);
}

ReadBack::~ReadBack() {
  if (fence_ != nullptr) glDeleteSync(static_cast<GLsync>(fence_));
  if (data_ != nullptr) glUnmapNamedBuffer(id_);
  glDeleteBuffers(1, &id_);
}

void ReadBack::start(const Buffer& from, std::size_t offset, std::size_t size, std::size_t to) {
  if (size == 0) return;
  glCopyNamedBufferSubData(from.id(), id_, static_cast<GLintptr>(offset), static_cast<GLintptr>(to),
                           static_cast<GLsizeiptr>(size));
}

void ReadBack::submit() {
  if (fence_ != nullptr) glDeleteSync(static_cast<GLsync>(fence_));
  fence_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  // Without it the driver may keep the commands until someone waits for them.
  glFlush();
}

bool ReadBack::wait() {
  if (fence_ == nullptr || data_ == nullptr) return false;
  constexpr GLuint64 kLongest = 10'000'000'000;  // [ns]; a device that hangs isn't waited for
  const GLenum done =
      glClientWaitSync(static_cast<GLsync>(fence_), GL_SYNC_FLUSH_COMMANDS_BIT, kLongest);
  glDeleteSync(static_cast<GLsync>(fence_));
  fence_ = nullptr;
  return done == GL_ALREADY_SIGNALED || done == GL_CONDITION_SATISFIED;
}

}  // namespace viscera
