// `viscera run --backend`: the same run on the CPU and by the compute kernels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <sstream>

#include "engine/gpu/egl_context.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

std::vector<std::vector<double>> table(const std::string& csv) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(std::stod(cell));
  }
  return rows;
}

std::string pixels(const std::filesystem::path& png) {
  return run_command({"ffmpeg", "-v", "error", "-i", png.string(), "-f", "rawvideo", "-pix_fmt",
                      "rgb24", "-"})
      .out;
}

/// While it lives, Mesa's drivers offer no more than OpenGL 3.3, which has no compute shaders.
class WithoutCompute {
 public:
  WithoutCompute() { setenv("MESA_GL_VERSION_OVERRIDE", "3.3", 1); }
  ~WithoutCompute() { unsetenv("MESA_GL_VERSION_OVERRIDE"); }
};

/// Numbers of two reports' parts are so near to each other, of `scale`, or else of the greater one.
void expect_near(const Json& one, const Json& other, double share,
                 std::optional<double> scale = {}) {
  ASSERT_EQ(one.size(), other.size());
  for (const auto& [key, value] : one.items()) {
    const Json& twin = other.at(key);
    if (value.is_object()) {
      expect_near(value, twin, share);
      continue;
    }
    if (!value.is_number()) {
      EXPECT_EQ(value, twin) << key;
      continue;
    }
    const double a = value, b = twin;
    EXPECT_LE(std::abs(a - b), share * scale.value_or(std::max(std::abs(a), std::abs(b))))
        << key << ": " << a << ", " << b;
  }
}

class BackendRun : public testing::Test {
 protected:
  void SetUp() override {
    const auto context = EglContext::create();
    if (!context) GTEST_SKIP() << context.error().text();
    software_ = (*context)->software();
  }
  bool software_ = false;
};

TEST_F(BackendRun, TheGpuGivesTheForcesAndThePicturesOfTheCpu) {
  // Smoke lets roundings grow, on either back-end: pictures are compared without it.
  Json scene = tiny_scene();
  scene["smoke"] = Json::array();
  const SceneFolder folder(scene);
  ProgramResult result = folder.run({"--backend", "cpu"});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto cpu_forces = table(file_text(folder.out() / "forces.csv"));
  std::vector<std::string> cpu_pictures;
  for (const auto& file : files_of(folder.out() / "frames", ".png"))
    cpu_pictures.push_back(pixels(file));
  const Json on_cpu = folder.report();
  EXPECT_TRUE(on_cpu["gpu"].is_null());

  result = folder.run({"--backend", "gpu"});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto gpu_forces = table(file_text(folder.out() / "forces.csv"));
  ASSERT_EQ(gpu_forces.size(), cpu_forces.size());
  double greatest = 0.0, apart = 0.0;
  for (std::size_t row = 0; row < cpu_forces.size(); ++row) {
    ASSERT_EQ(gpu_forces[row].size(), 13u);
    for (const std::size_t column : {4u, 5u, 6u, 10u, 11u, 12u}) {
      greatest = std::max(greatest, std::abs(cpu_forces[row][column]));
      apart = std::max(apart, std::abs(cpu_forces[row][column] - gpu_forces[row][column]));
    }
  }
  EXPECT_GT(greatest, 0.01);
  EXPECT_LT(apart, 1e-4 * greatest);
  const auto gpu_pictures = files_of(folder.out() / "frames", ".png");
  ASSERT_EQ(gpu_pictures.size(), cpu_pictures.size());
  for (std::size_t p = 0; p < gpu_pictures.size(); ++p) {
    const std::string drawn = pixels(gpu_pictures[p]);
    ASSERT_EQ(drawn.size(), cpu_pictures[p].size());
    ASSERT_EQ(drawn.size(), 3u * 1280 * 720);
    double sum = 0.0;
    std::size_t far = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      const int off = std::abs(static_cast<unsigned char>(drawn[i]) -
                               static_cast<unsigned char>(cpu_pictures[p][i]));
      sum += off;
      far += off > 8 ? 1 : 0;
    }
    // An edge may fall on the next pixel.
    EXPECT_LT(sum / static_cast<double>(drawn.size()), 0.02) << p;
    EXPECT_LT(far, drawn.size() / 10'000) << p;
  }

  const Json report = folder.report();
  EXPECT_EQ(report["backend"], "gpu");
  EXPECT_EQ(report["backend_reason"], "asked for");
  const Json& gpu = report["gpu"];
  EXPECT_EQ(gpu["device"], report["renderer"]);
  EXPECT_GT(gpu["start_s"], 0.0);
  EXPECT_EQ(gpu["organs"], 1);
  EXPECT_EQ(gpu["heat_organs"], 1);
  EXPECT_GT(gpu["bytes"], 10'000);
  const double delivered = on_cpu["cautery"]["energy_delivered_J"];
  EXPECT_GT(delivered, 1.0);
  expect_near(report["cautery"], on_cpu["cautery"], 1e-4, delivered);
  ASSERT_EQ(on_cpu["tissue"].size(), 1u);
  expect_near(report["tissue"][0], on_cpu["tissue"][0], 1e-2);
  EXPECT_EQ(report["flags"], on_cpu["flags"]);
  std::vector<std::string> passes;
  for (const Json& pass : gpu["passes"]) {
    passes.push_back(pass["name"]);
    EXPECT_GE(pass["max_us"], pass["median_us"]) << pass;
  }
  EXPECT_EQ(passes, (std::vector<std::string>{"upload", "product", "carry", "near", "normals",
                                              "read back"}));
  const auto has_stage = [](const Json& stages, const char* name) {
    return std::any_of(stages.begin(), stages.end(),
                       [&](const Json& stage) { return stage["name"] == name; });
  };
  EXPECT_TRUE(has_stage(report["stages"], "fetch surfaces"));
  EXPECT_EQ(report["warnings"].dump().find("software driver") != std::string::npos, software_);
}

TEST_F(BackendRun, TheGpuWithoutPicturesGivesTheSameStateEveryTime) {
  const SceneFolder folder;
  std::string hash;
  for (const char* threads : {"1", "2"}) {
    const ProgramResult result =
        folder.run({"--backend", "gpu", "--no-render", "--threads", threads});
    ASSERT_EQ(result.code, 0) << result.told();
    const Json report = folder.report();
    EXPECT_EQ(report["renderer"], "");
    EXPECT_EQ(report["gpu"]["organs"], 1);
    EXPECT_EQ(report["gpu"]["smoke_volumes"], 1);
    EXPECT_GT(report["smoke"]["particles_max"], 0);
    if (!hash.empty()) {
      EXPECT_EQ(report["state_hash"], hash);
    }
    hash = report["state_hash"];
  }
}

TEST_F(BackendRun, AutoIsTheCpuOnASoftwareDriverAndSaysSoAtTheStart) {
  if (!software_) GTEST_SKIP() << "the driver is hardware";
  const SceneFolder folder;
  ProgramCall call = folder.call({"--duration", "0.04"});
  std::erase(call.arguments, "--quiet");
  const ProgramResult result = run_program(call);
  ASSERT_EQ(result.code, 0) << result.told();
  const Json report = folder.report();
  EXPECT_EQ(report["backend"], "cpu");
  EXPECT_TRUE(report["gpu"].is_null());
  const std::string reason = report["backend_reason"];
  EXPECT_NE(reason.find("is a software driver"), std::string::npos) << reason;
  EXPECT_NE(result.err.find("deformation on the cpu (" + reason + ")\n"), std::string::npos)
      << result.err;
}

TEST(BackendOption, AnUnknownOneIsRefusedWithTheNamesThatAreKnown) {
  const SceneFolder folder;
  const ProgramResult refused = folder.run({"--backend", "cuda"});
  EXPECT_EQ(refused.code, 2);
  for (const char* part : {"--backend", "cuda", "auto", "cpu", "gpu"})
    EXPECT_NE(refused.told().find(part), std::string::npos) << refused.told();
}

TEST(BackendOption, WithoutADriverTheGpuIsRefusedAndAutoIsTheCpu) {
  const WithoutDrivers without;
  const SceneFolder folder;
  expect_refused(folder.run({"--backend", "gpu", "--no-render"}),
                 {"--backend gpu", "no OpenGL driver", "expected", "OpenGL 4.5"});
  EXPECT_FALSE(std::filesystem::exists(folder.out() / "report.json"));
  const ProgramResult result = folder.run({"--no-render"});
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_EQ(folder.report()["backend"], "cpu");
  EXPECT_EQ(folder.report()["backend_reason"], "auto: no graphics hardware");
}

TEST_F(BackendRun, WithADriverThatHasNoComputeTheGpuIsRefusedAndAutoIsTheCpu) {
  if (!software_) GTEST_SKIP() << "only Mesa's software driver can be made older";
  const WithoutCompute without;
  const SceneFolder folder;
  expect_refused(folder.run({"--backend", "gpu", "--no-render"}),
                 {"--backend gpu", "OpenGL 4.5", "no OpenGL 4.5 core context"});
  const ProgramResult result = folder.run({"--no-render"});
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_EQ(folder.report()["backend"], "cpu");
  // Pictures need it whatever computes.
  expect_refused(folder.run({"--backend", "cpu"}), {"no off-screen OpenGL", "OpenGL 4.5", "tried"});
  expect_whole_files(folder.out());
}

}  // namespace
}  // namespace viscera::test
