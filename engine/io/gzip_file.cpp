#include "engine/io/gzip_file.h"

#include <zlib.h>

#include <algorithm>
#include <limits>

#include "kernels/base/input_file.h"

namespace viscera {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 20;
constexpr int kGzipOrZlib = 15 + 32;  // the greatest window, and the header tells which it is

struct Inflater {
  z_stream stream{};
  bool ready = inflateInit2(&stream, kGzipOrZlib) == Z_OK;
  ~Inflater() {
    if (ready) inflateEnd(&stream);
  }
};

}  // namespace

Result<std::string> unpacked(std::string_view packed, const std::string& name) {
  Inflater inflater;
  if (!inflater.ready) return failure(name + ": zlib can't begin");
  z_stream& stream = inflater.stream;
  std::string bytes;
  std::size_t taken = 0;
  while (true) {
    const std::size_t piece =
        std::min<std::size_t>(packed.size() - taken, std::numeric_limits<uInt>::max());
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + taken));
    stream.avail_in = static_cast<uInt>(piece);
    const std::size_t before = bytes.size();
    bytes.resize(before + kBlock);
    stream.next_out = reinterpret_cast<Bytef*>(bytes.data() + before);
    stream.avail_out = static_cast<uInt>(kBlock);
    const int state = inflate(&stream, Z_NO_FLUSH);
    taken += piece - stream.avail_in;
    bytes.resize(before + kBlock - stream.avail_out);
    if (bytes.size() > kMostUnpacked) {
      return failure(name + ": found more than " + std::to_string(kMostUnpacked >> 20) +
                     " MiB unpacked, expected less");
    }
    if (state == Z_STREAM_END) return bytes;
    if (state == Z_BUF_ERROR || (state == Z_OK && taken == packed.size() && stream.avail_out > 0)) {
      return failure(name + ": found a gzip stream that ends early after " +
                     std::to_string(bytes.size()) +
                     " unpacked bytes, expected a whole one: the file looks truncated");
    }
    if (state != Z_OK) {
      return failure(name + ": found a damaged gzip stream (" +
                     (stream.msg ? stream.msg : "unknown reason") + ")");
    }
  }
}

Result<std::string> read_bytes(const std::filesystem::path& file, bool unpack) {
  const std::string name = file.string();
  auto input = read_input(file, "a file", kMostUnpacked);
  if (!input) return std::unexpected(input.error());
  std::string bytes = *std::move(input);
  if (bytes.empty()) return failure(name + ": found an empty file");
  const bool packed = bytes.size() > 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b';
  return unpack && packed ? unpacked(bytes, name) : Result<std::string>(std::move(bytes));
}

}  // namespace viscera
