#include <gtest/gtest.h>

#include "engine/io/nrrd_file.h"
#include "tests/support/label_files.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

LabelImage small_image() {
  LabelImage image = centred_image({4, 3, 5}, {2, 2, 2});
  for (std::size_t v = 0; v < image.labels.size(); ++v) {
    image.labels[v] = static_cast<std::int32_t>(v % 300);
  }
  return image;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

class Nrrd : public testing::Test {
 protected:
  Result<LabelVolume> read(const std::string& bytes, const std::string& name = "a.nrrd") {
    write_bytes(folder_ / name, bytes);
    return read_nrrd(folder_ / name);
  }
  std::string refusal(const std::string& bytes, const std::string& name = "a.nrrd") {
    const auto volume = read(bytes, name);
    if (volume) return "";
    EXPECT_NE(volume.error().text().find(name + ": "), std::string::npos);
    return volume.error().text();
  }
  // A header with one text replaced, before its voxels.
  std::string refused(const std::string& from, const std::string& to) {
    return refusal(replaced(nrrd_header(image_, "LPS"), from, to) + voxel_bytes(image_));
  }
  const LabelImage image_ = small_image();
  TemporaryFolder folder_;
};

TEST_F(Nrrd, VoxelsMayBeAttachedOrDetachedRawOrPacked) {
  write_bytes(folder_ / "voxels.raw", voxel_bytes(image_));
  write_bytes(folder_ / "voxels.raw.gz", gzipped(voxel_bytes(image_)));
  write_bytes(folder_ / "skipped.raw", "two\nlines\n1234" + voxel_bytes(image_));
  const std::vector<std::pair<std::string, std::string>> files = {
      {"a.nrrd", nrrd_header(image_, "LPS") + voxel_bytes(image_)},
      {"b.nrrd", nrrd_header(image_, "LPS", "gzip") + gzipped(voxel_bytes(image_))},
      {"c.nhdr", nrrd_header(image_, "LPS", "raw", "data file: voxels.raw\n")},
      {"d.nhdr", nrrd_header(image_, "LPS", "gz", "data file: voxels.raw.gz\n")},
      {"e.nhdr",
       nrrd_header(image_, "LPS", "raw", "data file: skipped.raw\nline skip: 2\nbyte skip: 4\n")},
      {"f.nhdr", nrrd_header(image_, "LPS", "raw", "data file: skipped.raw\nbyte skip: -1\n")}};
  for (const auto& [name, bytes] : files) {
    const auto volume = read(bytes, name);
    ASSERT_TRUE(volume) << volume.error().text();
    EXPECT_EQ(volume->labels, image_.labels) << name;
  }
}

TEST_F(Nrrd, SaysItsUnitOrThatItDoesNot) {
  const auto unit = [this](const std::string& line) {
    return read(nrrd_header(image_, "RAS", "raw", line) + voxel_bytes(image_))->unit;
  };
  EXPECT_EQ(unit("space units: \"mm\" \"mm\" \"mm\"\n"), 1e-3);
  EXPECT_EQ(unit("space units: \"cm\" \"cm\" \"cm\"\n"), 1e-2);
  EXPECT_FALSE(unit(""));
}

TEST_F(Nrrd, NamesOfLabelsComeFromSlicersSegments) {
  const auto volume = read(nrrd_header(image_, "LPS", "raw",
                                       "Segment0_LabelValue:=5\nSegment0_Name:=liver\n"
                                       "Segment1_Name:=spleen\nSegment1_LabelValue:=2\n") +
                           voxel_bytes(image_));
  ASSERT_TRUE(volume) << volume.error().text();
  EXPECT_EQ(volume->names.at(5), "liver");
  EXPECT_EQ(volume->names.at(2), "spleen");
}

TEST_F(Nrrd, MissingOrientationIsRefused) {
  EXPECT_NE(refused("space: left-posterior-superior\n", "").find("found no orientation"),
            std::string::npos);
  EXPECT_NE(refused("space directions: ", "# ").find("found no orientation"), std::string::npos);
  EXPECT_NE(refused("left-posterior-superior", "scanner-xyz").find("found the space"),
            std::string::npos);
  EXPECT_NE(refused("space directions: (", "space directions: (7,8,9) (")
                .find("found 4 vectors, expected three"),
            std::string::npos);
  EXPECT_NE(refused("space directions: (", "space directions: (1,(")
                .find("expected vectors of three numbers"),
            std::string::npos);
}

TEST_F(Nrrd, SeriesColoursAndLayersAreRefused) {
  EXPECT_NE(refused("dimension: 3", "dimension: 4").find("found 3 sizes and dimension 4"),
            std::string::npos);
  const std::string four = replaced(nrrd_header(image_, "LPS"), "dimension: 3", "dimension: 4");
  EXPECT_NE(refusal(replaced(four, "sizes: ", "sizes: 3 ")).find("found 4 dimensions"),
            std::string::npos);
  EXPECT_NE(refused("endian", "kinds: RGB-color domain domain\nendian").find("colours"),
            std::string::npos);
}

TEST_F(Nrrd, TruncatedAndUnreadableFilesAreRefused) {
  const std::string whole = nrrd_header(image_, "LPS") + voxel_bytes(image_);
  EXPECT_NE(refusal(whole.substr(0, whole.size() - 1)).find("truncated"), std::string::npos);
  const std::string packed = gzipped(voxel_bytes(image_));
  EXPECT_NE(refusal(nrrd_header(image_, "LPS", "gzip") + packed.substr(0, packed.size() - 9))
                .find("truncated"),
            std::string::npos);
  EXPECT_NE(refusal(whole.substr(0, 40)), "");
  EXPECT_NE(refusal("not a header").find("NRRD000"), std::string::npos);
  EXPECT_NE(refused("encoding: raw", "encoding: bzip2").find("found the encoding \"bzip2\""),
            std::string::npos);
  EXPECT_NE(refused("type: short", "type: block").find("found the type \"block\""),
            std::string::npos);
  EXPECT_NE(refused("endian: little\n", "").find("found no \"endian\""), std::string::npos);
  EXPECT_NE(refused("encoding: raw", "encoding: raw\ndata file: absent.raw").find("absent.raw"),
            std::string::npos);
}

}  // namespace
}  // namespace viscera::test
