// A body's surface less what is gone from it: a closed surface with the walls of the cut, from
// which fields, points and cells follow as from any other body's (kernels/paff).
#pragma once

#include <vector>

#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

/// What is left of a body.
struct CarvedSurface {
  TriangleSurface surface;    ///< closed, oriented outwards; nothing: all is gone
  std::vector<int> vertices;  ///< of each vertex: which of the body's it is; -1: new
  std::vector<int> skin;      ///< of each triangle: the body's that it lies in; -1: a wall
};

/// Both surfaces closed, manifold and oriented outwards, in general position: no corner of one lies
/// on the other, as none does where one comes from measurements or void_surface. Triangles that
/// meet are divided along where they do, all others stay as they are. Fails where rounding leaves
/// it open whether they meet.
Result<CarvedSurface> carve(const TriangleSurface& body, const TriangleSurface& gone);

}  // namespace viscera
