#include "engine/io/exr_file.h"

#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <half.h>

#include <algorithm>
#include <deque>
#include <mutex>
#include <thread>

#include "engine/io/atomic_file.h"

namespace viscera {
namespace {

// OpenEXR's own files don't say whether the bytes arrived. This one is memory, so that the file is
// written, and checked, like all our others.
class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : OStream("memory") {}
  void write(const char* bytes, int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (at_ + size > bytes_.size()) bytes_.resize(at_ + size);
    std::copy_n(bytes, size, bytes_.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += size;
  }
  uint64_t tellp() override { return at_; }
  void seekp(uint64_t position) override { at_ = position; }

  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

/// Adds a channel and where its values are; halves are kept alive by `halves`.
Result<void> add_channel(const ExrChannel& channel, const ExrPicture& picture, Imf::Header& header,
                         Imf::FrameBuffer& buffer, std::deque<std::vector<half>>& halves) {
  const auto pixels = static_cast<std::size_t>(picture.width) * picture.height;
  const std::size_t count =
      std::visit([](const auto& values) { return values.size(); }, channel.values);
  if (count != pixels) {
    return failure("channel " + channel.name + ": found " + std::to_string(count) +
                   " values, expected one for each of " + std::to_string(picture.width) + " x " +
                   std::to_string(picture.height) + " pixels");
  }
  Imf::PixelType type = Imf::UINT;
  std::size_t size = 4;
  const void* data = nullptr;
  if (const auto* ids = std::get_if<std::vector<std::uint32_t>>(&channel.values)) {
    data = ids->data();
  } else {
    const auto& values = std::get<std::vector<float>>(channel.values);
    type = channel.half ? Imf::HALF : Imf::FLOAT;
    data = values.data();
    if (channel.half) {
      size = 2;
      data = halves.emplace_back(values.begin(), values.end()).data();
    }
  }
  header.channels().insert(channel.name, Imf::Channel(type));
  buffer.insert(channel.name, Imf::Slice(type, const_cast<char*>(static_cast<const char*>(data)),
                                         size, size * static_cast<std::size_t>(picture.width)));
  return {};
}

void start_threads() {
  static std::once_flag once;
  std::call_once(once, [] {
    Imf::setGlobalThreadCount(static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
  });
}

}  // namespace

Result<std::string> encode_exr(const ExrPicture& picture) {
  if (picture.width < 1 || picture.height < 1 || picture.channels.empty()) {
    return failure("picture of " + std::to_string(picture.width) + " x " +
                   std::to_string(picture.height) + " pixels and " +
                   std::to_string(picture.channels.size()) + " channels, expected some of each");
  }
  try {
    start_threads();
    Imf::Header header(picture.width, picture.height);
    header.compression() = Imf::ZIP_COMPRESSION;
    header.zipCompressionLevel() = 2;  // 4, the default, takes twice the time for a few per cent
    for (const auto& [name, text] : picture.texts) header.insert(name, Imf::StringAttribute(text));
    for (const auto& [name, number] : picture.numbers)
      header.insert(name, Imf::DoubleAttribute(number));
    Imf::FrameBuffer buffer;
    std::deque<std::vector<half>> halves;
    for (const ExrChannel& channel : picture.channels) {
      if (auto added = add_channel(channel, picture, header, buffer, halves); !added)
        return std::unexpected(added.error());
    }
    MemoryStream stream;
    {
      Imf::OutputFile file(stream, header);
      file.setFrameBuffer(buffer);
      file.writePixels(picture.height);
    }  // writes the table of rows
    return stream.take();
  } catch (const std::exception& error) {
    return failure(std::string("OpenEXR: ") + error.what());
  }
}

Result<void> write_exr(const std::filesystem::path& file, const ExrPicture& picture) {
  const Result<std::string> bytes = encode_exr(picture);
  if (!bytes) return failure(file.string() + ": " + bytes.error().text());
  return write_file(file, *bytes, Durable::kNo);
}

}  // namespace viscera
