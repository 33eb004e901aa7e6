#include "tests/tools/tiny_scene.h"

#include <gtest/gtest.h>

#include <fstream>

namespace viscera::test {

Json tiny_scene() {
  return Json::parse(R"({
    "version": 1,
    "name": "tiny",
    "title": "A ball, burnt and pulled",
    "duration_s": 0.2,
    "seed": 1,
    "organs": [{
      "name": "ball",
      "geometry": {"recipe": "sphere", "radius_mm": 15, "edge_mm": 3},
      "tissue": "liver",
      "response": "linear",
      "fixed": [{"half_space": {"point_mm": [0, 0, -8], "normal": [0, 0, 1]}}],
      "resolution": {"spacing_mm": 7, "finest_spacing_mm": 5}
    }],
    "instruments": [{
      "name": "hook",
      "kind": "hook",
      "tip": {"shape": "sphere", "radius_mm": 1.5},
      "trocar_mm": [60, 0, 100],
      "path": [
        {"time_s": 0.0, "tip_mm": [3, 0, 18.5], "power_W": 30},
        {"time_s": 0.05, "tip_mm": [3, 0, 14.5], "power_W": 30},
        {"time_s": 0.2, "tip_mm": [5, 0, 14], "power_W": 30}
      ]
    }, {
      "name": "grasper",
      "kind": "grasper",
      "tip": {"shape": "sphere", "radius_mm": 2},
      "trocar_mm": [-80, 0, 100],
      "path": [
        {"time_s": 0.0, "tip_mm": [-10, 0, 14], "jaw": 1},
        {"time_s": 0.05, "tip_mm": [-9, 0, 12.5], "jaw": 0},
        {"time_s": 0.2, "tip_mm": [-11, 0, 15], "jaw": 0}
      ]
    }],
    "smoke": [{
      "name": "plume",
      "domain": {"min_mm": [-40, -40, -10], "max_mm": [40, 40, 70]},
      "voxel_mm": 2,
      "max_particles": 2000,
      "particle_mass_ug": 0.01
    }],
    "camera": {"path": [{"time_s": 0, "tip_mm": [0, -90, 60], "target_mm": [0, 0, 5]}]}
  })");
}

Json slow_scene() {
  Json scene = tiny_scene();
  scene["organs"][0]["resolution"] = {{"spacing_mm", 2.2}, {"finest_spacing_mm", 1.6}};
  return scene;
}

void SceneFolder::write(const std::string& scene_text) const {
  std::ofstream(scene(), std::ios::binary) << scene_text;
}

ProgramCall SceneFolder::call(const std::vector<std::string>& more) const {
  ProgramCall call;
  call.arguments = {"run", scene().string(), "--out", out().string(), "--quiet"};
  call.arguments.insert(call.arguments.end(), more.begin(), more.end());
  call.cache = cache();
  return call;
}

ProgramResult SceneFolder::check(const std::vector<std::string>& more) const {
  ProgramCall call;
  call.arguments = {"check", scene().string()};
  call.arguments.insert(call.arguments.end(), more.begin(), more.end());
  call.cache = cache();
  return run_program(call);
}

Json SceneFolder::report() const {
  return Json::parse(file_text(out() / "report.json"));
}

Json run_shipped_scene(const std::string& name, const TemporaryFolder& folder,
                       const std::vector<std::string>& more) {
  ProgramCall call;
  call.arguments = {"run",         project_file("scenes/" + name + ".json").string(),
                    "--out",       (folder / "out").string(),
                    "--no-render", "--quiet"};
  call.arguments.insert(call.arguments.end(), more.begin(), more.end());
  call.cache = folder / "cache";
  const ProgramResult result = run_program(call);
  EXPECT_EQ(result.code, 0) << result.told();
  if (result.code != 0) return nullptr;
  return Json::parse(file_text(folder / "out" / "report.json"));
}

}  // namespace viscera::test
