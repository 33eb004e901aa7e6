// Bodies that decide what a contact on them feels: the half-space's closed form doesn't. Each with
// its loads, and the reference that finite elements of our own give for it (reference_solid.h).
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/verification/pressed_body.h"
#include "kernels/base/result.h"

namespace viscera {

/// stick: a disc of radius a, or what of a ball lies within it, is moved down whole; flat: the same
/// without friction, straight down; ball: a rigid ball is pressed on without friction, and touches
/// as far as it does; plate: a flat plate likewise; press: the smooth pressure (1 - r^2 / a^2)^2 E.
enum class BodyLoad { kStick, kFlat, kBall, kPlate, kPress };
std::string_view name_of(BodyLoad load);

/// The size of a in SI units, and Young's modulus.
inline constexpr double kBodyUnit = 2.5e-3;   // [m]
inline constexpr double kBodyModulus = 10e3;  // [Pa]
/// A ball's radius over a; with this depth it would touch a half-space within a.
inline constexpr double kBodyBall = 4.0;

/// What a load does, over a, E and E a^2.
struct BodyReference {
  struct Sample {
    Vec3 place, displacement;
    double weight;  ///< the share of area or line that it stands for
  };
  double force = 0.0;  ///< on the body, along -z
  std::vector<Sample> samples;
};

/// Lengths over a. The contact's middle is the origin, the body below it.
struct BodyCase {
  std::string name, what;
  std::vector<BodyLoad> loads;
  TriangleSurface surface;
  std::function<bool(const Vec3&)> is_fixed, is_touchable;
  double cap = 0.0;  ///< radius of the ball whose top is pressed; 0: a plane
  /// Turned about the z axis: samples lie on the half plane y = 0, and stand for all others.
  bool turned = true;
  std::function<Result<BodyReference>(const BodyCase&, BodyLoad, double, int)> solve;
  /// That the kept references are solved with.
  int refinement = 1;

  /// By finite elements: `refinement` -1 for seconds, 0 or 1 up to minutes and some gigabytes.
  Result<BodyReference> reference(BodyLoad load, double poisson_ratio, int refinement) const {
    return solve(*this, load, poisson_ratio, refinement);
  }
};

/// How far the tool comes down [a]; 0 for a pressure.
double depth_of(const BodyCase& body, BodyLoad load);
/// Force of the load on a half-space, over E a^2: the closed form that the body is to differ from.
double half_space_force(const BodyCase& body, BodyLoad load, double poisson_ratio);

/// A ball glued to a plate by a cap and pressed by another; slabs 2, 3.5 and 5 a thick; contacts
/// 1.2, 2 and 4 a from a right-angled edge; a bar held at its end and pressed near the other.
const std::vector<BodyCase>& body_cases();

/// Prepared with at most so many equally spaced nodes.
Result<std::unique_ptr<PressedBody>> prepare_body(const BodyCase& body, double poisson_ratio,
                                                  std::size_t nodes, const std::string& formulation,
                                                  const Progress& progress);
/// The cells of a load on it, in SI units: 127, or those of them that lie on the body.
std::vector<ContactCell> cells_of(const BodyCase& body, BodyLoad load, double poisson_ratio);
PressedAnswer press_body(PressedBody& prepared, const BodyCase& body, BodyLoad load);

struct BodyErrors {
  double force = 0.0;    ///< relative; 0 for a pressure
  double profile = 0.0;  ///< relative L2 distance of the surface's displacement over the samples
};
BodyErrors errors_of(const PressedBody& prepared, const BodyCase& body, const PressedAnswer& answer,
                     const BodyReference& reference);

}  // namespace viscera
