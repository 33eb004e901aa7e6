// A scene that prepares and runs in a tenth of a second and still has every part: a ball of liver,
// a hook that burns it, a grasper that pulls at it, smoke, and a camera.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {

using Json = nlohmann::ordered_json;

/// 0.2 s: 12 frames, 6 pictures.
Json tiny_scene();

/// The same, its ball so fine that preparing it takes some seconds.
Json slow_scene();

/// A scene file, its outputs and its cache in a folder of their own.
class SceneFolder {
 public:
  explicit SceneFolder(const Json& scene = tiny_scene()) { write(scene.dump(2)); }

  void write(const std::string& scene_text) const;
  std::filesystem::path scene() const { return folder_ / "tiny.json"; }
  std::filesystem::path out() const { return folder_ / "out"; }
  std::filesystem::path cache() const { return folder_ / "cache"; }
  std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }

  /// `viscera run tiny.json --out out --quiet ...`
  ProgramCall call(const std::vector<std::string>& more = {}) const;
  ProgramResult run(const std::vector<std::string>& more = {}) const {
    return run_program(call(more));
  }
  ProgramResult check(const std::vector<std::string>& more = {}) const;
  /// report.json of the last run.
  Json report() const;

 private:
  TemporaryFolder folder_;
};

/// `viscera run scenes/NAME.json --no-render ...` of the project into `folder`, with a cache there;
/// its report.json. A test failure where it doesn't exit 0, and null.
Json run_shipped_scene(const std::string& name, const TemporaryFolder& folder,
                       const std::vector<std::string>& more);

}  // namespace viscera::test
