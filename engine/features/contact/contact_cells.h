// From a tool over a deformed surface to the cells of a contact problem.
//
// The cells hang on the tool, not on the tissue: a hexagonal pattern around the tip, each cell's
// ray finding the tissue that lies under it now. Whatever the tool slides over, the pattern under
// it is the same, so the force has no texture of nodes, triangles or cells.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/simulation/components.h"
#include "engine/simulation/tool_shape.h"

namespace viscera {

/// The tissue nearest to a tool.
struct Foot {
  Vec3 probe = Vec3::Zero();     ///< place of the tool that is nearest [m]
  Vec3 position = Vec3::Zero();  ///< of the tissue, deformed [m]
  Vec3 outward = Vec3::UnitZ();  ///< unit; mean normal of the tissue around
  double clearance = 0.0;        ///< between tool and tissue; negative when it penetrates [m]
};

/// Tools nearer than this to tissue enter its contact problem [m].
inline constexpr double kContactMargin = 1.0e-3;

/// Nothing when no tissue lies within `margin` of the tool [m].
std::optional<Foot> find_foot(const ToolShape& tool, double margin, const OrganModel& model,
                              const OrganState& state, const CollisionSurface& surface);

/// What rubs between a tool and an organ.
struct Rubbing {
  double friction = 0.0;
  const Cling* cling = nullptr;  ///< of the last frame; null: nothing clung to the tool
  Vec3 undrawn = Vec3::Zero();   ///< undrawn_drag(*cling, ...) [m]
};

/// How much farther than the drawn surface shows the tissue of `cling` moved, in the mean [m]: what
/// is finer than nodes is drawn along the normal alone.
Vec3 undrawn_drag(const Cling& cling, const OrganState& state, const OrganModel& model);

/// Appends the cells that the tool presses and fills `range`; false when there are none.
/// `last_force` that presses the tissue [N] sizes the pattern: cells crowd where contact is.
bool press_cells(const ToolShape& tool, const Foot& foot, double last_force, const Rubbing& rubbing,
                 const OrganModel& model, const CollisionSurface& surface,
                 std::vector<ContactCell>& cells, CellRange& range);

/// On a tool without friction, by the forces of its cells after a solve [N]: each pushes it as the
/// tissue under the cell is tilted, not along one common direction, since a tool that goes aside
/// climbs that tissue. It is what the stored energy falls by, and what a hand feels
/// (haptics/tool_foot.h); what the cells load the organ with goes along their common direction.
Vec3 push_on_tool(const CellRange& range, const std::vector<ContactCell>& cells,
                  std::span<const Vec3> forces);

/// What clings to the tool of `range` after `solution` of `cells`; no spots: nothing. `last` as in
/// Rubbing.
Cling clinging_tissue(const CellRange& range, const std::vector<ContactCell>& cells,
                      const ContactSolution& solution, const Cling* last);

/// The cells that a jaw closing at `foot` holds, each with its displacement at this moment;
/// `points` of the drawn surface is where they are.
std::vector<ContactCell> grasp_cells(const Foot& foot, double radius, const OrganModel& model,
                                     const TissueContact& tissue, const CollisionSurface& surface,
                                     std::vector<SurfacePoint>& points);

/// ContactCell::free of cells at these points of the surface.
void let_move(const FreeShape& shape, const TriangleSurface& surface,
              std::span<const SurfacePoint> points, std::span<ContactCell> cells);

/// How far a jaw has carried what it holds, beyond what the organ itself has moved; world [m].
Vec3 jaw_travel(const Grasp& grasp, const InstrumentState& state, const Pose& organ);

}  // namespace viscera
