#include "engine/features/free_bodies/rubber_organs.h"

namespace viscera {
namespace {

OrganDescription rubber(const std::string& name, const RecipeGeometry& geometry,
                        const Vec3& middle) {
  OrganDescription organ;
  organ.name = name;
  organ.geometry = geometry;
  organ.tissue = "rubber";
  organ.pose.position = middle;
  return organ;
}

}  // namespace

OrganDescription still_block(const std::string& name, const Vec3& from, const Vec3& to) {
  constexpr double kEdge = 20e-3;
  RecipeGeometry geometry;
  geometry.recipe = "block";
  geometry.size = to - from;
  geometry.edge = kEdge;
  OrganDescription block = rubber(name, geometry, 0.5 * (from + to));
  block.deformable = false;
  return block;
}

OrganDescription free_rubber(const std::string& name, const RecipeGeometry& geometry,
                             const Vec3& middle, double spacing) {
  OrganDescription organ = rubber(name, geometry, middle);
  organ.resolution.spacing = organ.resolution.finest = spacing;
  organ.free = true;
  return organ;
}

}  // namespace viscera
