#include <gtest/gtest.h>

#include "engine/io/nifti_file.h"
#include "tests/support/label_files.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

LabelImage small_image() {
  LabelImage image = centred_image({4, 3, 5}, {2, 2, 2});
  for (std::size_t v = 0; v < image.labels.size(); ++v) {
    image.labels[v] = static_cast<std::int32_t>(v % 11);
  }
  return image;
}

class Nifti : public testing::Test {
 protected:
  Result<LabelVolume> read(const std::string& bytes, const std::string& name = "a.nii") {
    write_bytes(folder_ / name, bytes);
    return read_nifti(folder_ / name);
  }
  std::string refusal(const std::string& bytes, const std::string& name = "a.nii") {
    const auto volume = read(bytes, name);
    if (volume) return "";
    EXPECT_NE(volume.error().text().find(name + ": "), std::string::npos);
    return volume.error().text();
  }
  std::string refusal(const NiftiOptions& options) {
    return refusal(nifti_bytes(small_image(), options));
  }
  TemporaryFolder folder_;
};

TEST_F(Nifti, EveryTypeOfNumbersHoldsTheSameLabels) {
  for (const NiftiType type : {NiftiType::kUint8, NiftiType::kInt16, NiftiType::kInt32,
                               NiftiType::kFloat, NiftiType::kDouble}) {
    for (const bool swap : {false, true}) {
      NiftiOptions options;
      options.type = type;
      options.swap = swap;
      const auto volume = read(nifti_bytes(small_image(), options));
      ASSERT_TRUE(volume) << volume.error().text();
      EXPECT_EQ(volume->labels, small_image().labels) << static_cast<int>(type) << swap;
    }
  }
}

TEST_F(Nifti, StoredNumbersAreScaled) {
  NiftiOptions options;
  options.type = NiftiType::kFloat;
  options.slope = 0.1;
  options.intercept = -2.0;
  const auto volume = read(nifti_bytes(small_image(), options));
  ASSERT_TRUE(volume) << volume.error().text();
  EXPECT_EQ(volume->labels, small_image().labels);
}

TEST_F(Nifti, SaysItsUnitOrThatItDoesNot) {
  for (const auto& [code, unit] : {std::pair{1, 1.0}, std::pair{2, 1e-3}, std::pair{3, 1e-6}}) {
    NiftiOptions options;
    options.units = code + 8;  // and seconds
    EXPECT_EQ(read(nifti_bytes(small_image(), options))->unit, unit);
  }
  NiftiOptions options;
  options.units = 0;
  EXPECT_FALSE(read(nifti_bytes(small_image(), options))->unit);
}

TEST_F(Nifti, NamesOfLabelsComeFromACaretExtension) {
  NiftiOptions options;
  options.extension =
      "<LabelTable><Label Key=\"2\" Red=\"0\"><![CDATA[spleen]]></Label>"
      "<Label Key=\"10\" Red=\"0\"><![CDATA[left kidney]]></Label></LabelTable>";
  const auto volume = read(nifti_bytes(small_image(), options));
  ASSERT_TRUE(volume) << volume.error().text();
  EXPECT_EQ(volume->labels, small_image().labels);
  ASSERT_EQ(volume->names.size(), 2u);
  EXPECT_EQ(volume->names.at(10), "left kidney");
}

TEST_F(Nifti, SeriesAndColoursAreRefused) {
  NiftiOptions series;
  series.more_dimensions = {3};
  EXPECT_NE(refusal(series).find("found 4 dimensions (4 x 3 x 5 x 3), expected three"),
            std::string::npos);
  NiftiOptions vectors;
  vectors.more_dimensions = {1, 3};
  EXPECT_NE(refusal(vectors).find("found 5 dimensions"), std::string::npos);
  NiftiOptions single;
  single.more_dimensions = {1};
  EXPECT_EQ(refusal(single), "") << "a fourth dimension of one is none";
  for (const int code : {128, 2304}) {
    NiftiOptions colours;
    colours.datatype_code = code;
    EXPECT_NE(refusal(colours).find("found colours"), std::string::npos);
  }
  NiftiOptions complex;
  complex.datatype_code = 32;
  EXPECT_NE(refusal(complex).find("found the data type 32"), std::string::npos);
}

TEST_F(Nifti, MissingOrientationIsRefused) {
  NiftiOptions options;
  options.sform = false;
  EXPECT_NE(refusal(options).find("found no orientation (sform_code and qform_code are 0)"),
            std::string::npos);
}

TEST_F(Nifti, TruncatedFilesAreRefusedWhereverTheyEnd) {
  const std::string bytes = nifti_bytes(small_image()), packed = gzipped(bytes);
  for (const std::size_t end : {1u, 100u, 351u, 352u, 400u}) {
    const std::string text = refusal(bytes.substr(0, end));
    EXPECT_NE(text.find("truncated"), std::string::npos) << end << text;
  }
  EXPECT_NE(refusal(bytes.substr(0, bytes.size() - 1)).find("truncated"), std::string::npos);
  for (const std::size_t end : {20u, 60u, static_cast<unsigned>(packed.size()) - 1}) {
    const std::string text = refusal(packed.substr(0, end), "a.nii.gz");
    EXPECT_NE(text.find("truncated"), std::string::npos) << end << text;
  }
  std::string damaged = packed;
  for (std::size_t b = 20; b < 40; ++b) damaged[b] = static_cast<char>(~damaged[b]);
  EXPECT_NE(refusal(damaged, "a.nii.gz"), "");
}

TEST_F(Nifti, OtherHeadersAreRefused) {
  NiftiOptions pair;
  pair.magic = "ni1";
  EXPECT_NE(refusal(pair).find("a pair of files"), std::string::npos);
  NiftiOptions analyze;
  analyze.magic = "";
  EXPECT_NE(refusal(analyze).find("no NIfTI magic"), std::string::npos);
  EXPECT_NE(refusal(std::string(600, 'x')).find("isn't 348"), std::string::npos);
}

}  // namespace
}  // namespace viscera::test
