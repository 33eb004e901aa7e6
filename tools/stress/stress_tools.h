// Random tools for `viscera stress`, and the cells they make of a body's surface.
#pragma once

#include <span>
#include <vector>

#include "engine/collision/collision_surface.h"
#include "kernels/contact/patch_contact.h"
#include "tools/stress/stress_cases.h"

namespace viscera {

/// A ball tip that presses, or a jaw that holds: a hexagonal pattern of cells about its foot, as
/// the engine lays it (engine/features/contact/contact_cells.cpp).
struct StressTool {
  bool held = false;
  std::vector<ContactCell>
      cells;                    ///< at rest: pressed ones with the tip's lowest point on its foot
  double greatest_depth = 0.0;  ///< up to half the organ's thickness [m]
  Vec3 pull = Vec3::Zero();     ///< held: the displacement at the path's far end [m]
  bool with_last = false;       ///< stands where the tool before stands, and moves with it
  std::string place;            ///< "at vertex 12"

  /// The cells with the tip advanced by this share of its depth (negative: clear of the tissue);
  /// a jaw's moved by `share` of its pull, turned by the angle about the outward direction [rad].
  void add_cells(double share, double angle, std::vector<ContactCell>& cells) const;
  /// How far a tip has to be drawn back from its foot until none of its cells touches [m]: on a
  /// bent surface some do before its lowest point.
  double clearance() const;
};

/// What tools are laid on.
struct StressSurface {
  explicit StressSurface(const StressBody& body);
  const StressBody& body;
  std::vector<Vec3> normals;  ///< of vertices
  CollisionSurface search;
};

/// A tool whose foot is the place of the surface nearest to `place`, its cells where the engine
/// lays them (contact_cells.cpp): its direction the mean normal about it, cells sought along that.
/// It may find none: a ridge may have nothing straight under its foot.
StressTool tool_at(const StressSurface& surface, const Vec3& place, double radius, int rings,
                   bool held);

/// One to three tools: inside triangles, exactly on vertices and on edges, or exactly where the one
/// before stands (then of its kind: a jaw can't hold still what a tip presses in at one place).
/// Each has cells. None, where nothing may be touched or no foot had anything under it.
std::vector<StressTool> random_tools(const StressSurface& surface, Draws& draws);

}  // namespace viscera
