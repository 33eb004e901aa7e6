#include "tests/fuzz/surfaces.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  return is_surface("one.obj", input);
}

bool by_child(std::string_view input) {
  return is_surface_by_child("one.obj", input);
}

std::vector<std::string> seeds() {
  return {"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
          "mtllib a.mtl\no ball\ng part\nusemtl red\ns 1\nv 0 0 0 1\nv 2 0 0 1\nv 2 2 0 1\n"
          "v 0 2 0 1\nvt 0 0\nvt 1 0\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1 4/2/1\nf -4//1 -2//1 -1//1\n"};
}

}  // namespace

Target obj() {
  return {read, seeds, by_child};
}

}  // namespace viscera::fuzz
