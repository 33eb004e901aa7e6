// The components that every scene with organs and tools has: bodies, poses, shapes, contact. Those
// of a feature stand in its room (engine/features/NAME). Each type says what it is (store.h):
// constant, state with a table of fields, or runtime.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/collision/collision_surface.h"
#include "engine/organ/organ_model.h"
#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "engine/simulation/key_frames.h"
#include "engine/simulation/store.h"
#include "kernels/contact/patch_contact.h"

namespace viscera {

// --- organs -------------------------------------------------------------------------------------

/// Each world has its own: `model` becomes another one where the organ is cut (World::replace).
struct OrganBody {
  static constexpr bool kConstant = true;
  std::string name;
  Tissue tissue;
  std::shared_ptr<const OrganModel> model;
};

/// Where an organ's frame stands.
struct OrganPose {
  static constexpr std::string_view kName = "organ poses";
  Pose pose;
  static constexpr auto fields() { return std::tuple(field("pose", &OrganPose::pose)); }
};
static_assert(fields_cover<OrganPose>());

/// The drawn and touched shape.
struct OrganState {
  static constexpr std::string_view kName = "organ shapes";
  std::vector<float> displacements;    ///< of the places of the surface [m]      (3 places)
  std::vector<Vec3f> positions;        ///< drawn surface, organ frame [m]      (V)
  std::vector<Vec3f> normals;          ///< unit, of `positions` where they fit (V)
  std::uint64_t version = 0;           ///< raised when the shape changed
  double greatest_displacement = 0.0;  ///< of this frame [m]
  /// Normals are those of `positions`. Pictures ask for them, most frames don't.
  bool normals_fit = true;
  bool deformed = false;  ///< differs from rest
  bool pressed = false;   ///< by forces: differs from its shape without any
  bool frozen = false;    ///< a non-finite value was met: stays as it is
  /// The GPU deformed it: displacements and normals stayed there, what stands here of them is of
  /// the shape at rest.
  bool on_gpu = false;

  static constexpr auto fields() {
    using S = OrganState;
    return std::tuple(field("displacements", &S::displacements), field("positions", &S::positions),
                      field("normals", &S::normals), field("version", &S::version),
                      field("greatest_displacement", &S::greatest_displacement),
                      field("normals_fit", &S::normals_fit), field("deformed", &S::deformed),
                      field("pressed", &S::pressed), field("frozen", &S::frozen),
                      field("on_gpu", &S::on_gpu));
  }
};
static_assert(fields_cover<OrganState>());

/// What a frame is computing; takes the place of the organ's state once it is seen to be finite.
struct OrganDraft {
  std::vector<float> displacements;
  std::vector<Vec3f> positions;
};

/// The shape that an organ takes without forces, where that isn't its rest shape: gravity,
/// shrinkage, a pulse. Whoever changes its part of it sets `stale`; *shape organs* adds all parts
/// up.
struct FreeShape {
  static constexpr std::string_view kName = "free shapes";
  std::vector<float> places;    ///< displacements of the places of the surface [m]  (3 places)
  std::vector<Vec3f> vertices;  ///< and of the drawn surface [m]        (V)
  bool moves = false;           ///< something is in `places`
  bool changed = false;         ///< in this frame
  bool stale = false;           ///< some part has changed since they were added up
  static constexpr auto fields() {
    using S = FreeShape;
    return std::tuple(field("places", &S::places), field("vertices", &S::vertices),
                      field("moves", &S::moves), field("changed", &S::changed),
                      field("stale", &S::stale));
  }
};
static_assert(fields_cover<FreeShape>());
/// Of an organ that nothing moves.
FreeShape level_shape(const OrganModel& model);
/// Adds `by` times displacements per unit along x, y and z, one after another (3 x rows), to
/// `places` (rows).
void add_along_axes(std::span<const float> displacements, const Vec3& by,
                    std::vector<float>& places);

// --- contact ------------------------------------------------------------------------------------

/// One tool's cells in an organ's contact problem of this frame; all in the organ's frame.
struct CellRange {
  Entity instrument;
  std::uint64_t begin = 0, end = 0;
  Vec3 rest_centre = Vec3::Zero();  ///< tissue under the middle of the tool, at rest [m]
  Vec3 centre = Vec3::Zero();       ///< the same tissue, deformed, a frame ago [m]
  Vec3 outward = Vec3::UnitZ();     ///< unit, away from the tissue
  Vec3 force = Vec3::Zero();        ///< on the tissue, after the solve [N]
  Vec3 felt = Vec3::Zero();         ///< the same as the hand felt it; else as `force` [N]
  Vec3 tip = Vec3::Zero();          ///< of the tool [m]
  Vec3 moved = Vec3::Zero();        ///< with friction: the tip, since tissue clung to it [m]
  /// Pressed: what others have moved the tissue there from its rest, and this tool aside.
  Pose met;
  Vec3 met_way = Vec3::Zero();       ///< of its position within the last frame [m]
  double met_share = 1.0;            ///< of the way to where it was found, gone in that frame
  double pitch = 0.0;                ///< between neighbouring cells [m]
  std::vector<SurfacePoint> points;  ///< of the cells
  bool held = false;
  static constexpr auto fields() {
    using S = CellRange;
    return std::tuple(
        field("instrument", &S::instrument), field("begin", &S::begin), field("end", &S::end),
        field("rest_centre", &S::rest_centre), field("centre", &S::centre),
        field("outward", &S::outward), field("force", &S::force), field("felt", &S::felt),
        field("tip", &S::tip), field("moved", &S::moved), field("met", &S::met),
        field("met_way", &S::met_way), field("met_share", &S::met_share), field("pitch", &S::pitch),
        field("points", &S::points), field("held", &S::held));
  }
};
static_assert(fields_cover<CellRange>());

/// Tissue that clings to a tip with friction: which, and where it was, when contact was last
/// solved. Organ's frame.
struct Cling {
  struct Spot {
    SurfacePoint point;  ///< of the drawn surface
    Vec3 rest;           ///< the same at rest [m]
    Vec3 displacement;   ///< after what it slipped [m]
    static constexpr auto fields() {
      return std::tuple(field("point", &Spot::point), field("rest", &Spot::rest),
                        field("displacement", &Spot::displacement));
    }
  };
  Entity instrument;
  Vec3 tip = Vec3::Zero();  ///< [m]
  double pitch = 0.0;       ///< between neighbouring spots [m]
  double followed = 1.0;    ///< share of the tip's last drag that the tissue followed
  std::vector<Spot> spots;  ///< cells that were pressed
  static constexpr auto fields() {
    using S = Cling;
    return std::tuple(field("instrument", &S::instrument), field("tip", &S::tip),
                      field("pitch", &S::pitch), field("followed", &S::followed),
                      field("spots", &S::spots));
  }
};
static_assert(fields_cover<Cling::Spot>() && fields_cover<Cling>());

/// What an organ's contact remembers from frame to frame.
struct OrganTouch {
  static constexpr std::string_view kName = "organ contacts";
  std::unique_ptr<TissueContact> solver;
  Box bounds;  ///< of the deformed surface, world [m]
  std::vector<CellRange> ranges;
  std::vector<Cling> clings;  ///< one a tool with friction that presses
  static constexpr auto fields() {
    using S = OrganTouch;
    return std::tuple(field("solver", &S::solver), field("bounds", &S::bounds),
                      field("ranges", &S::ranges), field("clings", &S::clings));
  }
};

/// Contact of this frame, and the surface that is sought. None: nothing can touch the organ.
struct OrganContact {
  std::unique_ptr<CollisionSurface> surface;  ///< deformed, organ frame
  std::unique_ptr<CollisionSurface> rest;     ///< the same at rest; never changes
  std::vector<ContactCell> cells;             ///< of tools, then of what else holds the organ
  std::vector<SurfacePoint> held_points;      ///< of those latter, on the drawn surface
  ContactSolution solution;
  ContactResponse response;
};

// --- instruments --------------------------------------------------------------------------------

struct InstrumentBody {
  static constexpr bool kConstant = true;
  InstrumentDescription description;
  KeyFrames tip;                   ///< [m]
  KeyFrames jaw;                   ///< in x
  double extent = 0.0;             ///< of the working end around the tip [m]
  TriangleSurface mesh;            ///< of a mesh tip, else empty [m]
  std::vector<Vec3> mesh_samples;  ///< vertices near the tip, instrument frame [m]
  std::shared_ptr<const CollisionSurface> mesh_surface;
};

struct InstrumentState {
  static constexpr std::string_view kName = "tool poses";
  Vec3 tip = Vec3::Zero();               ///< [m]
  Vec3 shaft_direction = Vec3::UnitZ();  ///< unit, from the tip towards the trocar
  Vec3 side_direction = Vec3::UnitX();   ///< unit, across the shaft, downwards
  double power = 0.0;                    ///< asked for [W]
  double jaw = 1.0;
  bool blade = false;  ///< asked for: the trigger of a knife between its jaws
  static constexpr auto fields() {
    using S = InstrumentState;
    return std::tuple(field("tip", &S::tip), field("shaft_direction", &S::shaft_direction),
                      field("side_direction", &S::side_direction), field("power", &S::power),
                      field("jaw", &S::jaw), field("blade", &S::blade));
  }
};
static_assert(fields_cover<InstrumentState>());

/// On an instrument whose tip a servo moves, not its path.
struct HeldTip {};

/// A closed jaw that holds tissue.
struct Grasp {
  Entity organ;
  Vec3 tip_at_start = Vec3::Zero();    ///< world [m]
  Vec3 organ_at_start = Vec3::Zero();  ///< origin of the organ's frame then, world [m]
  Vec3 slipped = Vec3::Zero();         ///< how far the jaw has slid off so far, world [m]
  std::vector<ContactCell> cells;      ///< rest places; `displacement` at the start
  std::vector<SurfacePoint> points;    ///< of the drawn surface, where they are
  static constexpr auto fields() {
    using S = Grasp;
    return std::tuple(field("organ", &S::organ), field("tip_at_start", &S::tip_at_start),
                      field("organ_at_start", &S::organ_at_start), field("slipped", &S::slipped),
                      field("cells", &S::cells), field("points", &S::points));
  }
};
static_assert(fields_cover<Grasp>());

struct InstrumentContact {
  static constexpr std::string_view kName = "tool forces";
  Vec3 force = Vec3::Zero();  ///< on the instrument, from all organs [N]
  std::optional<Grasp> grasp;
  // Where the tip burns: the tissue under it.
  Entity organ;                       ///< touched most
  Vec3 rest_point = Vec3::Zero();     ///< organ rest frame [m]
  Vec3 world_point = Vec3::Zero();    ///< [m]
  Vec3 world_normal = Vec3::UnitZ();  ///< outward
  double strongest = 0.0;             ///< force on that organ [N]
  bool jaw_closed = false;
  bool touching = false;  ///< presses some tissue with more than zero force
  static constexpr auto fields() {
    using S = InstrumentContact;
    return std::tuple(field("force", &S::force), field("grasp", &S::grasp),
                      field("organ", &S::organ), field("rest_point", &S::rest_point),
                      field("world_point", &S::world_point),
                      field("world_normal", &S::world_normal), field("strongest", &S::strongest),
                      field("jaw_closed", &S::jaw_closed), field("touching", &S::touching));
  }
};
static_assert(fields_cover<InstrumentContact>());

}  // namespace viscera
