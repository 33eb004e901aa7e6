#include "engine/gpu/buffer.h"

#include <epoxy/gl.h>

#include <utility>

namespace viscera {

Buffer::Buffer() {
  glCreateBuffers(1, &id_);
}

Buffer::~Buffer() {
  if (id_ != 0) glDeleteBuffers(1, &id_);
}

Buffer::Buffer(Buffer&& other) noexcept : id_(std::exchange(other.id_, 0)), size_(other.size_) {}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(size_, other.size_);
  return *this;
}

void Buffer::upload_bytes(const void* bytes, std::size_t size) {
  if (size > 0) glNamedBufferData(id_, static_cast<GLsizeiptr>(size), bytes, GL_DYNAMIC_DRAW);
  size_ = size;
}

void Buffer::allocate(std::size_t size) {
  glNamedBufferData(id_, static_cast<GLsizeiptr>(size), nullptr, GL_STATIC_COPY);
  size_ = size;
}

void Buffer::upload_part_bytes(std::size_t offset, const void* bytes, std::size_t size) {
  if (size == 0) return;
  glNamedBufferSubData(id_, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(size), bytes);
}

void Buffer::download_bytes(std::size_t offset, void* bytes, std::size_t size) const {
  if (size == 0) return;
  glGetNamedBufferSubData(id_, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(size), bytes);
}

VertexArray::VertexArray() {
  glCreateVertexArrays(1, &id_);
}

VertexArray::~VertexArray() {
  if (id_ != 0) glDeleteVertexArrays(1, &id_);
}

VertexArray::VertexArray(VertexArray&& other) noexcept : id_(std::exchange(other.id_, 0)) {}

VertexArray& VertexArray::operator=(VertexArray&& other) noexcept {
  std::swap(id_, other.id_);
  return *this;
}

void VertexArray::attribute(unsigned location, const Buffer& buffer, int components,
                            std::size_t stride, std::size_t offset) {
  glEnableVertexArrayAttrib(id_, location);
  glVertexArrayAttribFormat(id_, location, components, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribBinding(id_, location, location);
  glVertexArrayVertexBuffer(id_, location, buffer.id(), static_cast<GLintptr>(offset),
                            static_cast<GLsizei>(stride));
}

void VertexArray::elements(const Buffer& buffer) {
  glVertexArrayElementBuffer(id_, buffer.id());
}

}  // namespace viscera
