// The drawn surface of an organ, from its geometry: a recipe of assets/organs meshed from a signed
// distance, a built-in body, or an imported file.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

/// A signed distance (or a field with its sign and about its slope near zero), negative inside [m].
using SignedDistance = std::function<double(const Vec3&)>;

/// Meshes {distance < 0} inside `box` as one closed, outward oriented surface of nearly equilateral
/// triangles with edges of about `edge` [m]; vertices lie on the zero set to 1e-3 edge. Parts
/// thinner than a cell of the grid that finds the body, 0.8 edge or `cell` [m] where that is less,
/// may be lost. Pieces of less than 1 % of the volume are dropped; more of them are refused.
Result<TriangleSurface> mesh_signed_distance(const SignedDistance& distance, const Box& box,
                                             double edge,
                                             double cell = std::numeric_limits<double>::infinity());

/// Brings a closed surface to exactly `triangles` triangles (even, at least 20) by edge collapses
/// or splits, keeping it closed and its vertices on `distance`'s zero set.
Result<TriangleSurface> with_triangle_count(const TriangleSurface& surface, int triangles,
                                            const SignedDistance& distance);

/// Splits edges longer than `edge` [m], keeping the surface closed; new vertices on the smooth
/// surface that the vertex normals describe (so that an imported coarse organ has no facets).
TriangleSurface refined(const TriangleSurface& surface, double edge);

/// Refuses bodies of less than 1 mm or more than 2 m across, and guesses the unit that would fit.
/// `unit`: metres per unit of the body's file; 0 where it has none.
Result<void> check_body_size(const std::string& subject, const TriangleSurface& surface,
                             double unit);

/// The surface of a scene's organ, in the organ's own frame, sound by surface_defects().
/// `assets` is the project's assets folder (recipes in assets/organs/NAME.json). `notes` gets what
/// a person should know: how far a wrapped surface is from its original, which gaps were closed.
Result<TriangleSurface> build_shape(const OrganGeometry& geometry,
                                    const std::filesystem::path& assets,
                                    std::vector<std::string>& notes);
Result<TriangleSurface> build_shape(const OrganGeometry& geometry,
                                    const std::filesystem::path& assets);

}  // namespace viscera
