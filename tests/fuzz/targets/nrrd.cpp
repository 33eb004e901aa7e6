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

std::vector<std::string> seeds() {
  const test::LabelImage image = small_image();
  const std::string packed = test::gzipped(test::voxel_bytes(image));
  return {test::nrrd_header(image, "left-posterior-superior") + test::voxel_bytes(image),
          test::nrrd_header(image, "RAS", "gzip") + packed,
          test::nrrd_header(image, "LAS", "raw",
                            "space units: \"cm\" \"cm\" \"cm\"\nbyte skip: 0\nline skip: 0\n"
                            "kinds: domain domain domain\n# words\n"
                            "Segment0_LabelValue:=3\nSegment0_Name:=liver\n") +
              test::voxel_bytes(image)};
}

}  // namespace

Target nrrd() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
