#include "tests/fuzz/surfaces.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  return is_surface("one.stl", input);
}

bool by_child(std::string_view input) {
  return is_surface_by_child("one.stl", input);
}

std::vector<std::string> seeds() {
  std::string binary(80, 0);
  const unsigned count = 1;
  const float numbers[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  binary.append(reinterpret_cast<const char*>(&count), sizeof count);
  binary.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
  binary += std::string(2, 0);
  return {binary,
          "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
          "endloop\nendfacet\nendsolid one\n"};
}

}  // namespace

Target stl() {
  return {read, seeds, by_child};
}

}  // namespace viscera::fuzz
