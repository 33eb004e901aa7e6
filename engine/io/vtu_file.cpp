#include "engine/io/vtu_file.h"

#include <fmt/format.h>
#include <zlib.h>

#include <bit>
#include <cstdint>
#include <iterator>

#include "engine/io/atomic_file.h"

namespace viscera {
namespace {

static_assert(std::endian::native == std::endian::little, "the files say LittleEndian");

constexpr std::size_t kBlock = 256 << 10;  // bytes that are compressed together

/// The grid's arrays: their bytes, and the XML that says where each begins.
class AppendedData {
 public:
  /// Adds an array and returns its element.
  template <class T>
  Result<std::string> add(std::span<const T> values, const std::string& attributes) {
    const std::size_t offset = bytes_.size();
    if (auto added = compress({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
        !added)
      return std::unexpected(added.error());
    return fmt::format("        <DataArray {} format=\"appended\" offset=\"{}\"/>\n", attributes,
                       offset);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  /// vtkZLibDataCompressor's layout: number of blocks, their size, the last one's size where it is
  /// shorter (else 0), the compressed sizes; then the blocks.
  Result<void> compress(std::string_view data) {
    const std::size_t blocks = (data.size() + kBlock - 1) / kBlock;
    std::vector<std::uint64_t> header = {blocks, kBlock, data.size() % kBlock};
    std::string packed;
    for (std::size_t at = 0; at < data.size(); at += kBlock) {
      const std::string_view block = data.substr(at, kBlock);
      const std::size_t begin = packed.size();
      uLongf size = compressBound(block.size());
      packed.resize(begin + size);
      // The lightest level: files are many, and the higher ones gain a tenth.
      if (compress2(reinterpret_cast<Bytef*>(packed.data() + begin), &size,
                    reinterpret_cast<const Bytef*>(block.data()), block.size(), 1) != Z_OK)
        return failure("zlib has no memory");
      packed.resize(begin + size);
      header.push_back(size);
    }
    bytes_.append(reinterpret_cast<const char*>(header.data()),
                  header.size() * sizeof(std::uint64_t));
    bytes_ += packed;
    return {};
  }

  std::string bytes_;
};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string vectors(const std::string& name) {
  return fmt::format("type=\"Float32\" Name=\"{}\" NumberOfComponents=\"3\"", escaped(name));
}

std::string head(const char* type, const char* more) {
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"{}\" version=\"1.0\" "
      "byte_order=\"LittleEndian\"{}>\n",
      type, more);
}

}  // namespace

Result<void> write_vtu(const std::filesystem::path& file, const VtuSurface& surface) {
  for (const VtuField& field : surface.fields)
    if (field.values.size() != surface.points.size())
      return failure(
          fmt::format("{}: found {} values of {}, expected one for each of the {} points",
                      file.string(), field.values.size(), field.name, surface.points.size()));
  constexpr std::uint8_t kTriangle = 5;  // VTK_TRIANGLE
  std::vector<std::int32_t> ends(surface.triangles.size());
  for (std::size_t t = 0; t < ends.size(); ++t) ends[t] = static_cast<std::int32_t>(3 * (t + 1));
  const std::vector<std::uint8_t> types(ends.size(), kTriangle);
  const std::span<const int> corners(
      surface.triangles.empty() ? nullptr : surface.triangles[0].data(),
      3 * surface.triangles.size());

  AppendedData data;
  Result<void> status;
  std::string xml =
      head("UnstructuredGrid", " header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"");
  const auto add = [&]<class T>(std::span<const T> values, const std::string& attributes) {
    auto element = data.add(values, attributes);
    if (element)
      xml += *element;
    else
      status = std::unexpected(element.error());
  };
  xml += "  <UnstructuredGrid>\n";
  xml += fmt::format("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
                     surface.points.size(), surface.triangles.size());
  xml += "      <PointData>\n";
  for (const VtuField& field : surface.fields) add(field.values, vectors(field.name));
  xml += "      </PointData>\n      <Points>\n";
  add(surface.points, vectors("Points"));
  xml += "      </Points>\n      <Cells>\n";
  add(corners, "type=\"Int32\" Name=\"connectivity\"");
  add(std::span<const std::int32_t>(ends), "type=\"Int32\" Name=\"offsets\"");
  add(std::span<const std::uint8_t>(types), "type=\"UInt8\" Name=\"types\"");
  xml +=
      "      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_";
  if (!status) return failure(file.string() + ": " + status.error().text());
  xml += data.bytes();
  xml += "\n  </AppendedData>\n</VTKFile>\n";
  return write_file(file, xml, Durable::kNo);
}

Result<void> write_pvd(const std::filesystem::path& file, std::span<const PvdEntry> entries) {
  std::string xml = head("Collection", "") + "  <Collection>\n";
  for (const PvdEntry& entry : entries)
    fmt::format_to(std::back_inserter(xml),
                   "    <DataSet timestep=\"{}\" part=\"{}\" name=\"{}\" file=\"{}\"/>\n",
                   entry.time, entry.part, escaped(entry.name), escaped(entry.file));
  return write_file(file, xml + "  </Collection>\n</VTKFile>\n");
}

}  // namespace viscera
