// What contact on one body is asked and answers: patches of its surface, and their forces.
#pragma once

#include <vector>

#include "kernels/base/fields.h"
#include "kernels/contact/near_field.h"

namespace viscera {

/// A small patch of surface that a tool presses or holds as a whole.
struct ContactCell {
  Vec3 position = Vec3::Zero();  ///< rest, on the surface [m]
  Vec3 normal = Vec3::UnitZ();   ///< outward unit surface normal
  double area = 0.0;             ///< [m2]
  bool held = false;             ///< false: pressed, can only be pushed
  /// Standard deviation of the bell that spreads its load, in spacings of nodes; 0: that of a lone
  /// cell, PatchContact::spread_factor().
  float bell = 0.0f;

  Vec3 direction = -Vec3::UnitZ();  ///< pressed: unit, the way the tool pushes
  double depth = 0.0;  ///< pressed: u . direction >= depth wanted [m]; may be negative (a gap)
  /// Held: u wanted [m]. Pressed with friction: the part of it across `direction` is the u that
  /// keeps the cell where it clings to the tool, zero where the tool first touched it.
  Vec3 displacement = Vec3::Zero();
  /// u where no force acts, which the forces add to: what gravity has moved the body [m].
  Vec3 free = Vec3::Zero();
  /// Pressed: coefficient of Coulomb friction. Where the cell slips it clings to another place of
  /// the tool: for the next step add ContactSolution::slips to `displacement`.
  double friction = 0.0;

  static constexpr auto fields() {
    using C = ContactCell;
    return std::tuple(field("position", &C::position), field("normal", &C::normal),
                      field("area", &C::area), field("bell", &C::bell), field("held", &C::held),
                      field("direction", &C::direction), field("depth", &C::depth),
                      field("displacement", &C::displacement), field("free", &C::free),
                      field("friction", &C::friction));
  }
};
static_assert(fields_cover<ContactCell>());

/// All of it is finite, it has an area, and its friction isn't negative.
bool is_sound(const ContactCell& cell);

struct ContactSolution {
  std::vector<Vec3> forces;  ///< on the tissue, per cell [N]              (cells)
  std::vector<Vec3> slips;   ///< how far each cell with friction is from `displacement`, across
                             ///< `direction` [m]; 0 where it sticks             (cells)
  std::vector<NearField> near_fields;  ///< of each cell: what is finer than nodes   (cells)
  int touching = 0;                    ///< cells with force
  int beyond_touchable = 0;            ///< cells with no touchable surface in reach; they load the
                                       ///< nearest sample
  int pivots = 0;                      ///< exchanges of the active set; rounds, with friction
  bool converged = false;  ///< false: no forces. A cell isn't finite, has no area or a negative
                           ///< friction; the compliance isn't positive; or, with friction or an
                           ///< unsymmetric compliance, no solution was found
  double smallest_eigenvalue = 0.0;  ///< of the touching cells' compliance (its symmetric half),
                                     ///< relative to its largest; > 0 where C is symmetric
  double lifted = 0.0;               ///< greatest eigenvalue added to make the compliance positive,
                                     ///< relative to its largest; 0 but for tools of several
                                     ///< sizes at one spot, and around edges
  double residual = 0.0;             ///< with friction: greatest violation of a condition, as a
                                     ///< force over the greatest one
  double violation = 0.0;            ///< greatest remaining penetration of a free cell [m]
};

/// The body's answer to the forces of a contact: what deformation and drawing need.
struct ContactResponse {
  std::vector<int> touched;  ///< indices into SurfaceCompliance::touchable, ascending
  std::vector<Vec3> loads;   ///< on those places [N]

  static constexpr auto fields() {
    return std::tuple(field("touched", &ContactResponse::touched),
                      field("loads", &ContactResponse::loads));
  }
};
static_assert(fields_cover<ContactResponse>());

/// The loads of both as one.
ContactResponse merged(const ContactResponse& one, const ContactResponse& other);

}  // namespace viscera
