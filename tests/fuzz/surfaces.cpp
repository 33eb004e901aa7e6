#include "tests/fuzz/surfaces.h"

#include "engine/io/foreign_files.h"
#include "engine/io/mesh_import.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool is_sound(const Result<TriangleSurface>& surface) {
  if (!surface) return false;
  const auto vertices = static_cast<int>(surface->vertices.size());
  expect(!surface->empty(), "a surface has triangles");
  for (const auto& triangle : surface->triangles)
    for (const int corner : triangle)
      expect(corner >= 0 && corner < vertices, "a triangle's corners are there");
  for (const Vec3& vertex : surface->vertices)
    expect(vertex.allFinite(), "a vertex is finite numbers");
  return true;
}

}  // namespace

bool is_surface(const std::string& name, std::string_view input) {
  const auto file = scratch(name, input);
  if (name.ends_with(".gltf"))
    if (const auto buffers = gltf_buffers(file); !buffers) return false;
  return is_sound(import_surface_here(file, 1e-3));
}

bool is_surface_by_child(const std::string& name, std::string_view input) {
  return is_sound(import_surface(scratch(name, input), 1e-3));
}

}  // namespace viscera::fuzz
