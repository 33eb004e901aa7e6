// Links: springs between the surfaces of organs, solved together with the organs' contact.
//
// A spring's force f on organ A, and -f on organ B, is such that u_A + f / k = u_B, with the motion
// of both organs' frames in u. Written for A alone, with what B would do without this force on the
// right,
//
//   (C_A + C_B + 1/k) f = ...
//
// B's compliance stands behind the spring as if it were the spring's own softness (PatchContact's
// `backing`). So contact on A is solved exactly with all that hangs on it, for any k: a stiff link
// is no harder than a soft one. Where tools press both organs the two problems overlap in f, and
// are solved in turn. Each turn minimises the energy of the whole, a convex function under
// conditions that each belong to one organ, over some of its unknowns: it can only sink, so no
// stiffness, order or number of rounds makes it grow [Badea2003]. The alternative, each organ
// following where the other was, is as stable but sticks where k is large.
#pragma once

#include <functional>

#include "engine/scene/scene.h"
#include "engine/world.h"

namespace viscera {

/// Fills World::links and what belongs to them. The errors name the keys of the scene.
Result<void> make_links(const SceneDescription& scene, World& world);

/// Link.shift, and the link cells of every organ whose group a tool touches or breathing stretches:
/// after those of the tools in OrganContact.cells. Other groups' links come to rest.
void add_link_cells(World& world);

/// Solves contact on one organ, its link cells held by what yields as this matrix says.
using SolveContact = std::function<void(Entity organ, const MatrixX& backing)>;

/// Contact of all organs in loaded groups, and the forces of their links: OrganContact.solution and
/// .response, Link.springs.
void solve_linked(World& world, const SolveContact& solve);

/// True for an organ that solve_linked answers for in this frame.
bool is_link_loaded(const World& world, Entity organ);

}  // namespace viscera
