// `viscera run --passes`: what lies in the files, read by OpenEXR's own library.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "engine/gpu/egl_context.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAll =
    "beauty,clean,transmittance,light_transmittance,depth,labels,temperature";

struct ExrFile {
  explicit ExrFile(const fs::path& path) : file(path.string().c_str()) {
    const Imath::Box2i window = file.header().dataWindow();
    width = window.max.x + 1;
    height = window.max.y + 1;
  }
  template <class Value>
  std::vector<Value> read(const std::string& name, Imf::PixelType type) {
    std::vector<Value> values(static_cast<std::size_t>(width) * height);
    Imf::FrameBuffer buffer;
    buffer.insert(name, Imf::Slice(type, reinterpret_cast<char*>(values.data()), sizeof(Value),
                                   sizeof(Value) * static_cast<std::size_t>(width)));
    file.setFrameBuffer(buffer);
    file.readPixels(0, height - 1);
    return values;
  }
  std::vector<float> floats(const std::string& name) { return read<float>(name, Imf::FLOAT); }
  std::string text(const char* name) const {
    return file.header().typedAttribute<Imf::StringAttribute>(name).value();
  }
  std::set<std::string> channels() const {
    std::set<std::string> names;
    for (auto c = file.header().channels().begin(); c != file.header().channels().end(); ++c)
      names.insert(c.name());
    return names;
  }

  Imf::InputFile file;
  int width = 0, height = 0;
};

class Passes : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  }
};

TEST_F(Passes, EveryPictureHasItsGroundTruth) {
  const SceneFolder folder;
  const ProgramResult result =
      folder.run({"--quality", "draft", "--snapshots", "0.1,0.2", "--passes", kAll});
  ASSERT_EQ(result.code, 0) << result.told();
  const std::vector<fs::path> files = files_of(folder.out() / "passes", ".exr");
  ASSERT_EQ(files.size(), 2u);
  ExrFile exr(folder.out() / "passes" / "0005.exr");
  EXPECT_EQ(exr.channels(),
            (std::set<std::string>{"beauty.R", "beauty.G", "beauty.B", "clean.R", "clean.G",
                                   "clean.B", "scattered.R", "scattered.G", "scattered.B",
                                   "transmittance", "light_transmittance", "depth", "labels",
                                   "temperature.surface", "temperature.smoke"}));
  for (const char* part : {"beauty", "clean * transmittance", "[m]", "[K]", "pinhole"})
    EXPECT_NE(exr.text("comments").find(part), std::string::npos) << part;
  EXPECT_FALSE(exr.text("scene").empty());

  // What the file's own halves say, up to what rounding each of them can do.
  const std::vector<float> seen = exr.floats("transmittance"),
                           lit = exr.floats("light_transmittance");
  float least = 1.0f;
  for (const std::string colour : {"R", "G", "B"}) {
    const std::vector<float> beauty = exr.floats("beauty." + colour),
                             clean = exr.floats("clean." + colour),
                             scattered = exr.floats("scattered." + colour);
    for (std::size_t i = 0; i < beauty.size(); ++i) {
      const double direct = static_cast<double>(clean[i]) * seen[i] * lit[i];
      // A step for beauty (drivers may cut it), and half of one for each factor that was rounded.
      const double bound =
          0x1p-10 * (direct + scattered[i]) + 0x1p-11 * (2.0 * direct + scattered[i]) + 0x1p-22;
      ASSERT_NEAR(beauty[i], direct + scattered[i], bound) << colour << " " << i;
      least = std::min(least, seen[i]);
    }
  }
  EXPECT_LT(least, 0.999f) << "there is smoke to be seen";

  const Json table = Json::parse(exr.text("labels"));
  EXPECT_EQ(table["0"], "nothing");
  const std::vector<std::uint32_t> labels = exr.read<std::uint32_t>("labels", Imf::UINT);
  const std::set<std::uint32_t> found(labels.begin(), labels.end());
  EXPECT_GE(found.size(), 2u);
  for (const std::uint32_t label : found) EXPECT_TRUE(table.contains(std::to_string(label)));
  const std::vector<float> depth = exr.floats("depth");
  for (std::size_t i = 0; i < depth.size(); ++i)
    ASSERT_EQ(std::isinf(depth[i]), labels[i] == 0) << i;

  if (run_command({"sh", "-c", "command -v exrheader"}).code == 0) {
    EXPECT_EQ(run_command({"exrheader", files[0].string()}).code, 0);
  }
}

TEST_F(Passes, OnlyThoseAskedForAreWrittenAndALaterRunTakesThemAway) {
  const SceneFolder folder;
  ProgramResult result =
      folder.run({"--quality", "draft", "--snapshots", "0.1", "--passes", "depth,labels"});
  ASSERT_EQ(result.code, 0) << result.told();
  const std::vector<fs::path> files = files_of(folder.out() / "passes", ".exr");
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(ExrFile(files[0]).channels(), (std::set<std::string>{"depth", "labels"}));
  result = folder.run({"--no-render"});
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_TRUE(files_of(folder.out(), ".exr").empty());
}

// Which file is the first that doesn't fit, a picture or its passes, is the pictures' affair;
// passes alone on a full disk: PassWriter's tests.
TEST_F(Passes, ADiskThatFillsIsSaidAndLeavesWhatIsWhole) {
  const SceneFolder folder;
  ASSERT_EQ(folder.run({"--no-render"}).code, 0) << "fills the cache";
  ProgramCall call = folder.call({"--quality", "draft", "--passes", kAll});
  call.greatest_file = 60000;
  expect_failed(run_program(call), 1, {"can't be written"});
  EXPECT_EQ(folder.report()["complete"], false);
  EXPECT_TRUE(files_of(folder.out() / "passes", ".exr").empty());
  EXPECT_TRUE(files_of(folder.out(), ".tmp").empty());
}

TEST_F(Passes, AnInterruptLeavesEveryPicturesPassesWhole) {
  Json scene = tiny_scene();
  scene["duration_s"] = 20.0;
  const SceneFolder folder(scene);
  ASSERT_EQ(folder.run({"--no-render", "--duration", "0.1"}).code, 0) << "fills the cache";
  ProgramCall call = folder.call({"--quality", "draft", "--passes", "beauty,depth,labels"});
  const fs::path second = folder.out() / "frames" / "0001.png";
  call.interrupt_when = [second](const std::string&) { return fs::exists(second); };
  const ProgramResult result = run_program(call);
  ASSERT_TRUE(result.interrupted);
  EXPECT_EQ(result.code, 130) << result.told();
  expect_whole_files(folder.out());
  const std::vector<fs::path> passes = files_of(folder.out() / "passes", ".exr");
  EXPECT_EQ(passes.size(), files_of(folder.out() / "frames", ".png").size());
  for (const fs::path& file : passes) EXPECT_FALSE(ExrFile(file).floats("depth").empty());
}

TEST(PassNames, UnknownOnesAreRefusedWithTheList) {
  const SceneFolder folder;
  expect_refused(folder.run({"--passes", "beauty,sparkle"}),
                 {"--passes", "\"sparkle\"", "beauty, clean, scattered", "temperature"});
}

TEST(PassNames, PassesNeedPictures) {
  const SceneFolder folder;
  expect_refused(folder.run({"--passes", "depth", "--no-render"}), {"--passes", "--no-render"});
  Json scene = tiny_scene();
  scene.erase("camera");
  expect_refused(SceneFolder(scene).run({"--passes", "depth"}), {"--passes", "camera"});
}

}  // namespace
}  // namespace viscera::test
