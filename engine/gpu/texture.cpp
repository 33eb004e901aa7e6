#include "engine/gpu/texture.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <bit>
#include <utility>
#include <vector>

namespace viscera {

Texture::Texture(unsigned format, int width, int height, int depth, Filter filter)
    : width_(width), height_(height), depth_(depth) {
  glCreateTextures(depth > 0 ? GL_TEXTURE_3D : GL_TEXTURE_2D, 1, &id_);
  if (depth > 0) {
    glTextureStorage3D(id_, 1, format, width, height, depth);
  } else {
    glTextureStorage2D(id_, 1, format, width, height);
  }
  const GLint mode = filter == Filter::kLinear ? GL_LINEAR : GL_NEAREST;
  glTextureParameteri(id_, GL_TEXTURE_MIN_FILTER, mode);
  glTextureParameteri(id_, GL_TEXTURE_MAG_FILTER, mode);
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
    glTextureParameteri(id_, axis, GL_CLAMP_TO_EDGE);
  }
}

Texture Texture::pattern(int width, int height, const std::uint8_t* values) {
  Texture texture;
  texture.width_ = width;
  texture.height_ = height;
  const int levels =
      static_cast<int>(std::bit_width(static_cast<unsigned>(std::max(width, height))));
  glCreateTextures(GL_TEXTURE_2D, 1, &texture.id_);
  glTextureStorage2D(texture.id_, levels, GL_RG8, width, height);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(texture.id_, 0, 0, 0, width, height, GL_RG, GL_UNSIGNED_BYTE, values);
  glGenerateTextureMipmap(texture.id_);
  glTextureParameteri(texture.id_, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  return texture;
}

Texture::~Texture() {
  if (id_ != 0) glDeleteTextures(1, &id_);
}

Texture::Texture(Texture&& other) noexcept
    : id_(std::exchange(other.id_, 0)),
      width_(other.width_),
      height_(other.height_),
      depth_(other.depth_) {}

Texture& Texture::operator=(Texture&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(width_, other.width_);
  std::swap(height_, other.height_);
  std::swap(depth_, other.depth_);
  return *this;
}

void Texture::upload_3d(int x, int y, int z, int width, int height, int depth, unsigned format,
                        unsigned type, const void* values) {
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage3D(id_, 0, x, y, z, width, height, depth, format, type, values);
}

void Texture::bind(unsigned unit) const {
  glBindTextureUnit(unit, id_);
}

Framebuffer::Framebuffer(std::initializer_list<const Texture*> colours, const Texture* depth) {
  glCreateFramebuffers(1, &id_);
  std::vector<GLenum> targets;
  for (const Texture* colour : colours) {
    const GLenum target = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(targets.size());
    glNamedFramebufferTexture(id_, target, colour->id(), 0);
    targets.push_back(target);
    width_ = colour->width();
    height_ = colour->height();
  }
  if (depth != nullptr) {
    glNamedFramebufferTexture(id_, GL_DEPTH_ATTACHMENT, depth->id(), 0);
    width_ = depth->width();
    height_ = depth->height();
  }
  glNamedFramebufferDrawBuffers(id_, static_cast<GLsizei>(targets.size()), targets.data());
}

Framebuffer::~Framebuffer() {
  if (id_ != 0) glDeleteFramebuffers(1, &id_);
}

Framebuffer::Framebuffer(Framebuffer&& other) noexcept
    : id_(std::exchange(other.id_, 0)), width_(other.width_), height_(other.height_) {}

Framebuffer& Framebuffer::operator=(Framebuffer&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(width_, other.width_);
  std::swap(height_, other.height_);
  return *this;
}

void Framebuffer::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, id_);
  glViewport(0, 0, width_, height_);
}

bool Framebuffer::complete() const {
  return glCheckNamedFramebufferStatus(id_, GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

}  // namespace viscera
