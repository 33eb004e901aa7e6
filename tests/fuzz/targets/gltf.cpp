#include "tests/fuzz/surfaces.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  return is_surface("one.gltf", input);
}

bool by_child(std::string_view input) {
  return is_surface_by_child("one.gltf", input);
}

std::vector<std::string> seeds() {
  // Three vertices, then three indices.
  const std::string data =
      "data:application/octet-stream;base64,"
      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA=";
  const std::string rest =
      R"("bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
      R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":4}]}],)"
      R"("asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)";
  const std::string buffers = R"("buffers":[{"byteLength":44,"uri":")" + data + R"("}],)";
  return {"{" + buffers + rest + R"("nodes":[{"mesh":0}]})" + "\n",
          "{" + buffers + rest +
              R"("nodes":[{"children":[1],"scale":[-1,1,1]},{"mesh":0,"translation":[1,2,3]}]})"
              "\n"};
}

}  // namespace

Target gltf() {
  return {read, seeds, by_child};
}

}  // namespace viscera::fuzz
