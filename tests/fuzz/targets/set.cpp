// `--set KEY/PATH=VALUE`, one a line.
#include <sstream>

#include "tests/fuzz/scene_parts.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  static const std::string scene = file_text(project_file("scenes/sphere_press.json"));
  std::vector<std::pair<std::string, std::string>> overrides;
  std::istringstream lines{std::string(input)};
  for (std::string line; std::getline(lines, line) && overrides.size() < 20;) {
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos) return false;
    overrides.emplace_back(line.substr(0, equals), line.substr(equals + 1));
  }
  return is_scene(scene, overrides);
}

std::vector<std::string> seeds() {
  return {"duration_s=3\n", "organs/0/resolution/finest_spacing_mm=2.5\nseed=7\n",
          "name=other\ntitle=Words\n",
          "organs/0/pose={\"position_mm\": [1, 2, 3], \"rotation_deg\": [0, 90, 0]}\n"};
}

}  // namespace

Target set() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
