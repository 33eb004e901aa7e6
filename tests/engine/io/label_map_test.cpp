// What all label maps are asked: orientation, units, extents, names of files.
#include "engine/io/label_map.h"

#include <gtest/gtest.h>

#include "tests/support/label_files.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

// A map without any symmetry: each voxel's place can be told from where it lies.
LabelImage corner_image() {
  LabelImage image = centred_image({6, 5, 4}, {3.0, 4.0, 5.0});
  image.at(4, 1, 2) = 7;
  image.at(0, 0, 0) = 3;
  image.at(1, 0, 0) = 3;
  return image;
}

LabelMap read_ok(const std::filesystem::path& file, const LabelMapOptions& options = {}) {
  auto map = read_label_map(file, options);
  EXPECT_TRUE(map) << map.error().text();
  return map ? std::move(*map) : LabelMap{};
}

std::string refusal(const std::filesystem::path& file, const LabelMapOptions& options = {}) {
  const auto map = read_label_map(file, options);
  EXPECT_FALSE(map);
  return map ? "" : map.error().text();
}

class LabelMapFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& bytes) {
    write_bytes(folder_ / name, bytes);
    return folder_ / name;
  }
  TemporaryFolder folder_;
};

/// A volume 120 of the file's units across with one voxel of label 1; NIfTI's code of the unit.
std::string large_map_bytes(int units) {
  NiftiOptions options;
  options.units = units;
  LabelImage image = centred_image({40, 40, 40}, {3, 3, 3});
  image.at(20, 20, 20) = 1;
  return nifti_bytes(image, options);
}

TEST_F(LabelMapFile, LiesInTheFrameLeftHeadFrontOfScenes) {
  const LabelMap map = read_ok(write("a.nii", nifti_bytes(corner_image())));
  EXPECT_EQ(map.orientation(), "RAS");
  EXPECT_TRUE(map.spacing().isApprox(Vec3(3e-3, 4e-3, 5e-3), 1e-6));
  // Voxel (4, 1, 2) is at right 4.5, anterior -4, superior 2.5 mm.
  EXPECT_TRUE(map.centre({4, 1, 2}).isApprox(Vec3(-4.5e-3, 2.5e-3, -4e-3), 1e-6));
  EXPECT_EQ(map.labels[map.at(4, 1, 2)], 7);
  const auto extents = label_extents(map);
  ASSERT_EQ(extents.size(), 2u);
  EXPECT_EQ(extents.at(3).voxels, 2u);
  EXPECT_TRUE(box_of(map, extents.at(3)).sizes().isApprox(Vec3(6e-3, 5e-3, 4e-3), 1e-6));
}

TEST_F(LabelMapFile, TheSameBodyReadsTheSameFromEveryFormatAndSpace) {
  // Oblique, with anisotropic voxels and the first axis to the left.
  LabelImage image = corner_image();
  image.axes = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix() *
               Vec3(-3.0, 4.0, 5.0).asDiagonal();
  image.origin = Vec3(11.0, -7.0, 23.0);
  NiftiOptions by_qform;
  by_qform.sform = false;
  by_qform.qform = true;
  const LabelMap reference = read_ok(write("s.nii", nifti_bytes(image)));
  EXPECT_EQ(reference.orientation().size(), 3u);
  NiftiOptions swapped;
  swapped.swap = true;
  const std::vector<std::filesystem::path> files = {
      write("q.nii", nifti_bytes(image, by_qform)),
      write("z.nii.gz", gzipped(nifti_bytes(image))),
      write("b.nii", nifti_bytes(image, swapped)),
      write("ras.nrrd", nrrd_header(image, "RAS") + voxel_bytes(image)),
      write("lps.nrrd", nrrd_header(image, "LPS") + voxel_bytes(image)),
      write("las.nrrd", nrrd_header(image, "LAS", "gzip") + gzipped(voxel_bytes(image)))};
  for (const auto& file : files) {
    const LabelMap map = read_ok(file);
    EXPECT_EQ(map.labels, reference.labels) << file;
    EXPECT_TRUE(map.axes.isApprox(reference.axes, 1e-6)) << file;
    EXPECT_TRUE(map.origin.isApprox(reference.origin, 1e-6)) << file;
    EXPECT_EQ(map.orientation(), reference.orientation()) << file;
  }
}

TEST_F(LabelMapFile, AUnitThatTheFileDoesNotSayIsAskedFor) {
  const auto file = write("u.nii", large_map_bytes(0));
  const std::string text = refusal(file);
  EXPECT_NE(text.find("found no unit of length in the file, expected it from --unit"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("(millimetres? --unit mm)"), std::string::npos) << text;
  EXPECT_NEAR(read_ok(file, {.unit = 1e-3, .assumed = {}}).spacing().x(), 3e-3, 1e-9);
  const LabelMap assumed = read_ok(file, {.unit = {}, .assumed = 1e-3});
  EXPECT_TRUE(assumed.unit_assumed);
}

TEST_F(LabelMapFile, UnitsThatMakeABodyOfTwentyMetresAreRefusedWithTheGuess) {
  const auto file = write("m.nii", large_map_bytes(1));  // metres
  const std::string text = refusal(file);
  EXPECT_NE(text.find("found a volume of 120 m across, expected 5 mm to 3 m (millimetres?"),
            std::string::npos)
      << text;
  // What the caller says goes before what the file says, and that is told.
  const LabelMap map = read_ok(file, {.unit = 1e-3, .assumed = {}});
  EXPECT_NEAR(map.spacing().x(), 3e-3, 1e-9);
  EXPECT_EQ(map.unit_overridden, 1.0);
}

TEST_F(LabelMapFile, ImagesAreNoLabelMaps) {
  LabelImage image = centred_image({16, 16, 16}, {3, 3, 3});
  for (std::size_t v = 0; v < image.labels.size(); ++v) {
    image.labels[v] = static_cast<std::int32_t>(v);
  }
  EXPECT_NE(refusal(write("ct.nii", nifti_bytes(image))).find("is this an image?"),
            std::string::npos);
  NiftiOptions fractions;
  fractions.type = NiftiType::kFloat;
  fractions.add = 0.25;
  const std::string text = refusal(write("f.nii", nifti_bytes(corner_image(), fractions)));
  EXPECT_NE(text.find("found the value 3.25 at voxel (0, 0, 0), expected whole numbers"),
            std::string::npos)
      << text;
}

TEST_F(LabelMapFile, EmptyMapsTiltedAxesAndOtherFilesAreRefused) {
  EXPECT_NE(refusal(write("e.nii", nifti_bytes(centred_image({4, 4, 4}, {3, 3, 3}))))
                .find("found no label but 0"),
            std::string::npos);
  LabelImage tilted = corner_image();
  tilted.axes(1, 2) = 0.7;
  EXPECT_NE(refusal(write("t.nii", nifti_bytes(tilted))).find("expected right angles"),
            std::string::npos);
  LabelImage flat = corner_image();
  flat.axes.col(1).setZero();
  EXPECT_NE(refusal(write("l.nii", nifti_bytes(flat))).find("an axis of no length"),
            std::string::npos);
  EXPECT_NE(refusal(write("x.mha", "ObjectType = Image")).find("expected .nii, .nii.gz"),
            std::string::npos);
  EXPECT_NE(refusal(folder_ / "absent.nii").find("found no such file"), std::string::npos);
  EXPECT_NE(refusal(write("empty.nii", "")).find("found an empty file"), std::string::npos);
  std::filesystem::create_directory(folder_ / "folder.nii");
  EXPECT_NE(refusal(folder_ / "folder.nii").find("found a folder"), std::string::npos);
}

TEST_F(LabelMapFile, TheExampleOfTheDataFolderHasItsFortyOneLabelsAndTheirNames) {
  const auto file = shared_data("labelmap/example_seg.nii.gz");
  if (!file) GTEST_SKIP() << "the data folder is absent";
  const LabelMap map = read_ok(*file, {.unit = 1e-3, .assumed = {}});
  EXPECT_EQ(map.size, Eigen::Vector3i(122, 101, 30));
  const auto extents = label_extents(map);
  EXPECT_EQ(extents.size(), 41u);
  EXPECT_EQ(extents.at(5).voxels, 38634u);
  EXPECT_EQ(map.names.at(5), "liver");
  EXPECT_EQ(map.orientation(), "RAS");
  // The liver of a person lying on the back is to the right of the stomach: less x.
  EXPECT_LT(box_of(map, extents.at(5)).center().x(), box_of(map, extents.at(6)).center().x());
}

}  // namespace
}  // namespace viscera::test
