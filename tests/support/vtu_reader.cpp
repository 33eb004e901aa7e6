#include "tests/support/vtu_reader.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <regex>

#include "tests/support/paths.h"

namespace viscera::test {
namespace {

std::string attribute(const std::string& element, const std::string& name) {
  std::smatch match;
  return std::regex_search(element, match, std::regex(" " + name + "=\"([^\"]*)\""))
             ? match[1].str()
             : "";
}

/// The elements of this name in the XML, as they stand.
std::vector<std::string> elements(const std::string& xml, const std::string& name) {
  const std::regex pattern("<" + name + " [^>]*>");
  std::vector<std::string> all;
  for (std::sregex_iterator match(xml.begin(), xml.end(), pattern), end; match != end; ++match)
    all.push_back(match->str());
  return all;
}

template <class T>
std::vector<T> array_at(const std::string& data, std::size_t offset) {
  const auto word = [&](std::size_t i) {
    std::uint64_t value = 0;
    if (offset + 8 * (i + 1) <= data.size()) std::memcpy(&value, data.data() + offset + 8 * i, 8);
    return static_cast<std::size_t>(value);
  };
  const std::size_t blocks = word(0), size = word(1), last = word(2);
  std::size_t at = offset + 8 * (3 + blocks);
  std::string bytes;
  for (std::size_t b = 0; b < blocks; ++b) {
    uLongf plain = b + 1 == blocks && last != 0 ? last : size;
    const std::size_t begin = bytes.size(), packed = word(3 + b);
    bytes.resize(begin + plain);
    const uLongf wanted = plain;
    if (at + packed > data.size() ||
        uncompress(reinterpret_cast<Bytef*>(bytes.data() + begin), &plain,
                   reinterpret_cast<const Bytef*>(data.data() + at), packed) != Z_OK ||
        plain != wanted) {
      ADD_FAILURE() << "block " << b << " of the array at " << offset << " isn't whole";
      return {};
    }
    at += packed;
  }
  EXPECT_EQ(bytes.size() % sizeof(T), 0u);
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

std::vector<Vec3f> vectors_at(const std::string& data, std::size_t offset) {
  const auto numbers = array_at<float>(data, offset);
  EXPECT_EQ(numbers.size() % 3, 0u);
  std::vector<Vec3f> all;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    all.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return all;
}

}  // namespace

VtuContent read_vtu(const std::filesystem::path& file) {
  SCOPED_TRACE(file.string());
  VtuContent content;
  const std::string text = file_text(file);
  const std::string open = "<AppendedData encoding=\"raw\">";
  const std::size_t appended = text.find(open);
  const std::size_t mark = text.find('_', appended);
  EXPECT_TRUE(text.ends_with("</AppendedData>\n</VTKFile>\n"));
  if (appended == std::string::npos || mark == std::string::npos) {
    ADD_FAILURE() << "no appended data";
    return content;
  }
  const std::string xml = text.substr(0, appended), data = text.substr(mark + 1);
  for (const char* part : {"type=\"UnstructuredGrid\"", "byte_order=\"LittleEndian\"",
                           "header_type=\"UInt64\"", "compressor=\"vtkZLibDataCompressor\""})
    EXPECT_NE(xml.find(part), std::string::npos) << part;
  std::vector<std::int32_t> corners, ends;
  std::vector<std::uint8_t> types;
  for (const std::string& array : elements(xml, "DataArray")) {
    const std::string name = attribute(array, "Name");
    const std::size_t offset = std::stoul(attribute(array, "offset"));
    if (name == "Points")
      content.points = vectors_at(data, offset);
    else if (name == "connectivity")
      corners = array_at<std::int32_t>(data, offset);
    else if (name == "offsets")
      ends = array_at<std::int32_t>(data, offset);
    else if (name == "types")
      types = array_at<std::uint8_t>(data, offset);
    else
      content.fields[name] = vectors_at(data, offset);
  }
  const auto pieces = elements(xml, "Piece");
  EXPECT_EQ(pieces.size(), 1u);
  if (!pieces.empty()) {
    EXPECT_EQ(attribute(pieces[0], "NumberOfPoints"), std::to_string(content.points.size()));
    EXPECT_EQ(attribute(pieces[0], "NumberOfCells"), std::to_string(types.size()));
  }
  EXPECT_EQ(ends.size(), types.size());
  EXPECT_EQ(corners.size(), 3 * types.size());
  for (std::size_t t = 0; t < types.size() && 3 * t + 2 < corners.size() && t < ends.size(); ++t) {
    EXPECT_EQ(types[t], 5) << "a triangle";
    EXPECT_EQ(ends[t], static_cast<std::int32_t>(3 * (t + 1)));
    content.triangles.push_back({corners[3 * t], corners[3 * t + 1], corners[3 * t + 2]});
  }
  return content;
}

std::vector<PvdContent> read_pvd(const std::filesystem::path& file) {
  const std::string xml = file_text(file);
  EXPECT_NE(xml.find("<VTKFile type=\"Collection\""), std::string::npos);
  EXPECT_TRUE(xml.ends_with("</VTKFile>\n"));
  std::vector<PvdContent> all;
  for (const std::string& set : elements(xml, "DataSet"))
    all.push_back({std::stod(attribute(set, "timestep")), std::stoi(attribute(set, "part")),
                   attribute(set, "name"), attribute(set, "file")});
  return all;
}

}  // namespace viscera::test
