#include "engine/io/label_map.h"
#include "engine/io/nifti_file.h"
#include "tests/fuzz/label_volumes.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  const auto file = scratch("map.nii", input);
  return is_label_map(file, read_label_volume_here(file));
}

std::vector<std::string> seeds() {
  using test::NiftiType;
  const test::LabelImage image = small_image();
  std::vector<std::string> all;
  for (const NiftiType type : {NiftiType::kUint8, NiftiType::kInt16, NiftiType::kInt32,
                               NiftiType::kFloat, NiftiType::kDouble})
    all.push_back(test::nifti_bytes(image, {.type = type}));
  all.push_back(test::nifti_bytes(image, {.sform = false, .qform = true, .swap = true}));
  all.push_back(test::nifti_bytes(image, {.slope = 2.0, .intercept = 1.0, .add = 1.0}));
  all.push_back(test::nifti_bytes(
      image, {.more_dimensions = {1},
              .extension = "<Label Key=\"3\" Red=\"1\"><![CDATA[liver]]></Label>"}));
  all.push_back(test::gzipped(all.front()));
  return all;
}

}  // namespace

Target nifti() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
