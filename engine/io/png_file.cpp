#include "engine/io/png_file.h"

#include <png.h>

#include <utility>

#include "engine/io/atomic_file.h"

namespace viscera {
namespace {

struct Encoder {
  std::string bytes;
  std::string error;
};

void on_write(png_structp png, png_bytep data, std::size_t size) {
  static_cast<Encoder*>(png_get_io_ptr(png))->bytes.append(reinterpret_cast<char*>(data), size);
}

void on_flush(png_structp) {}

void on_error(png_structp png, png_const_charp message) {
  static_cast<Encoder*>(png_get_error_ptr(png))->error = message;
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

/// libpng leaves by longjmp, so nothing with a destructor may live in this function.
bool encode(int width, int height, const std::uint8_t* rgb, PngEffort effort, Encoder& encoder) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &encoder, on_error, on_warning);
  if (!png) return false;
  png_infop info = png_create_info_struct(png);
  if (!info || setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &encoder, on_write, on_flush);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
               PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  // One fixed filter where it must be fast: trying all five for each row costs more than the whole
  // compression.
  png_set_compression_level(png, effort == PngEffort::kFast ? 1 : 9);
  png_set_filter(png, PNG_FILTER_TYPE_BASE,
                 effort == PngEffort::kFast ? PNG_FILTER_UP : PNG_ALL_FILTERS);
  png_write_info(png, info);
  for (int y = 0; y < height; ++y) {
    png_write_row(png, rgb + 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(y));
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return true;
}

}  // namespace

Result<std::string> png_bytes(int width, int height, std::span<const std::uint8_t> rgb,
                              PngEffort effort) {
  const std::size_t expected = width > 0 && height > 0 ? 3ull * width * height : 0;
  if (expected == 0 || rgb.size() != expected) {
    return failure("expected " + std::to_string(width) + " x " + std::to_string(height) +
                   " pixels of 3 bytes, found " + std::to_string(rgb.size()) + " bytes");
  }
  Encoder encoder;
  encoder.bytes.reserve(expected / 2);
  if (!encode(width, height, rgb.data(), effort, encoder)) {
    return failure("the picture can't be encoded: " +
                   (encoder.error.empty() ? "no memory" : encoder.error));
  }
  return std::move(encoder.bytes);
}

Result<PngPicture> read_png(const std::filesystem::path& file) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  const auto unreadable = [&] {
    const std::string why = image.message;
    png_image_free(&image);
    return failure(file.string() +
                   ": expected a PNG of 8-bit RGB, found none that can be read: " + why);
  };
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) return unreadable();
  image.format = PNG_FORMAT_RGB;
  PngPicture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  picture.rgb.resize(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr) == 0)
    return unreadable();
  return picture;
}

Result<void> write_png(const std::filesystem::path& file, int width, int height,
                       std::span<const std::uint8_t> rgb) {
  auto bytes = png_bytes(width, height, rgb, PngEffort::kFast);
  if (!bytes) return failure(file.string() + ": " + bytes.error().text());
  return write_file(file, *bytes, Durable::kNo);
}

}  // namespace viscera
