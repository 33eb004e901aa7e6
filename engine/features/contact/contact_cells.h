// From a tool over a surface to the cells of a contact problem.
//
// The cells hang on the tool, not on the tissue: a hexagonal pattern around the tip, each cell's
// ray finding the tissue that lies under it. Whatever the tool slides over, the pattern under it is
// the same, so the force has no texture of nodes, triangles or cells.
//
// Without friction the tissue is sought as it would be without the tool's dent, and the pattern is
// as wide as the tool is deep: cells, and so forces, are a function of the tool's place once it
// stands still (tissue_as_met.h). What clings to a
// tool with friction has been dragged by it, and is sought as it is drawn.
//
// Each cell pushes along the tool's own normal, on tissue and tool alike: there the pressure acts
// where nothing rubs, along the normal that the two surfaces have in common.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/features/contact/foot.h"

namespace viscera {

/// Tools nearer than this to tissue enter its contact problem [m].
inline constexpr double kContactMargin = 1.0e-3;

/// What rubs between a tool and an organ.
struct Rubbing {
  double friction = 0.0;
  const Cling* cling = nullptr;  ///< of the last frame; null: nothing clung to the tool
  Vec3 undrawn = Vec3::Zero();   ///< undrawn_drag(*cling, ...) [m]
};

/// How much farther than the drawn surface shows the tissue of `cling` moved, in the mean [m]: what
/// is finer than nodes is drawn along the normal alone.
Vec3 undrawn_drag(const Cling& cling, const OrganState& state, const OrganModel& model);

/// Appends the cells that the tool presses and fills `range`; false when there are none. `foot` and
/// both surfaces as for find_foot_as_met.
bool press_cells(const ToolShape& tool, const Foot& foot, const Rubbing& rubbing,
                 const OrganModel& model, const TissueSheet& drawn, const TissueSheet& met,
                 std::vector<ContactCell>& cells, CellRange& range);

/// Of a tool with friction: the displacement that keeps tissue clinging to it, had it not slipped.
/// `rest`: of the cell; `own`: what moved the tissue there so far, which holds where nothing has
/// clung; `moved`: the tool there, since the last frame [m].
Vec3 clinging_displacement(const Cling* cling, const Vec3& rest, const Vec3& own,
                           const Vec3& moved);
/// Puts a clinging cell's displacement onto the tool's surface. `up`: out of the tissue.
void put_on_tool(const Vec3& up, ContactCell& cell);

/// What clings to the tool of `range` after `solution` of `cells`; no spots: nothing. `last` as in
/// Rubbing.
Cling clinging_tissue(const CellRange& range, const std::vector<ContactCell>& cells,
                      const ContactSolution& solution, const Cling* last);

/// The cells that a jaw closing at `foot` holds, each with its displacement at this moment;
/// `points` of the `drawn` surface is where they are.
std::vector<ContactCell> grasp_cells(const Foot& foot, double radius, const OrganModel& model,
                                     const TissueContact& tissue, const TissueSheet& drawn,
                                     std::vector<SurfacePoint>& points);

/// ContactCell::free of cells at these points of the surface.
void let_move(const FreeShape& shape, const TriangleSurface& surface,
              std::span<const SurfacePoint> points, std::span<ContactCell> cells);

/// How far a jaw has carried what it holds, beyond what the organ itself has moved; world [m].
Vec3 jaw_travel(const Grasp& grasp, const InstrumentState& state, const Pose& organ);

}  // namespace viscera
