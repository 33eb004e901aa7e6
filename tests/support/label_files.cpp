#include "tests/support/label_files.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

namespace viscera::test {
namespace {

template <class T>
void put(std::string& bytes, std::size_t at, T value, bool swap) {
  char copy[sizeof(T)];
  std::memcpy(copy, &value, sizeof(T));
  if (swap) std::reverse(copy, copy + sizeof(T));
  if (bytes.size() < at + sizeof(T)) bytes.resize(at + sizeof(T));
  std::memcpy(bytes.data() + at, copy, sizeof(T));
}

}  // namespace

void LabelImage::fill(std::int32_t label, const std::function<bool(const Vec3&)>& inside) {
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      for (int i = 0; i < size.x(); ++i) {
        if (inside(centre(i, j, k))) at(i, j, k) = label;
      }
    }
  }
}

LabelImage centred_image(const Eigen::Vector3i& size, const Vec3& spacing) {
  LabelImage image;
  image.size = size;
  image.axes = spacing.asDiagonal();
  image.origin = -0.5 * image.axes * (size - Eigen::Vector3i::Ones()).cast<double>();
  image.resize();
  return image;
}

std::string nifti_bytes(const LabelImage& image, const NiftiOptions& options) {
  const bool swap = options.swap;
  std::string bytes(352, '\0');
  put<std::int32_t>(bytes, 0, 348, swap);
  put<std::int16_t>(bytes, 40, static_cast<std::int16_t>(3 + options.more_dimensions.size()), swap);
  for (int d = 0; d < 7; ++d) put<std::int16_t>(bytes, 42 + 2 * d, 1, swap);
  for (int d = 0; d < 3; ++d) {
    put<std::int16_t>(bytes, 42 + 2 * d, static_cast<std::int16_t>(image.size[d]), swap);
  }
  std::size_t copies = 1;
  for (std::size_t d = 0; d < options.more_dimensions.size(); ++d) {
    put<std::int16_t>(bytes, 48 + 2 * d, static_cast<std::int16_t>(options.more_dimensions[d]),
                      swap);
    copies *= options.more_dimensions[d];
  }
  const int code = options.datatype_code ? options.datatype_code : static_cast<int>(options.type);
  put<std::int16_t>(bytes, 70, static_cast<std::int16_t>(code), swap);
  const Vec3 spacing = image.axes.colwise().norm();
  const bool mirrored = image.axes.determinant() < 0.0;
  put<float>(bytes, 76, mirrored ? -1.0f : 1.0f, swap);
  for (int d = 0; d < 3; ++d) put<float>(bytes, 80 + 4 * d, static_cast<float>(spacing[d]), swap);
  const std::string extension =
      options.extension.empty()
          ? ""
          : options.extension + std::string((16 - options.extension.size() % 16) % 16, '\0');
  const std::size_t offset = 352 + (extension.empty() ? 0 : extension.size() + 8);
  put<float>(bytes, 108, static_cast<float>(offset), swap);
  put<float>(bytes, 112, static_cast<float>(options.slope), swap);
  put<float>(bytes, 116, static_cast<float>(options.intercept), swap);
  bytes[123] = static_cast<char>(options.units);
  put<std::int16_t>(bytes, 252, options.qform ? 1 : 0, swap);
  put<std::int16_t>(bytes, 254, options.sform ? 2 : 0, swap);
  Mat3 rotation = image.axes * spacing.cwiseInverse().asDiagonal();
  if (mirrored) rotation.col(2) = -rotation.col(2);
  Quaternion turn(rotation);
  if (turn.w() < 0.0) turn.coeffs() = -turn.coeffs();
  put<float>(bytes, 256, static_cast<float>(turn.x()), swap);
  put<float>(bytes, 260, static_cast<float>(turn.y()), swap);
  put<float>(bytes, 264, static_cast<float>(turn.z()), swap);
  for (int row = 0; row < 3; ++row) {
    put<float>(bytes, 268 + 4 * row, static_cast<float>(image.origin[row]), swap);
    for (int column = 0; column < 3; ++column) {
      put<float>(bytes, 280 + 16 * row + 4 * column, static_cast<float>(image.axes(row, column)),
                 swap);
    }
    put<float>(bytes, 280 + 16 * row + 12, static_cast<float>(image.origin[row]), swap);
  }
  std::memcpy(bytes.data() + 344, options.magic.data(), options.magic.size());
  if (!extension.empty()) {
    bytes[348] = 1;
    put<std::int32_t>(bytes, 352, static_cast<std::int32_t>(extension.size() + 8), swap);
    put<std::int32_t>(bytes, 356, 30, swap);
    bytes += extension;
  }
  for (std::size_t copy = 0; copy < copies; ++copy) {
    for (const std::int32_t label : image.labels) {
      double value = label + options.add;
      if (options.slope != 0.0) value = (value - options.intercept) / options.slope;
      const std::size_t at = bytes.size();
      switch (options.type) {
        case NiftiType::kUint8:
          put(bytes, at, static_cast<std::uint8_t>(value), swap);
          break;
        case NiftiType::kInt16:
          put(bytes, at, static_cast<std::int16_t>(std::lround(value)), swap);
          break;
        case NiftiType::kInt32:
          put(bytes, at, static_cast<std::int32_t>(std::lround(value)), swap);
          break;
        case NiftiType::kFloat:
          put(bytes, at, static_cast<float>(value), swap);
          break;
        case NiftiType::kDouble:
          put(bytes, at, value, swap);
          break;
      }
    }
  }
  return bytes;
}

std::string voxel_bytes(const LabelImage& image) {
  std::string bytes;
  for (const std::int32_t label : image.labels) {
    bytes += static_cast<char>(label & 255);
    bytes += static_cast<char>(label >> 8 & 255);
  }
  return bytes;
}

std::string nrrd_header(const LabelImage& image, const std::string& space,
                        const std::string& encoding, const std::string& more) {
  // From right, anterior, superior to the space.
  const Vec3 signs(space[0] == 'R' ? 1.0 : -1.0, space[1] == 'A' ? 1.0 : -1.0,
                   space[2] == 'S' ? 1.0 : -1.0);
  const auto text = [&signs](const Vec3& ras) {
    const Vec3 x = signs.cwiseProduct(ras);
    std::ostringstream out;
    out.precision(12);
    out << '(' << x.x() << ',' << x.y() << ',' << x.z() << ')';
    return out.str();
  };
  const std::string name = std::string(space[0] == 'R' ? "right-" : "left-") +
                           (space[1] == 'A' ? "anterior-" : "posterior-") + "superior";
  std::ostringstream header;
  header << "NRRD0004\n# written by a test\ntype: short\ndimension: 3\nspace: " << name
         << "\nsizes: " << image.size.transpose()
         << "\nspace directions: " << text(image.axes.col(0)) << ' ' << text(image.axes.col(1))
         << ' ' << text(image.axes.col(2)) << "\nendian: little\nencoding: " << encoding
         << "\nspace origin: " << text(image.origin) << '\n'
         << more << '\n';
  return header.str();
}

std::string gzipped(const std::string& bytes) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 1, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string packed(deflateBound(&stream, bytes.size()) + 32, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(packed.size() - stream.avail_out);
  deflateEnd(&stream);
  return packed;
}

void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace viscera::test
