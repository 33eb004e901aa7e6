// Recipes of assets/organs: a body as a small tree of implicit shapes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/organ/shape.h"

namespace viscera {

/// What a recipe file says, for one seed.
struct Recipe {
  std::string name;
  SignedDistance distance;
  Box box;                       ///< encloses the body with a margin [m]
  double cell = 0.0;             ///< greatest grid cell that sees its thinnest parts [m]; 0: any
  double edge = 0.0;             ///< default triangle edge [m]; 0 where `triangles` is given
  std::optional<int> triangles;  ///< default number of triangles
};

/// Reads `assets`/organs/`name`.json, a JSON object with comments:
///   version      1
///   about        what the body is, its frame and its origin, for people
///   box_mm       [[least corner], [greatest corner]]
///   edge_mm      default triangle edge, or `triangles`, a default number of triangles
///   cell_mm      greatest grid cell that sees the thinnest parts of the body; optional
///   shape        a shape
/// A shape is an object with one key, the kind, whose value is an object:
///   ellipsoid     centre_mm, radii_mm, turn_deg
///   tube          points_mm: [[x, y, z, radius], ...], a spline; and, for a gut, folds: {pitch_mm,
///                 depth_mm, bands, band_depth_mm, band_width_mm, turn_deg}: furrows across it that
///                 bands along it interrupt
///   metaballs     balls_mm: [[x, y, z, radius], ...], blend_mm
///   box           centre_mm, size_mm, round_mm
///   half_space    point_mm, outward
///   union, intersection   of: [shapes], smooth_mm
///   subtract      from: shape, take: [shapes], smooth_mm
///   shell         of, thickness_mm
///   grow          of, by_mm
///   move          of, turn_deg (about x, then y, then z, all fixed axes), then by_mm
///   stretch       of, factors
///   bend          of, along, towards ("x", "y", "z"), middle_mm, radius_mm
///   taper         of, along, from_mm, to_mm, from_scale, to_scale
///   mirror        of, along
///   recipe        name, seed (this recipe's): the body of another recipe, in that one's frame;
///   what
///                 makes room for a neighbour takes it away, a little grown
///   lobules       of, height_mm, size_mm: bumps that meet in furrows, drawn from the seed
///   noise         of, amplitude_mm, wavelength_mm: drawn from the seed
/// All mistakes are listed as "FILE: KEY.PATH: found ..., expected ...".
Result<Recipe> load_recipe(const std::filesystem::path& assets, const std::string& name,
                           std::uint64_t seed);

/// The recipe's file, and those of all recipes that it is made of.
std::vector<std::filesystem::path> recipe_files(const std::filesystem::path& assets,
                                                const std::string& name);

}  // namespace viscera
