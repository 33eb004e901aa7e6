#include "engine/io/mesh_import.h"

#include <assimp/MemoryIOWrapper.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "engine/io/ply_layout.h"
#include "engine/scene/geometry_formats.h"
#include "kernels/base/input_file.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

// Corners nearer than this share of the body's size are one vertex.
constexpr double kWeld = 1e-6;

// A binary STL says how many triangles follow; assimp reads what there is. Text begins with
// "solid", but so do the headers of some binary files.
Result<void> check_stl(const std::string& name, InputFile& file) {
  const std::uintmax_t bytes = file.size();
  std::array<char, 84> header{};
  const auto read = file.read(header.data(), header.size());
  if (!read) return std::unexpected(read.error());
  const std::size_t got = *read;
  const bool text = got >= 5 && std::equal(header.begin(), header.begin() + 5, "solid") &&
                    std::find(header.begin(), header.begin() + got, '\0') == header.begin() + got;
  if (text) return {};
  if (got < header.size()) {
    return failure(name + ": found " + std::to_string(bytes) +
                   " bytes, expected the header of a binary STL (84 bytes) or text");
  }
  std::uint32_t count = 0;
  for (int i = 0; i < 4; ++i) {
    count |= std::uint32_t{static_cast<unsigned char>(header[80 + i])} << (8 * i);
  }
  const std::uintmax_t expected = 84 + std::uintmax_t{50} * count;
  if (bytes >= expected) return {};
  return failure(name + ": found " + std::to_string(bytes) + " bytes, expected " +
                 std::to_string(expected) + " for the " + std::to_string(count) +
                 " triangles of its header: the file looks truncated");
}

Result<void> check_file(const fs::path& file) {
  const std::string name = file.string();
  auto input = InputFile::open(file, "a surface", kMostGeometryBytes);
  if (!input) return std::unexpected(input.error());
  if (!is_geometry_file(file)) {
    return failure(name + ": found the format \"" + geometry_extension(file) +
                   "\", expected OBJ, STL, PLY, glTF or GLB");
  }
  if (input->size() == 0) return failure(name + ": found an empty file, expected a surface");
  if (geometry_extension(file) == ".stl") return check_stl(name, *input);
  if (geometry_extension(file) != ".ply") return {};
  const auto bytes = input->rest();
  if (!bytes) return std::unexpected(bytes.error());
  return check_ply(name, *bytes);
}

// What an importer may open: regular files of the surface's own folder, through the door for files.
// Of materials nothing is used.
class FolderFiles : public Assimp::IOSystem {
 public:
  explicit FolderFiles(const fs::path& file) : folder_(file.parent_path()) {}

  bool Exists(const char* file) const override { return path_of(file).has_value(); }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* file, const char*) override {
    const auto path = path_of(file);
    const auto bytes = path ? read_input(*path, "part of a surface", kMostGeometryBytes)
                            : Result<std::string>(failure("it isn't read"));
    if (!bytes) return nullptr;
    auto* copy = new std::uint8_t[bytes->size() + 1];  // the stream's, with its end
    std::memcpy(copy, bytes->data(), bytes->size());
    return new Assimp::MemoryIOStream(copy, bytes->size(), /*own=*/true);
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  std::optional<fs::path> path_of(const fs::path& file) const {
    if (file.extension() == ".mtl") return std::nullopt;
    const auto inside = path_inside(folder_, file.lexically_relative(folder_).string());
    std::error_code failed;
    if (!inside || !fs::is_regular_file(*inside, failed)) return std::nullopt;
    return *inside;
  }

  fs::path folder_;
};

// Triangles that share nothing.
struct Soup {
  std::vector<Vec3> corners;  // three a triangle, in the file's units
};

void collect(const aiScene& scene, const aiNode& node, const aiMatrix4x4& placement, Soup& soup) {
  // A mirroring node turns triangles over.
  const bool mirrored = placement.Determinant() < 0;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    if (node.mMeshes[m] >= scene.mNumMeshes) throw std::runtime_error("a node names no mesh");
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;
      for (int i = 0; i < 3; ++i) {
        const unsigned corner = face.mIndices[mirrored ? 2 - i : i];
        if (corner >= mesh.mNumVertices)
          throw std::runtime_error("found vertex " + std::to_string(corner) +
                                   " in a face, expected less than " +
                                   std::to_string(mesh.mNumVertices));
        const aiVector3D x = placement * mesh.mVertices[corner];
        soup.corners.emplace_back(x.x, x.y, x.z);
      }
    }
  }
}

// All nodes, however deep they lie.
Soup soup_of(const aiScene& scene) {
  Soup soup;
  std::vector<std::pair<const aiNode*, aiMatrix4x4>> left;
  if (scene.mRootNode) left.emplace_back(scene.mRootNode, scene.mRootNode->mTransformation);
  while (!left.empty()) {
    const auto [node, placement] = left.back();
    left.pop_back();
    collect(scene, *node, placement, soup);
    for (unsigned c = node->mNumChildren; c-- > 0;)
      left.emplace_back(node->mChildren[c], placement * node->mChildren[c]->mTransformation);
  }
  return soup;
}

// One vertex for all corners at a place, by a hash of cells; the first corner there gives it its
// position.
class Welder {
 public:
  explicit Welder(double reach) : reach_(reach) {}

  int vertex(const Vec3& x, std::vector<Vec3>& vertices) {
    const Cell cell = cell_of(x);
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dz = -1; dz <= 1; ++dz) {
          const auto at = cells_.find({cell[0] + dx, cell[1] + dy, cell[2] + dz});
          if (at == cells_.end()) continue;
          for (const int v : at->second) {
            if ((vertices[v] - x).squaredNorm() <= reach_ * reach_) return v;
          }
        }
      }
    }
    const int number = static_cast<int>(vertices.size());
    vertices.push_back(x);
    cells_[cell].push_back(number);
    return number;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct CellHash {
    std::size_t operator()(const Cell& c) const {
      std::uint64_t h = 0;
      for (const std::int64_t i : c) {
        h = (h ^ static_cast<std::uint64_t>(i)) * 0x9e3779b97f4a7c15ull;
        h ^= h >> 29;
      }
      return h;
    }
  };

  Cell cell_of(const Vec3& x) const {
    Cell cell;
    for (int i = 0; i < 3; ++i) cell[i] = static_cast<std::int64_t>(std::floor(x[i] / reach_));
    return cell;
  }

  double reach_;
  std::unordered_map<Cell, std::vector<int>, CellHash> cells_;
};

Result<TriangleSurface> welded(const fs::path& file, const Soup& soup, double unit) {
  Box box;
  for (const Vec3& x : soup.corners) {
    if (!x.allFinite()) {
      return failure(file.string() + ": found a coordinate that isn't a finite number");
    }
    box.extend(x);
  }
  const double size = box.diagonal().norm();
  if (!(size > 0.0)) {
    return failure(file.string() + ": found all " + std::to_string(soup.corners.size()) +
                   " corners at one place, expected a surface");
  }
  // Files hold single precision: far from the origin its steps are coarser than the share of the
  // size.
  const double far = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  Welder welder(std::max(kWeld * size, 4.0 * std::numeric_limits<float>::epsilon() * far));
  TriangleSurface surface;
  for (std::size_t i = 0; i + 2 < soup.corners.size(); i += 3) {
    std::array<int, 3> triangle;
    for (int c = 0; c < 3; ++c) {
      triangle[c] = welder.vertex(soup.corners[i + c], surface.vertices);
    }
    surface.triangles.push_back(triangle);
  }
  for (Vec3& vertex : surface.vertices) vertex *= unit;
  return surface;
}

}  // namespace

Result<TriangleSurface> import_surface_here(const fs::path& file, double unit) {
  if (const auto sound = check_file(file); !sound) return std::unexpected(sound.error());
  try {
    Assimp::Importer importer;
    const fs::path whole = fs::canonical(file);
    importer.SetIOHandler(new FolderFiles(whole));  // which it deletes
    const aiScene* scene = importer.ReadFile(whole.string(), aiProcess_Triangulate);
    if (!scene) {
      std::string reason = importer.GetErrorString();
      while (!reason.empty() && std::isspace(static_cast<unsigned char>(reason.back()))) {
        reason.pop_back();
      }
      return failure(file.string() + ": cannot be read as " + geometry_extension(file).substr(1) +
                     ": " + reason);
    }
    const Soup soup = soup_of(*scene);
    if (soup.corners.empty()) {
      return failure(file.string() +
                     ": found no triangles (only points or lines, or a truncated "
                     "file), expected a closed surface");
    }
    return welded(file, soup, unit);
  } catch (const std::exception& exception) {
    // Not every path through the importers is guarded against what a broken file asks for.
    return failure(file.string() + ": cannot be read: " + exception.what());
  }
}

}  // namespace viscera
