// What acts on an organ in a scene, and what of that its preparation depends on.
//
// A path is made of points, and a key frame that moves moves them all. So preparation doesn't look
// at points: it asks which parts of the surface they come near, and no closer than to bricks of a
// fixed grid. Cloud, compliance and cache key follow from bricks alone.
#pragma once

#include <vector>

#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

/// What acts on an organ, in the organ's frame: where instruments come along their paths (with how
/// far the tissue may have moved when they come by), where links pull at it, whether gravity does.
struct Reach {
  struct Attachment {
    Region region;  ///< world, with room for the spreading of the load
    Pose pose;      ///< of the organ in that world
  };
  /// Of an instrument on its path.
  struct Tip {
    Vec3 at = Vec3::Zero();  ///< [m]
    double radius = 0.0;  ///< its lowest places lie so far about it; of a jaw that closes, what it
                          ///< may then hold [m]
    bool closed = false;  ///< a jaw that carries what it holds
  };
  std::vector<Tip> tips;
  double radius = 0.0;    ///< of what a tool at a tip may touch [m]
  bool anywhere = false;  ///< a hand holds a tool of the scene: it may go where no path leads
  std::vector<Attachment> attachments;
  bool sags = false;  ///< under gravity that changes; places its whole body in reach of a force
  std::vector<int> moving_holds;  ///< indices of `fixed`, ascending
  Vec3 weight = Vec3::Zero();     ///< gravity in which it was imaged, organ frame [m/s2]
  bool stiffens = false;          ///< what coagulates becomes stiffer
  std::vector<Vec3> burns;        ///< where hooks pass with current [m]
  double burn_radius = 0.0;       ///< tissue within this distance of one may coagulate [m]
  std::vector<Tip> closings;      ///< where jaws close
  bool may_be_finite = false;     ///< it says auto, and nothing that can't be at finite strain
  bool strained_anywhere =
      false;  ///< what it is made of isn't linear, or a hand may hold it in a jaw

  bool covers(const Vec3& x) const;
  /// Something pulls at the organ in this region; world.
  void attach(const Region& region, const OrganDescription& organ);
};

/// Edge of the bricks [m]. Chosen: wide enough that a key frame which is moved a little seldom
/// comes to another brick, narrow enough that nodes stay where the tools are.
inline constexpr double kReachBrick = 20e-3;

/// A tip that goes deeper than this below the surface at rest asks for finite strain [m]. Chosen:
/// of the shipped scenes' organs, those that are pressed less deep answer linearly within 3.2 % of
/// what they do at finite strain.
inline constexpr double kDeepPush = 9e-3;

/// What preparation of an organ depends on: of a path no more than the bricks that it comes near.
struct BodyDemand {
  bool touched = false;  ///< some force on its surface is to be answered, wherever it acts
  bool sags = false;
  std::vector<int> moving_holds;  ///< indices of `fixed`, ascending
  Vec3 weight = Vec3::Zero();     ///< under which it was imaged; 0: it counts as weightless [m/s2]
  /// It can be at finite strain, and what acts on it would strain it beyond what linear tissue
  /// carries: a jaw, current, a tip that goes deep, gravity.
  bool strained = false;
  /// Vertices of the surface in any of these have nodes at the finest spacing: the organ's own
  /// `resolution.fine`, or bricks.
  std::vector<Region> fine;
  /// Tissue within `burn_depth` of vertices in any of these may coagulate; empty: none may.
  std::vector<Region> burnt;
  double burn_depth = 0.0;  ///< [m]

  /// What no force can reach needs no elasticity.
  bool elastic() const { return touched || sags || !moving_holds.empty(); }
};

/// Fails for a region of `resolution.fine` that holds no vertex of the surface.
Result<BodyDemand> demand_on(const OrganDescription& organ, const Tissue& tissue,
                             const Reach& reach, const TriangleSurface& surface);

/// What the organ answers by: what it says itself, or what auto makes of the demand.
Response response_of(const OrganDescription& organ, const BodyDemand& demand);

/// The vertices that lie in some of the regions.
std::vector<Vec3> vertices_in(const std::vector<Region>& regions, const TriangleSurface& surface);

}  // namespace viscera
