#include "engine/organ/shape_file.h"

#include <system_error>
#include <utility>

namespace viscera {
namespace {

namespace fs = std::filesystem;

constexpr int kFormat = 1;  // of the names below

}  // namespace

Result<void> shape_of(CacheData data, PreparedShape& shape) {
  const auto vertices = data.take<double>("vertices");
  if (!vertices) return std::unexpected(vertices.error());
  const auto triangles = data.take<int>("triangles");
  if (!triangles) return std::unexpected(triangles.error());
  auto notes = data.text("notes");
  if (!notes) return std::unexpected(notes.error());
  TriangleSurface surface;
  for (std::size_t v = 0; v + 2 < vertices->size(); v += 3)
    surface.vertices.emplace_back((*vertices)[v], (*vertices)[v + 1], (*vertices)[v + 2]);
  const int count = static_cast<int>(surface.vertices.size());
  for (std::size_t t = 0; t + 2 < triangles->size(); t += 3) {
    surface.triangles.push_back({(*triangles)[t], (*triangles)[t + 1], (*triangles)[t + 2]});
    for (const int corner : surface.triangles.back())
      if (corner < 0 || corner >= count) return failure("it names vertices that it doesn't have");
  }
  if (count == 0) return failure("it holds no vertices");
  for (const Vec3& vertex : surface.vertices)
    if (!vertex.allFinite()) return failure("it has a vertex that isn't finite numbers");
  shape.surface = std::move(surface);
  shape.notes.clear();
  for (std::size_t from = 0, to; (to = notes->find('\n', from)) != std::string::npos; from = to + 1)
    shape.notes.push_back(notes->substr(from, to - from));
  return {};
}

Result<void> read_shape(const fs::path& file, PreparedShape& shape) {
  auto data = read_cache_file(file, kFormat, shape.key);
  if (!data) return std::unexpected(data.error());
  return shape_of(*std::move(data), shape);
}

Result<void> write_shape(const fs::path& file, const PreparedShape& shape) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (error) return failure(file.parent_path().string() + ": can't be created: " + error.message());
  std::vector<double> vertices;
  for (const Vec3& v : shape.surface.vertices)
    vertices.insert(vertices.end(), v.data(), v.data() + 3);
  std::vector<int> triangles;
  for (const auto& t : shape.surface.triangles)
    triangles.insert(triangles.end(), t.begin(), t.end());
  std::string notes;
  for (const std::string& note : shape.notes) notes += note + '\n';
  CacheContents contents;
  contents.array("vertices", vertices);
  contents.array("triangles", triangles);
  contents.text("notes", std::move(notes));
  return write_cache_file(file, kFormat, shape.key, contents);
}

}  // namespace viscera
