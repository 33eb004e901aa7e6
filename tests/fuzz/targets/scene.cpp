#include "tests/fuzz/scene_parts.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  return is_scene(std::string(input));
}

}  // namespace

Target scene() {
  return {read, scenes};
}

}  // namespace viscera::fuzz
