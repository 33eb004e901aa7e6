// Bodies as fields: negative inside, zero on the surface, with a slope of about one near it. Small
// fields are put together into organs.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/organ/shape.h"

namespace viscera {

/// Quilez' bound on the distance to an ellipsoid; exact in value and slope at its surface.
SignedDistance ellipsoid(const Vec3& centre, const Vec3& radii);

/// A point of a tube's axis and the tube's radius there [m].
struct TubePoint {
  Vec3 centre;
  double radius;
};
/// A round tube with round ends about the Catmull-Rom spline through at least two points.
SignedDistance tube(const std::vector<TubePoint>& points);

/// What makes a gut of a tube: folds across it, which its bands interrupt (a colon's haustra
/// between its taeniae). All lengths [m].
struct GutFolds {
  double pitch = 0.0;       ///< between folds, along the axis
  double depth = 0.0;       ///< of the furrow that a fold leaves outside
  int bands = 0;            ///< along the tube, evenly around it
  double band_depth = 0.0;  ///< of a band under the bulges beside it
  double band_width = 0.0;
  double turn = 0.0;  ///< of the first band about the axis [rad]
};
/// The tube with its folds: the bulges of neighbouring rows, between two bands each, don't stand
/// side by side but are shifted against each other. Wants pitch > 0.
SignedDistance folded_tube(const std::vector<TubePoint>& points, const GutFolds& folds);

/// Balls that melt into each other over `blend` [m] > 0 (a logarithmic sum of exponentials).
SignedDistance metaballs(const std::vector<TubePoint>& balls, double blend);

/// An axis-aligned box of these edges, its own edges rounded by `round` [m].
SignedDistance rounded_box(const Vec3& centre, const Vec3& size, double round);

/// Everything behind the plane through `point`; `outward` needn't be a unit vector.
SignedDistance half_space(const Vec3& point, const Vec3& outward);

/// `smooth` [m] >= 0: width over which the two surfaces melt into each other; 0 keeps the crease.
SignedDistance join(SignedDistance a, SignedDistance b, double smooth);
SignedDistance intersect(SignedDistance a, SignedDistance b, double smooth);
SignedDistance subtract(SignedDistance from, SignedDistance taken, double smooth);

/// The layer of this thickness [m] under the body's surface.
SignedDistance shell(SignedDistance of, double thickness);
SignedDistance grow(SignedDistance of, double by);

/// The body turned about the origin, then moved by pose.position.
SignedDistance moved(SignedDistance of, const Pose& pose);
/// The body multiplied by `factors` > 0 along the axes.
SignedDistance stretched(SignedDistance of, const Vec3& factors);

/// The body seen in a mirror at the origin across this axis.
SignedDistance mirrored(SignedDistance of, int along);

/// Bows the body: a point at s from `middle` [m] along one axis moves by (s - middle)^2 / (2
/// radius) along another: a circle of that radius near the middle. A negative radius bows the other
/// way.
SignedDistance bent(SignedDistance of, int along, int towards, double middle, double radius);

/// Multiplies the cross-section by a factor that goes smoothly from `from_scale` at `from` [m] to
/// `to_scale` at `to` along one axis, constant beyond.
struct Taper {
  int along = 0;
  double from = 0.0, to = 1.0;
  double from_scale = 1.0, to_scale = 1.0;
};
SignedDistance tapered(SignedDistance of, const Taper& taper);

/// Moves the surface in and out by about `amplitude` [m], by a sum of plane waves of about this
/// length [m] whose directions and phases are drawn from the seed.
SignedDistance roughened(SignedDistance of, double amplitude, double wavelength, std::uint64_t seed,
                         std::uint64_t stream);

/// Covers the surface with round bumps, at most `height` [m] high and about `size` [m] wide, that
/// meet in furrows (fat, in lobules); their middles are drawn from the seed.
SignedDistance lobulated(SignedDistance of, double height, double size, std::uint64_t seed,
                         std::uint64_t stream);

}  // namespace viscera
