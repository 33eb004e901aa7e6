// GL textures and framebuffers of fixed size.
#pragma once

#include <cstdint>
#include <initializer_list>

namespace viscera {

/// Owns one immutable-size GL texture: 2D when depth is 0, else 3D. Filtering is linear (nearest
/// for integer formats, or when asked for), coordinates are clamped to the edge.
class Texture {
 public:
  enum class Filter { kLinear, kNearest };

  Texture() = default;
  /// `format` is a sized GL format (GL_RGBA16F ...).
  Texture(unsigned format, int width, int height, int depth = 0, Filter filter = Filter::kLinear);
  /// 2D, two bytes a texel (0 ... 1), repeated beyond its edges and filtered over all sizes of
  /// pixels.
  static Texture pattern(int width, int height, const std::uint8_t* values);
  ~Texture();
  Texture(Texture&& other) noexcept;
  Texture& operator=(Texture&& other) noexcept;

  /// Replaces a block of a 3D texture from tightly packed values of this client format and type.
  void upload_3d(int x, int y, int z, int width, int height, int depth, unsigned format,
                 unsigned type, const void* values);
  void bind(unsigned unit) const;

  explicit operator bool() const { return id_ != 0; }
  unsigned id() const { return id_; }
  int width() const { return width_; }
  int height() const { return height_; }
  int depth() const { return depth_; }

 private:
  unsigned id_ = 0;
  int width_ = 0, height_ = 0, depth_ = 0;
};

/// Owns one GL framebuffer that draws into textures it doesn't own.
class Framebuffer {
 public:
  Framebuffer() = default;
  /// `depth` may be null.
  Framebuffer(std::initializer_list<const Texture*> colours, const Texture* depth);
  ~Framebuffer();
  Framebuffer(Framebuffer&& other) noexcept;
  Framebuffer& operator=(Framebuffer&& other) noexcept;

  /// Draws go here, over the whole of it, until another one is bound.
  void bind() const;
  bool complete() const;
  unsigned id() const { return id_; }

 private:
  unsigned id_ = 0;
  int width_ = 0, height_ = 0;
};

}  // namespace viscera
