// A block large enough to be nearly a half-space, for closed forms of contact.
#pragma once

#include <cmath>

#include "tests/kernels/contact/bodies.h"

namespace viscera::test {

inline const IsotropicMaterial kHalfSpaceTissue{1e4, 0.45};
inline constexpr double kBlockTop = 0.03;

/// 80 x 80 x 60 mm, held at its bottom, nodes 7 mm apart: coarser than any contact on it.
inline const PressedBody& half_space_block() {
  static const PressedBody body =
      prepare_block(Vec3(0.08, 0.08, 2.0 * kBlockTop), 7e-3, 0.025, kHalfSpaceTissue);
  return body;
}

struct Answer {
  ContactSolution solution;
  std::vector<Vec3> displacements;  ///< of the cells [m]
  double force = 0.0;               ///< into the block [N]
};

inline Answer press_block(const std::vector<ContactCell>& cells) {
  const PressedBody& body = half_space_block();
  PatchContact contact(body.compliance, body.touch, body.material);
  Answer answer;
  ContactResponse response;
  contact.solve(cells, answer.solution, response);
  EXPECT_TRUE(answer.solution.converged);
  answer.displacements = contact.cell_displacements();
  answer.force = -total_force(answer.solution).z();
  return answer;
}

// How the finite block differs. Far from the contact its force acts as a point force, and what the
// block's ends send back is constant over the contact to first order: u = u_half_space -
// c F / (E* L). So forces deviate by a share proportional to a / L, whatever the contact's shape,
// and the answers for a and a / 2 extrapolate to the half-space up to (a / L)^2. Layers on a rigid
// base have c = 1.13 at nu = 1/2, 1.04 at 0.45, for L their thickness [Dimitriadis2002]; free sides
// send back the opposite. So a deviation beyond c a / L is not the block's.

/// Bound of that deviation for a contact of radius a [m].
inline double finite_share(double a) {
  return 1.04 * a / (2.0 * kBlockTop);
}
/// What is left after extrapolating from a and a / 2.
inline double finite_share_extrapolated(double a) {
  return finite_share(a) * finite_share(a);
}

}  // namespace viscera::test
