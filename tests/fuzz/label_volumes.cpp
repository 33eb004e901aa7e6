#include "tests/fuzz/label_volumes.h"

#include "engine/io/label_map.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {

test::LabelImage small_image() {
  test::LabelImage image = test::centred_image({4, 3, 5}, {5.0, 6.0, 7.0});
  image.fill(3, [](const Vec3& x) { return x.x() > 0.0; });
  image.fill(7, [](const Vec3& x) { return x.x() < -6.0 && x.y() > 0.0; });
  return image;
}

bool is_label_map(const std::filesystem::path& file, Result<LabelVolume> volume) {
  if (!volume) return false;
  expect(volume->size.minCoeff() > 0, "a volume has a size");
  expect(volume->labels.size() == static_cast<std::size_t>(volume->size.x()) *
                                      static_cast<std::size_t>(volume->size.y()) *
                                      static_cast<std::size_t>(volume->size.z()),
         "a volume has a label a voxel");
  const auto map = label_map_of(file, *std::move(volume), {.unit = {}, .assumed = 1e-3});
  if (!map) return false;
  for (const auto& [label, extent] : label_extents(*map)) {
    expect(box_of(*map, extent).diagonal().allFinite(), "an organ's box is finite");
    expect(extent.voxels > 0 && label != 0, "an organ has voxels");
  }
  expect(map->orientation().size() == 3, "axes have names");
  return true;
}

}  // namespace viscera::fuzz
