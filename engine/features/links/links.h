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

#include <array>
#include <string>
#include <vector>

#include "engine/features/links/links_keys.h"
#include "engine/simulation/feature.h"
#include "kernels/contact/contact_island.h"

namespace viscera {

/// Springs between the surfaces of two organs; one component a link, on an entity of its own.
struct Link {
  static constexpr bool kConstant = true;
  std::string name;
  double softness = 0.0;       ///< of one spring [m/N]
  std::array<Entity, 2> ends;  ///< a stale one: the ground
  std::size_t springs = 0;
};

struct LinkState {
  static constexpr std::string_view kName = "links";
  struct Spring {
    std::array<Vec3, 2> displacements{Vec3::Zero(),
                                      Vec3::Zero()};  ///< of its ends by deformation, world [m]
    Vec3 force = Vec3::Zero();  ///< on its first end, world; on the other its opposite [N]
    /// The same a frame ago.
    std::array<Vec3, 2> displacements_before{Vec3::Zero(), Vec3::Zero()};
    Vec3 force_before = Vec3::Zero();
    static constexpr auto fields() {
      using S = Spring;
      return std::tuple(field("displacements", &S::displacements), field("force", &S::force),
                        field("displacements_before", &S::displacements_before),
                        field("force_before", &S::force_before));
    }
  };
  std::vector<Spring> springs;
  Vec3 shift = Vec3::Zero();  ///< of the second end's frame beyond the first's by breathing [m]
  double force = 0.0, greatest_force = 0.0;  ///< of all springs, now and so far [N]
  static constexpr auto fields() {
    using S = LinkState;
    return std::tuple(field("springs", &S::springs), field("shift", &S::shift),
                      field("force", &S::force), field("greatest_force", &S::greatest_force));
  }
};
static_assert(fields_cover<LinkState>());

/// The springs that end on an organ. Organs without elasticity have none: they don't yield.
struct OrganTies {
  static constexpr bool kConstant = true;
  struct Tie {
    Entity link;
    std::size_t spring = 0;
    int side = 0;               ///< which end of the link the organ is
    Entity other;               ///< organ that yields at the other end; a stale one: none does
    std::size_t other_tie = 0;  ///< the same spring among its ties
  };
  std::vector<Tie> ties;             ///< (n)
  std::vector<ContactCell> cells;    ///< organ's frame      (n)
  std::vector<SurfacePoint> points;  ///< of the drawn surface, where they are  (n)
  MatrixX behind;   ///< what the other ends yield under forces on these, world [m/N]  (3n x 3n)
  MatrixX backing;  ///< the same with the springs' own softness, organ's frame  (3n x 3n)
};

/// Organs whose contact is solved together.
struct LinkGroups {
  static constexpr bool kConstant = true;
  std::vector<std::vector<Entity>> groups;
};

/// An organ whose group is touched, or moved by breathing or gravity, in this frame.
struct LoadedTies {
  bool loaded = false;
  bool joined = false;  ///< its springs are solved with what else it touches (add_springs)
};

/// True for an organ that the links' solve answers for in this frame.
bool is_link_loaded(const World& world, Entity organ);

/// Organs at the other ends of its springs, as often as there are springs.
std::vector<Entity> linked_to(const World& world, Entity organ);
/// The springs of organs that are solved as one, as joints, with the forces that they have had.
/// `bodies`: what these organs are there; -1: nothing. Organs that aren't among them stay where
/// they were.
void add_springs(World& world, std::span<const Entity> organs, std::span<const int> bodies,
                 std::vector<Joint>& joints, std::vector<Vec3>& forces);
/// Forces of those joints, and where their ends have come.
void take_springs(World& world, std::span<const Entity> organs, std::span<const int> bodies,
                  std::span<const Vec3> forces);

/// What became of a link in a run.
struct LinkFigures {
  std::string name;
  std::array<std::string, 2> between;
  double stiffness = 0.0;  ///< [N/m]
  std::size_t springs = 0;
  double greatest_force = 0.0;  ///< of all springs together [N]
};
std::vector<LinkFigures> link_figures(const World& world);
std::vector<ReportSection> links_report(const World& world);  ///< "links"

Feature links_feature();

}  // namespace viscera
