#include "engine/scene/json_file.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  return parse_json(std::string(input), "a.json").has_value();
}

std::vector<std::string> seeds() {
  return {"{\"a\": [1, 2.5e-3, null, true], // said\n \"b\": {\"c\": \"\\u00e9\"}}",
          file_text(project_file("scenes/hemisphere.json")),
          file_text(project_file("scenes/sphere_press.json"))};
}

}  // namespace

Target json() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
