// GL buffer objects and vertex arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace viscera {

/// Owns one GL buffer.
class Buffer {
 public:
  Buffer();
  ~Buffer();
  Buffer(Buffer&& other) noexcept;
  Buffer& operator=(Buffer&& other) noexcept;

  /// Replaces all of it, by new memory: what dispatches that are under way read stays as it was.
  /// (NVIDIA's driver writes over memory that a dispatch has yet to read, barriers or not.)
  template <class T>
  void upload(std::span<const T> values) {
    upload_bytes(values.data(), values.size_bytes());
  }
  void upload_bytes(const void* bytes, std::size_t size);

  /// Makes room for `size` bytes of unknown content that the device keeps and shaders write.
  void allocate(std::size_t size);
  /// Replaces bytes from `offset` on, within size(), once no dispatch reads them any more: since a
  /// download has waited for the device.
  template <class T>
  void upload_part(std::size_t offset, std::span<const T> values) {
    upload_part_bytes(offset, values.data(), values.size_bytes());
  }
  void upload_part_bytes(std::size_t offset, const void* bytes, std::size_t size);
  /// Waits for the device. What shaders wrote needs a barrier before (ComputeQueue::make_readable).
  template <class T>
  std::vector<T> download(std::size_t offset, std::size_t count) const {
    std::vector<T> values(count);
    download_bytes(offset, values.data(), count * sizeof(T));
    return values;
  }
  void download_bytes(std::size_t offset, void* bytes, std::size_t size) const;

  unsigned id() const { return id_; }
  std::size_t size() const { return size_; }  ///< bytes of the last upload

 private:
  unsigned id_ = 0;
  std::size_t size_ = 0;
};

/// Owns one GL vertex array: which buffers feed which attributes.
class VertexArray {
 public:
  VertexArray();
  ~VertexArray();
  VertexArray(VertexArray&& other) noexcept;
  VertexArray& operator=(VertexArray&& other) noexcept;

  /// `components` floats per vertex at this shader location, `stride` bytes apart from `offset` on.
  void attribute(unsigned location, const Buffer& buffer, int components, std::size_t stride,
                 std::size_t offset = 0);
  void elements(const Buffer& buffer);

  unsigned id() const { return id_; }

 private:
  unsigned id_ = 0;
};

}  // namespace viscera
