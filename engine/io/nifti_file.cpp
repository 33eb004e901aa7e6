#include "engine/io/nifti_file.h"

#include <bit>
#include <cmath>
#include <optional>
#include <string_view>

#include "engine/io/gzip_file.h"

namespace viscera {
namespace {

constexpr std::size_t kHeaderSize = 348;

// Fields by their places in the header, in either byte order.
class Header {
 public:
  Header(std::string_view bytes, bool swap) : bytes_(bytes), swap_(swap) {}

  std::int16_t int16(std::size_t at) const { return get<std::int16_t>(at); }
  std::int32_t int32(std::size_t at) const { return get<std::int32_t>(at); }
  double real(std::size_t at) const { return get<float>(at); }
  unsigned byte(std::size_t at) const { return static_cast<unsigned char>(bytes_[at]); }
  std::string_view text(std::size_t at, std::size_t size) const { return bytes_.substr(at, size); }
  bool swap() const { return swap_; }

 private:
  template <class T>
  T get(std::size_t at) const {
    char copy[sizeof(T)];
    for (std::size_t b = 0; b < sizeof(T); ++b) {
      copy[b] = bytes_[at + (swap_ ? sizeof(T) - 1 - b : b)];
    }
    return std::bit_cast<T>(copy);
  }

  std::string_view bytes_;
  bool swap_;
};

// Offsets of the header's fields.
enum : std::size_t {
  kDim = 40,
  kDatatype = 70,
  kPixdim = 76,
  kVoxOffset = 108,
  kSlope = 112,
  kIntercept = 116,
  kXyztUnits = 123,
  kQformCode = 252,
  kSformCode = 254,
  kQuaternion = 256,
  kQoffset = 268,
  kSrow = 280,
  kMagic = 344,
};

Result<Header> header_of(std::string_view bytes) {
  if (bytes.size() < kHeaderSize + 4) {
    return failure("found " + std::to_string(bytes.size()) +
                   " bytes, expected a NIfTI-1 header of 352: the file looks truncated");
  }
  for (const bool swap : {false, true}) {
    const Header header(bytes, swap);
    if (header.int32(0) == 540) {
      return failure("found NIfTI-2, expected NIfTI-1: convert it first");
    }
    if (header.int32(0) != static_cast<int>(kHeaderSize)) continue;
    const std::string_view magic = header.text(kMagic, 3);
    if (magic == "ni1") {
      return failure(
          "found the header of a pair of files (.hdr, .img), expected both in one .nii file");
    }
    if (magic != "n+1") return failure("found no NIfTI magic (\"n+1\"): is this ANALYZE 7.5?");
    return header;
  }
  return failure("found no NIfTI-1 header: its first number isn't 348");
}

Result<ValueType> value_type(int code) {
  switch (code) {
    case 2:
      return ValueType::kUint8;
    case 4:
      return ValueType::kInt16;
    case 8:
      return ValueType::kInt32;
    case 16:
      return ValueType::kFloat;
    case 64:
      return ValueType::kDouble;
    case 256:
      return ValueType::kInt8;
    case 512:
      return ValueType::kUint16;
    case 768:
      return ValueType::kUint32;
    case 1024:
      return ValueType::kInt64;
    case 1280:
      return ValueType::kUint64;
    case 128:
    case 2304:
      return failure("found colours (data type " + std::to_string(code) +
                     "), expected one whole number a voxel");
    default:
      return failure("found the data type " + std::to_string(code) +
                     ", expected whole numbers or reals of up to 64 bits");
  }
}

std::optional<double> unit_of(unsigned xyzt_units) {
  switch (xyzt_units & 7u) {
    case 1:
      return 1.0;
    case 2:
      return 1e-3;
    case 3:
      return 1e-6;
    default:
      return std::nullopt;
  }
}

// Voxel to world, right-anterior-superior, in the file's units.
struct Placement {
  Mat3 axes;
  Vec3 origin;
};

Placement sform(const Header& header) {
  Placement placement;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      placement.axes(row, column) = header.real(kSrow + 16 * row + 4 * column);
    }
    placement.origin[row] = header.real(kSrow + 16 * row + 12);
  }
  return placement;
}

Placement qform(const Header& header) {
  const double b = header.real(kQuaternion), c = header.real(kQuaternion + 4),
               d = header.real(kQuaternion + 8);
  const double a = std::sqrt(std::max(0.0, 1.0 - (b * b + c * c + d * d)));
  // pixdim[0] is the sign of the third axis; 0 stands for 1.
  const double third = header.real(kPixdim) < 0.0 ? -1.0 : 1.0;
  Placement placement;
  placement.axes = Quaternion(a, b, c, d).normalized().toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis) {
    placement.axes.col(axis) *= header.real(kPixdim + 4 * (axis + 1)) * (axis == 2 ? third : 1.0);
    placement.origin[axis] = header.real(kQoffset + 4 * axis);
  }
  return placement;
}

// <Label Key="5" ...><![CDATA[liver]]></Label>, as Caret and TotalSegmentator write them between
// the header and the voxels.
std::map<std::int32_t, std::string> label_names(std::string_view extensions) {
  std::map<std::int32_t, std::string> names;
  constexpr std::string_view kOpen = "<Label Key=\"", kName = "<![CDATA[", kEnd = "]]>";
  for (std::size_t at = extensions.find(kOpen); at != std::string_view::npos;
       at = extensions.find(kOpen, at + 1)) {
    const std::size_t key = at + kOpen.size();
    const std::size_t close = extensions.find('>', key);
    if (close == std::string_view::npos) break;
    if (extensions.substr(close + 1, kName.size()) != kName) continue;
    const std::size_t begin = close + 1 + kName.size(), end = extensions.find(kEnd, begin);
    if (end == std::string_view::npos) break;
    names[std::atoi(std::string(extensions.substr(key, 12)).c_str())] =
        extensions.substr(begin, end - begin);
  }
  return names;
}

Result<LabelVolume> read(std::string_view bytes) {
  const Result<Header> header = header_of(bytes);
  if (!header) return std::unexpected(header.error());
  const int dimensions = header->int16(kDim);
  if (dimensions < 1 || dimensions > 7) {
    return failure("found " + std::to_string(dimensions) + " dimensions, expected three");
  }
  std::vector<long long> sizes;
  for (int d = 1; d <= dimensions; ++d) sizes.push_back(header->int16(kDim + 2 * d));
  const Result<ValueType> type = value_type(header->int16(kDatatype));
  if (!type) return std::unexpected(type.error());
  const auto size = three_dimensions(sizes);
  if (!size) return std::unexpected(size.error());

  LabelVolume volume;
  volume.size = *size;
  const bool by_sform = header->int16(kSformCode) > 0, by_qform = header->int16(kQformCode) > 0;
  if (!by_sform && !by_qform) {
    return failure(
        "found no orientation (sform_code and qform_code are 0), expected one of the two: which "
        "side is left can't be told from the voxels");
  }
  const Placement placement = by_sform ? sform(*header) : qform(*header);
  // Right, anterior, superior to left, head, front.
  Mat3 turn;
  turn << -1, 0, 0, 0, 0, 1, 0, 1, 0;
  volume.axes = turn * placement.axes;
  volume.origin = turn * placement.origin;
  volume.unit = unit_of(header->byte(kXyztUnits));

  const double offset = header->real(kVoxOffset);
  if (!(offset >= 352.0) || offset > static_cast<double>(bytes.size())) {
    return failure("found vox_offset " + std::to_string(offset) + " in a file of " +
                   std::to_string(bytes.size()) + " bytes, expected a place in it from 352 on");
  }
  const auto begin = static_cast<std::size_t>(offset);
  volume.names = label_names(bytes.substr(352, begin - 352));
  double slope = header->real(kSlope), intercept = header->real(kIntercept);
  if (slope == 0.0 || !std::isfinite(slope) || !std::isfinite(intercept)) {
    slope = 1.0, intercept = 0.0;  // as the format says: no scaling
  }
  const std::size_t count = static_cast<std::size_t>(size->x()) * size->y() * size->z();
  auto labels =
      labels_of(bytes.substr(begin), *type, header->swap(), count, slope, intercept, *size);
  if (!labels) return std::unexpected(labels.error());
  volume.labels = std::move(*labels);
  return volume;
}

}  // namespace

Result<LabelVolume> read_nifti(const std::filesystem::path& file) {
  const auto bytes = read_bytes(file, true);
  if (!bytes) return std::unexpected(bytes.error());
  auto volume = read(*bytes);
  if (!volume) return failure(file.string() + ": " + volume.error().text());
  return volume;
}

}  // namespace viscera
