#include "engine/io/label_map.h"
#include "engine/io/nrrd_file.h"
#include "tests/fuzz/label_volumes.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  const auto file = scratch("map.nrrd", input);
  return is_label_map(file, read_label_volume_here(file));
}

/// The image as another type of numbers.
template <class T>
std::string as(const char* type) {
  const test::LabelImage image = small_image();
  std::string header = test::nrrd_header(image, "RAS");
  const std::size_t at = header.find("type: ");
  header.replace(at, header.find('\n', at) - at, std::string("type: ") + type);
  for (const std::int32_t label : image.labels) {
    const auto value = static_cast<T>(label);
    header.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return header;
}

std::vector<std::string> seeds() {
  const test::LabelImage image = small_image();
  const std::string packed = test::gzipped(test::voxel_bytes(image));
  return {test::nrrd_header(image, "left-posterior-superior") + test::voxel_bytes(image),
          test::nrrd_header(image, "RAS", "gzip") + packed,
          test::nrrd_header(image, "LAS", "raw",
                            "space units: \"cm\" \"cm\" \"cm\"\nbyte skip: 0\nline skip: 0\n"
                            "kinds: domain domain domain\n# words\n"
                            "Segment0_LabelValue:=3\nSegment0_Name:=liver\n") +
              test::voxel_bytes(image),
          as<std::int8_t>("int8"),
          as<std::uint8_t>("uchar"),
          as<std::uint16_t>("ushort"),
          as<std::int32_t>("int"),
          as<std::uint32_t>("uint"),
          as<std::int64_t>("int64"),
          as<std::uint64_t>("uint64"),
          as<float>("float"),
          as<double>("double")};
}

}  // namespace

Target nrrd() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
