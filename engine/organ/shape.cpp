#include "engine/organ/shape.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "engine/io/foreign_files.h"
#include "engine/organ/built_in_bodies.h"
#include "engine/organ/recipe.h"
#include "engine/organ/wrap.h"
#include "kernels/points/surface_checks.h"

namespace viscera {
namespace {

constexpr double kGreatestBody = 2.0;  // [m]
constexpr double kLeastBody = 1e-3;    // [m]

// Triangles beyond which a drawn surface is a mistake of units.
constexpr double kMostTriangles = 4e6;

std::unexpected<Error> about(const std::string& subject, const Error& error) {
  Error named;
  for (const std::string& message : error.messages) {
    named.messages.push_back(subject + ": " + message);
  }
  return std::unexpected(std::move(named));
}

std::string digits(double value, const char* unit) {
  char text[48];
  std::snprintf(text, sizeof text, "%.4g %s", value, unit);
  return text;
}

}  // namespace

Result<void> check_body_size(const std::string& subject, const TriangleSurface& surface,
                             double unit) {
  const double size = bounds(surface).sizes().maxCoeff();
  if (size >= kLeastBody && size <= kGreatestBody * (1.0 + 1e-9)) return {};
  std::string message =
      subject + ": found a body of " + digits(size, "m") + " across, expected 1 mm to 2 m";
  // The unit under which the file would hold an organ.
  struct Unit {
    const char* name;
    double metres;
  };
  for (const Unit& guess : {Unit{"mm", 1e-3}, Unit{"cm", 1e-2}, Unit{"m", 1.0}}) {
    if (unit == 0.0) break;
    const double guessed = size / unit * guess.metres;
    if (guessed < 0.01 || guessed > 0.6) continue;
    message += " (did you mean unit \"" + std::string(guess.name) + "\"?)";
    break;
  }
  return failure(message);
}

namespace {

Result<void> check_edge(const std::string& subject, const TriangleSurface& surface, double edge) {
  if (edge <= 0.0) return {};
  const double triangles = area(surface) / (0.433 * edge * edge);
  if (triangles <= kMostTriangles) return {};
  return failure(subject + ": found an edge of " + digits(1e3 * edge, "mm") + ", which makes " +
                 digits(triangles, "triangles") + "; expected at most " +
                 digits(kMostTriangles, "triangles"));
}

Result<TriangleSurface> sound(const std::string& subject, Result<TriangleSurface> surface) {
  if (!surface) return about(subject, surface.error());
  const std::vector<std::string> defects = surface_defects(*surface);
  if (defects.empty()) return surface;
  Error error;
  error.messages = defects;
  return about(subject, error);
}

Result<TriangleSurface> surface_of_recipe(const Recipe& recipe, const RecipeGeometry& geometry) {
  const double scale = geometry.scale;
  const SignedDistance distance = [inner = recipe.distance, scale](const Vec3& x) {
    return scale * inner(x / scale);
  };
  const Box box(scale * recipe.box.min(), scale * recipe.box.max());
  const double cell =
      recipe.cell > 0.0 ? scale * recipe.cell : std::numeric_limits<double>::infinity();
  // An edge asked for by the scene overrides the recipe's own number of triangles.
  const std::optional<int> triangles = geometry.triangles    ? geometry.triangles
                                       : geometry.edge > 0.0 ? std::nullopt
                                                             : recipe.triangles;
  if (!triangles) {
    const double edge = geometry.edge > 0.0 ? geometry.edge : scale * recipe.edge;
    return mesh_signed_distance(distance, box, edge, cell);
  }
  // A first surface measures the area, which decides the edge.
  const auto rough = mesh_signed_distance(distance, box, box.sizes().maxCoeff() / 50.0, cell);
  if (!rough) return rough;
  return with_triangle_count(*rough, *triangles, distance);
}

Result<TriangleSurface> built_in(const RecipeGeometry& geometry) {
  const bool block = geometry.recipe == "block";
  const double extent =
      block ? geometry.scale * geometry.size.minCoeff() : geometry.scale * geometry.radius;
  if (!(extent > 0.0)) {
    return failure(block ? "found a size that isn't positive along every axis"
                         : "found a radius that isn't positive");
  }
  const double edge = geometry.edge > 0.0 ? geometry.edge : extent / (block ? 10.0 : 15.0);
  const double greatest = block ? geometry.scale * geometry.size.maxCoeff() : extent;
  if (12.0 * std::pow(greatest / edge, 2) > kMostTriangles) {
    return failure("found an edge of " + digits(1e3 * edge, "mm") + " on a body of " +
                   digits(1e3 * greatest, "mm") + ", expected a greater edge");
  }
  if (block) return block_surface(geometry.scale * geometry.size, edge, geometry.triangles);
  if (geometry.recipe == "sphere") return sphere_surface(extent, edge, geometry.triangles);
  return hemisphere_surface(extent, edge, geometry.triangles);
}

Result<TriangleSurface> build(const RecipeGeometry& geometry, const std::filesystem::path& assets) {
  const std::string& name = geometry.recipe;
  if (geometry.triangles && (*geometry.triangles < 20 || *geometry.triangles % 2 != 0)) {
    return failure(name + ": found " + std::to_string(*geometry.triangles) +
                   " triangles, expected an even number of at least 20 (closed surfaces of "
                   "triangles have an even number)");
  }
  Result<TriangleSurface> surface;
  if (name == "sphere" || name == "hemisphere" || name == "block") {
    surface = built_in(geometry);
  } else {
    const Result<Recipe> recipe = load_recipe(assets, name, geometry.seed);
    if (!recipe) return std::unexpected(recipe.error());
    surface = surface_of_recipe(*recipe, geometry);
  }
  surface = sound(name, std::move(surface));
  if (!surface) return surface;
  if (const auto size = check_body_size(name, *surface, 0.0); !size) {
    return std::unexpected(size.error());
  }
  return surface;
}

Result<TriangleSurface> wrapped(const FileGeometry& geometry, const TriangleSurface& original,
                                std::vector<std::string>& notes) {
  const WrapOptions options{geometry.wrap->voxel, geometry.wrap->close, geometry.edge};
  auto wrap = wrap_surface(original, options);
  if (!wrap) return about(geometry.file.string(), wrap.error());
  for (std::string& note : wrap_notes(*wrap, options)) notes.push_back(std::move(note));
  return std::move(wrap->surface);
}

Result<TriangleSurface> build(const FileGeometry& geometry, std::vector<std::string>& notes) {
  const std::string subject = geometry.file.string();
  auto imported = import_surface(geometry.file, geometry.unit);
  if (!imported) return imported;
  if (geometry.wrap) {
    if (const auto size = check_body_size(subject, *imported, geometry.unit); !size) {
      return std::unexpected(size.error());
    }
    imported = wrapped(geometry, *imported, notes);
    if (!imported) return imported;
  }
  Result<TriangleSurface> surface = sound(subject, std::move(imported));
  if (!surface) {
    if (!geometry.wrap) {
      surface.error().messages.push_back(
          subject +
          ": \"wrap\": {\"voxel_mm\": ...} in its geometry puts a closed surface around it");
    }
    return surface;
  }
  if (const auto size = check_body_size(subject, *surface, geometry.unit); !size) {
    return std::unexpected(size.error());
  }
  if (geometry.recentre) {
    const Vec3 centre = bounds(*surface).center();
    for (Vec3& vertex : surface->vertices) vertex -= centre;
  }
  if (geometry.edge <= 0.0 || geometry.wrap) return surface;
  if (const auto fits = check_edge(subject, *surface, geometry.edge); !fits) {
    return std::unexpected(fits.error());
  }
  return sound(subject + ", refined", refined(*surface, geometry.edge));
}

}  // namespace

Result<TriangleSurface> build_shape(const OrganGeometry& geometry,
                                    const std::filesystem::path& assets,
                                    std::vector<std::string>& notes) {
  if (const auto* recipe = std::get_if<RecipeGeometry>(&geometry)) return build(*recipe, assets);
  return build(std::get<FileGeometry>(geometry), notes);
}

Result<TriangleSurface> build_shape(const OrganGeometry& geometry,
                                    const std::filesystem::path& assets) {
  std::vector<std::string> unread;
  return build_shape(geometry, assets, unread);
}

}  // namespace viscera
