// Patterns of cells for a contact whose edge is known: flat ends, prescribed patches.
//
// The pressure under a flat punch grows without bound towards its edge, and uniform cells can't
// follow it: a pattern that fills the contact exactly answers as a slightly smaller punch. On a
// half-space the force of a flat punch is proportional to its radius, so a pattern has one radius
// that fits its force, the same at every scale; it depends on the pattern, on Poisson's ratio and
// on whether the punch sticks. Computed from the cells' own half-space response, it says how much
// larger to make the pattern. A ball's contact ends where its pressure vanishes: its pattern need
// only be wide enough (ball_pattern_radius).
#pragma once

#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// Cells in a plane, about the origin.
struct CellPattern {
  std::vector<Vec2> places;   ///< [m], or of any unit
  std::vector<double> areas;  ///< [m2], or its square
};

/// Cells of equal area that cover the disc of this radius: one at the centre, then 6 i in ring i.
CellPattern ringed_disc(double radius, int rings);
/// Hexagonal grid with its neighbours `pitch` apart, the centre first: 1 + 3 rings (rings + 1)
/// cells.
CellPattern hexagonal_grid(double pitch, int rings);

/// Radius of the rigid flat punch that presses a half-space with the force that moving the cells of
/// `pattern` down as one does. `sticks`: the cells can't slide; the punch is the bonded one,
/// F = 4 G a d ln(3 - 4 nu) / (1 - 2 nu); else F = 2 E* a d [Johnson1985] ch. 3. Exact up to the
/// cells' response (disc to disc); cost: one dense factorisation.
double punch_radius(const CellPattern& pattern, double poisson_ratio, bool sticks);

/// `pattern` about its origin so scaled that its punch_radius is `radius`.
CellPattern fitted_to_punch(CellPattern pattern, double radius, double poisson_ratio, bool sticks);

/// Radius of the pattern for a ball whose lowest point is `depth` below the surface as it is
/// without the ball [m]: a little wider than it touches by [Hertz1882], sqrt(radius depth), never
/// narrower than a third of the ball and never as wide. A function of place alone: it doesn't ask
/// for the force. Where the whole body gives way it is wider than need be, and where it hardly
/// does the force depends on it.
double ball_pattern_radius(double radius, double depth);

}  // namespace viscera
