#include "engine/io/nrrd_file.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <charconv>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>

#include "engine/io/gzip_file.h"
#include "kernels/base/input_file.h"

namespace viscera {
namespace {

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return std::string(text);
}

// "key: value" fields in lower case, "key:=value" pairs as they are.
struct Header {
  std::map<std::string, std::string> fields, pairs;
  std::size_t end = 0;  // where the text ends and attached voxels begin

  std::optional<std::string> field(const std::string& name) const {
    const auto found = fields.find(name);
    if (found == fields.end()) return std::nullopt;
    return found->second;
  }
  std::optional<std::string> field(const std::string& name, const std::string& other) const {
    const auto found = field(name);
    return found ? found : field(other);
  }
};

Result<Header> header_of(std::string_view bytes) {
  if (!bytes.starts_with("NRRD000")) {
    return failure("found no NRRD header: the file doesn't begin with \"NRRD000\"");
  }
  Header header;
  std::size_t at = 0;
  while (true) {
    const std::size_t newline = bytes.find('\n', at);
    const std::string line =
        trimmed(bytes.substr(at, newline == std::string_view::npos ? newline : newline - at));
    const bool last = newline == std::string_view::npos;
    const bool magic = at == 0;
    at = last ? bytes.size() : newline + 1;
    if (line.empty() || last) {
      header.end = at;
      return header;
    }
    if (magic || line.front() == '#') continue;
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) {
      return failure("found the line \"" + line.substr(0, 60) + "\", expected \"key: value\"");
    }
    if (line.compare(colon, 2, ":=") == 0) {
      header.pairs[trimmed(line.substr(0, colon))] = trimmed(line.substr(colon + 2));
    } else {
      header.fields[lower(trimmed(line.substr(0, colon)))] = trimmed(line.substr(colon + 1));
    }
  }
}

Result<std::string> needed(const Header& header, const std::string& name) {
  const auto found = header.field(name);
  if (!found) return failure("found no \"" + name + "\", expected it in the header");
  return *found;
}

Result<ValueType> value_type(const std::string& name) {
  static const std::map<std::string, ValueType> kTypes = {
      {"signed char", ValueType::kInt8},
      {"int8", ValueType::kInt8},
      {"int8_t", ValueType::kInt8},
      {"uchar", ValueType::kUint8},
      {"unsigned char", ValueType::kUint8},
      {"uint8", ValueType::kUint8},
      {"uint8_t", ValueType::kUint8},
      {"short", ValueType::kInt16},
      {"short int", ValueType::kInt16},
      {"signed short", ValueType::kInt16},
      {"int16", ValueType::kInt16},
      {"int16_t", ValueType::kInt16},
      {"ushort", ValueType::kUint16},
      {"unsigned short", ValueType::kUint16},
      {"unsigned short int", ValueType::kUint16},
      {"uint16", ValueType::kUint16},
      {"uint16_t", ValueType::kUint16},
      {"int", ValueType::kInt32},
      {"signed int", ValueType::kInt32},
      {"int32", ValueType::kInt32},
      {"int32_t", ValueType::kInt32},
      {"uint", ValueType::kUint32},
      {"unsigned int", ValueType::kUint32},
      {"uint32", ValueType::kUint32},
      {"uint32_t", ValueType::kUint32},
      {"longlong", ValueType::kInt64},
      {"long long", ValueType::kInt64},
      {"int64", ValueType::kInt64},
      {"int64_t", ValueType::kInt64},
      {"ulonglong", ValueType::kUint64},
      {"unsigned long long", ValueType::kUint64},
      {"uint64", ValueType::kUint64},
      {"uint64_t", ValueType::kUint64},
      {"float", ValueType::kFloat},
      {"double", ValueType::kDouble},
  };
  const auto found = kTypes.find(lower(name));
  if (found == kTypes.end()) {
    return failure("found the type \"" + name + "\", expected whole numbers, float or double");
  }
  return found->second;
}

// To left, head, front.
Result<Mat3> turn_of(const Header& header) {
  const auto space = header.field("space");
  if (!space) {
    return failure(
        "found no orientation (\"space\" is absent), expected right-anterior-superior, "
        "left-anterior-superior or left-posterior-superior: which side is left can't be told from "
        "the voxels");
  }
  const std::string name = lower(*space);
  Mat3 turn;
  if (name == "right-anterior-superior" || name == "ras") {
    turn << -1, 0, 0, 0, 0, 1, 0, 1, 0;
  } else if (name == "left-anterior-superior" || name == "las") {
    turn << 1, 0, 0, 0, 0, 1, 0, 1, 0;
  } else if (name == "left-posterior-superior" || name == "lps") {
    turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  } else {
    return failure("found the space \"" + *space +
                   "\", expected right-anterior-superior, left-anterior-superior or "
                   "left-posterior-superior");
  }
  return turn;
}

// "(1,0,0) (0,1,0) (0,0,1)"; vectors called "none" are left out.
Result<std::vector<Vec3>> vectors_of(const std::string& name, std::string text) {
  std::vector<Vec3> found;
  for (std::size_t at = text.find('('); at != std::string::npos; at = text.find('(', at + 1)) {
    const std::size_t end = text.find(')', at);
    std::string inside = text.substr(at + 1, end == std::string::npos ? end : end - at - 1);
    std::ranges::replace(inside, ',', ' ');
    std::istringstream numbers(inside);
    Vec3 vector;
    std::string rest;
    if (!(numbers >> vector.x() >> vector.y() >> vector.z()) || numbers >> rest ||
        end == std::string::npos) {
      return failure(name + ": found \"" + text + "\", expected vectors of three numbers");
    }
    found.push_back(vector);
  }
  return found;
}

// "mm" "mm" "mm": one for all three, or nothing where they aren't told.
Result<std::optional<double>> unit_of(const Header& header) {
  const auto units = header.field("space units");
  if (!units) return std::optional<double>();
  std::optional<double> unit;
  for (std::size_t at = units->find('"'); at != std::string::npos; at = units->find('"', at + 1)) {
    const std::size_t end = units->find('"', at + 1);
    if (end == std::string::npos) break;
    const std::string name = lower(units->substr(at + 1, end - at - 1));
    at = end;
    if (name.empty() || name == "???") return std::optional<double>();
    static const std::map<std::string, double> kUnits = {
        {"mm", 1e-3},    {"millimeter", 1e-3}, {"millimeters", 1e-3},
        {"cm", 1e-2},    {"m", 1.0},           {"meter", 1.0},
        {"meters", 1.0}, {"um", 1e-6},         {"micrometer", 1e-6}};
    const auto known = kUnits.find(name);
    if (known == kUnits.end() || (unit && *unit != known->second)) {
      return failure("space units: found " + *units + ", expected one of mm, cm, m and um for all");
    }
    unit = known->second;
  }
  return unit;
}

std::map<std::int32_t, std::string> label_names(const Header& header) {
  std::map<std::int32_t, std::string> names;
  for (const auto& [key, value] : header.pairs) {
    if (!key.starts_with("Segment") || !key.ends_with("_LabelValue")) continue;
    const auto name = header.pairs.find(
        key.substr(0, key.size() - std::string_view("LabelValue").size()) + "Name");
    if (name != header.pairs.end()) names[std::atoi(value.c_str())] = name->second;
  }
  return names;
}

Result<long long> whole_number(const Header& header, const std::string& name,
                               const std::string& other) {
  const auto text = header.field(name, other);
  if (!text) return 0;
  long long value = 0;
  const auto [end, failed] = std::from_chars(text->data(), text->data() + text->size(), value);
  if (failed != std::errc() || end != text->data() + text->size()) {
    return failure(name + ": found \"" + *text + "\", expected a whole number");
  }
  return value;
}

// The bytes of the voxels, unpacked.
Result<std::string> voxel_bytes(const Header& header, const std::string& bytes,
                                const std::filesystem::path& file, std::size_t needed_bytes) {
  const auto encoding_field = needed(header, "encoding");
  if (!encoding_field) return std::unexpected(encoding_field.error());
  const std::string encoding = lower(*encoding_field);
  const bool packed = encoding == "gzip" || encoding == "gz";
  if (!packed && encoding != "raw") {
    return failure("found the encoding \"" + *encoding_field + "\", expected raw or gzip");
  }
  std::string data;
  if (const auto name = header.field("data file", "datafile")) {
    if (name->starts_with("LIST") || name->find('%') != std::string::npos) {
      return failure("found voxels in several files, expected one");
    }
    const auto named = path_inside(file.parent_path(), *name);
    if (!named) return std::unexpected(named.error());
    const auto read = read_bytes(*named, false);
    if (!read) return std::unexpected(read.error());
    data = *read;
  } else {
    data = bytes.substr(header.end);
  }
  const auto lines = whole_number(header, "line skip", "lineskip");
  const auto skip = whole_number(header, "byte skip", "byteskip");
  if (!lines) return std::unexpected(lines.error());
  if (!skip) return std::unexpected(skip.error());
  std::size_t first = 0;
  for (long long line = 0; line < *lines && first < data.size(); ++line)
    first = std::min(data.find('\n', first), data.size() - 1) + 1;
  data.erase(0, first);
  if (packed) {
    auto inflated = unpacked(data, "voxels");
    if (!inflated) return inflated;
    data = std::move(*inflated);
  }
  if (*skip > 0) data.erase(0, static_cast<std::size_t>(*skip));
  // -1: the voxels are the last bytes.
  if (*skip == -1 && data.size() > needed_bytes) data.erase(0, data.size() - needed_bytes);
  return data;
}

Result<LabelVolume> read(const std::string& bytes, const std::filesystem::path& file) {
  const auto header = header_of(bytes);
  if (!header) return std::unexpected(header.error());
  for (const char* name : {"type", "dimension", "sizes"}) {
    if (const auto there = needed(*header, name); !there) return std::unexpected(there.error());
  }
  const auto type = value_type(*header->field("type"));
  if (!type) return std::unexpected(type.error());
  std::vector<long long> sizes;
  std::istringstream numbers(*header->field("sizes"));
  for (long long size; numbers >> size;) sizes.push_back(size);
  if (std::to_string(sizes.size()) != *header->field("dimension")) {
    return failure("found " + std::to_string(sizes.size()) + " sizes and dimension " +
                   *header->field("dimension") + ", expected as many");
  }
  // 3D Slicer puts overlapping segments into layers, the first dimension.
  const auto directions_field = header->field("space directions");
  const auto kinds = header->field("kinds");
  if (sizes.size() > 3 || (kinds && kinds->find("color") != std::string::npos)) {
    return failure("found " + std::to_string(sizes.size()) + " dimensions" +
                   (kinds ? " (" + *kinds + ")" : "") +
                   ", expected three: series, colours and layers of overlapping segments are no "
                   "label map");
  }
  const auto size = three_dimensions(sizes);
  if (!size) return std::unexpected(size.error());
  const auto turn = turn_of(*header);
  if (!turn) return std::unexpected(turn.error());
  if (!directions_field) {
    return failure(
        "found no orientation (\"space directions\" is absent), expected the directions of the "
        "three axes");
  }
  const auto directions = vectors_of("space directions", *directions_field);
  if (!directions) return std::unexpected(directions.error());
  if (directions->size() != 3) {
    return failure("space directions: found " + std::to_string(directions->size()) +
                   " vectors, expected three");
  }
  const auto origin = vectors_of("space origin", header->field("space origin").value_or("(0,0,0)"));
  if (!origin) return std::unexpected(origin.error());
  if (origin->size() != 1) return failure("space origin: expected one vector");

  LabelVolume volume;
  volume.size = *size;
  for (int axis = 0; axis < 3; ++axis) volume.axes.col(axis) = *turn * (*directions)[axis];
  volume.origin = *turn * origin->front();
  const auto unit = unit_of(*header);
  if (!unit) return std::unexpected(unit.error());
  volume.unit = *unit;
  volume.names = label_names(*header);

  bool swap = false;
  if (bytes_of(*type) > 1) {
    const auto endian = needed(*header, "endian");
    if (!endian) return std::unexpected(endian.error());
    const std::string order = lower(*endian);
    if (order != "little" && order != "big") {
      return failure("endian: found \"" + *endian + "\", expected little or big");
    }
    swap = (order == "little") != (std::endian::native == std::endian::little);
  }
  const std::size_t count = static_cast<std::size_t>(size->x()) * size->y() * size->z();
  const auto data = voxel_bytes(*header, bytes, file, count * bytes_of(*type));
  if (!data) return std::unexpected(data.error());
  auto labels = labels_of(*data, *type, swap, count, 1.0, 0.0, *size);
  if (!labels) return std::unexpected(labels.error());
  volume.labels = std::move(*labels);
  return volume;
}

}  // namespace

Result<LabelVolume> read_nrrd(const std::filesystem::path& file) {
  const auto bytes = read_bytes(file, false);
  if (!bytes) return std::unexpected(bytes.error());
  auto volume = read(*bytes, file);
  if (!volume) return failure(file.string() + ": " + volume.error().text());
  return volume;
}

}  // namespace viscera
