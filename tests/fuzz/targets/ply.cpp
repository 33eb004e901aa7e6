#include "tests/fuzz/surfaces.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  return is_surface("one.ply", input);
}

bool by_child(std::string_view input) {
  return is_surface_by_child("one.ply", input);
}

std::vector<std::string> seeds() {
  const std::string body =
      "element vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  std::string binary = "ply\nformat binary_little_endian 1.0\n" + body;
  const float places[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const int corners[3] = {0, 1, 2};
  binary.append(reinterpret_cast<const char*>(places), sizeof places);
  binary += 3;
  binary.append(reinterpret_cast<const char*>(corners), sizeof corners);
  return {"ply\nformat ascii 1.0\ncomment words\n" + body + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
          binary};
}

}  // namespace

Target ply() {
  return {read, seeds, by_child};
}

}  // namespace viscera::fuzz
