// Every component of the world: plain structs, grouped under what writes them. Split by access
// pattern: what only set-up writes is shared and constant, what a frame writes is a state.
#pragma once

#include <array>
#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/collision/collision_surface.h"
#include "engine/organ/organ_model.h"
#include "engine/registry.h"
#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "engine/systems/key_frames.h"
#include "haptics/hive_tissue.h"
#include "kernels/heat/coagulated_points.h"
#include "kernels/heat/electrode.h"
#include "kernels/points/surface_tree.h"
#include "kernels/smoke/gas_grid.h"
#include "kernels/smoke/smoke.h"
#include "kernels/smoke/smoke_optics.h"

namespace viscera {

// --- organs: written by set-up -------------------------------------------------------------------

struct OrganBody {
  std::string name;
  Tissue tissue;
  Pose pose;  ///< of its frame; the move stage rewrites it where it breathes
  std::shared_ptr<const OrganModel> model;
};

/// Organs that breathe.
struct OrganMotion {
  Pose pose;  ///< of the frame without the motion
  MotionDescription motion;
};

// --- organs: written by the gravity stage --------------------------------------------------------

/// How a change of gravity, and tissue that has shrunk, move an organ on which no other force acts.
struct OrganSag {
  Vec3 change = Vec3::Zero();   ///< of gravity since its rest shape, organ frame [m/s2]
  std::vector<float> shrunk;    ///< what shrinkage adds [m]; empty: nothing     (3 places)
  std::vector<float> places;    ///< displacements of the places of the surface [m]  (3 places)
  std::vector<Vec3f> vertices;  ///< and of the drawn surface [m]        (V)
  bool changed = false;         ///< in this frame

  bool moves() const { return !change.isZero(0.0) || !shrunk.empty(); }
};

/// Tissue that has coagulated, and how the organ's elasticity follows. Made when some has.
struct OrganChange {
  std::unique_ptr<CoagulationGauge> gauge;
  std::uint64_t seen = 0;                         ///< version of the heat that was last looked at
  std::vector<double> stiffness;                  ///< that the last update was made from  (points)
  std::shared_ptr<const StiffnessUpdate> update;  ///< in use; null: none yet
  std::future<StiffnessUpdate> next;              ///< being computed on a thread of its own
  std::uint64_t due = 0;  ///< frame from which on that is used, whenever it is ready
  int updates = 0;        ///< used so far
  double stiffened = 0.0, left_out = 0.0;  ///< at least half as stiff again; and not followed [m3]
};

// --- organs: written by the contact and deformation stages ---------------------------------------

/// One tool's cells in an organ's contact problem of this frame; all in the organ's frame.
struct CellRange {
  Entity instrument;
  std::size_t begin = 0, end = 0;
  bool held = false;
  Vec3 rest_centre = Vec3::Zero();   ///< tissue under the middle of the tool, at rest [m]
  Vec3 centre = Vec3::Zero();        ///< the same tissue, deformed, a frame ago [m]
  Vec3 outward = Vec3::UnitZ();      ///< unit, away from the tissue
  Vec3 force = Vec3::Zero();         ///< on the tissue, after the solve [N]
  Vec3 tip = Vec3::Zero();           ///< of the tool [m]
  Vec3 moved = Vec3::Zero();         ///< with friction: the tip, since tissue clung to it [m]
  double pitch = 0.0;                ///< between neighbouring cells [m]
  std::vector<SurfacePoint> points;  ///< of the cells
};

/// Tissue that clings to a tip with friction: which, and where it was, when contact was last
/// solved. Organ's frame.
struct Cling {
  struct Spot {
    SurfacePoint point;  ///< of the drawn surface
    Vec3 rest;           ///< the same at rest [m]
    Vec3 displacement;   ///< after what it slipped [m]
  };
  Entity instrument;
  Vec3 tip = Vec3::Zero();  ///< [m]
  double pitch = 0.0;       ///< between neighbouring spots [m]
  double followed = 1.0;    ///< share of the tip's last drag that the tissue followed
  std::vector<Spot> spots;  ///< cells that were pressed
};

struct OrganContact {
  std::unique_ptr<PatchContact> solver;       ///< null: nothing can touch this organ
  std::unique_ptr<CollisionSurface> surface;  ///< deformed, organ frame
  Box bounds;                                 ///< of the deformed surface, world [m]
  std::vector<ContactCell> cells;             ///< of this frame
  std::vector<CellRange> ranges;
  std::vector<Cling> clings;  ///< one a tool with friction that presses
  ContactSolution solution;
  ContactResponse response;
};

struct OrganState {
  std::vector<float> displacements;  ///< of the places of the surface [m]      (3 places)
  /// The GPU deformed it: displacements and normals stayed there, what stands here of them is of
  /// the shape at rest.
  bool on_gpu = false;
  std::vector<Vec3f> positions;  ///< drawn surface, organ frame [m]      (V)
  std::vector<Vec3f> normals;    ///< unit, of `positions` where they fit (V)
  /// Pictures ask for normals, most frames don't: make_view() makes those that don't fit.
  bool normals_fit = true;
  // What the frame is computing; takes the place of the above once it is seen to be finite.
  std::vector<float> next_displacements;
  std::vector<Vec3f> next_positions;
  std::uint64_t version = 0;           ///< raised when the shape changed
  bool deformed = false;               ///< differs from rest
  bool pressed = false;                ///< by forces: differs from its shape under gravity alone
  bool frozen = false;                 ///< a non-finite value was met: stays as it is
  double greatest_displacement = 0.0;  ///< of this frame [m]
};

/// An organ that hives about the tips answer for (LPAFF), in place of a contact with a model.
struct LocalOrgan {
  struct Touch {
    Entity instrument;
    std::unique_ptr<HiveTissue> tissue;
    Vec3 tip = Vec3::Zero();    ///< a frame ago [m]
    Vec3 force = Vec3::Zero();  ///< on the tissue, world [N]
    bool pressing = false;
  };
  std::shared_ptr<const WalkableSurface> walkable;
  std::unique_ptr<CollisionSurface> surface;  ///< deformed, organ frame
  std::vector<Touch> touches;                 ///< one an instrument
};

// --- links: written by set-up; springs, shift and forces by the contact and deformation stages ---

/// Springs between the surfaces of two organs.
struct Link {
  struct Spring {
    std::array<Vec3, 2> displacements{Vec3::Zero(),
                                      Vec3::Zero()};  ///< of its ends by deformation, world [m]
    Vec3 force = Vec3::Zero();  ///< on its first end, world; on the other its opposite [N]
  };
  std::string name;
  double softness = 0.0;       ///< of one spring [m/N]
  std::array<Entity, 2> ends;  ///< a stale one: the ground
  std::vector<Spring> springs;
  Vec3 shift = Vec3::Zero();  ///< of the second end's frame beyond the first's by breathing [m]
  double force = 0.0, greatest_force = 0.0;  ///< of all springs, now and so far [N]
};

/// The springs that end on an organ. Organs without elasticity have none: they don't yield.
struct OrganTies {
  struct Tie {
    std::size_t link = 0, spring = 0;
    int side = 0;               ///< which end of the link the organ is
    Entity other;               ///< organ that yields at the other end; a stale one: none does
    std::size_t other_tie = 0;  ///< the same spring among its ties
  };
  std::vector<Tie> ties;             ///< (n)
  std::vector<ContactCell> cells;    ///< organ's frame      (n)
  std::vector<SurfacePoint> points;  ///< of the drawn surface, where they are  (n)
  MatrixX behind;       ///< what the other ends yield under forces on these, world [m/N]  (3n x 3n)
  MatrixX backing;      ///< the same with the springs' own softness, organ's frame  (3n x 3n)
  bool loaded = false;  ///< in this frame: its group is touched, or moved by breathing or gravity
};

// --- organs: written by the heat stage -----------------------------------------------------------

/// Organs that a hook can burn. Until one does, nothing is kept or computed.
struct OrganBurn {
  std::shared_ptr<const SurfaceTree> surface;  ///< at rest
  Bioheat heat;                                ///< rest frame
  Entity hook;                                 ///< that burnt it last
  double smoke = 0.0;                          ///< given off so far [kg]
  double greatest_hot = 0.0;                   ///< volume above 60 C at its greatest [m3]
};

// --- instruments: written by set-up --------------------------------------------------------------

struct InstrumentBody {
  InstrumentDescription description;
  KeyFrames tip;                   ///< [m]
  KeyFrames jaw;                   ///< in x
  double extent = 0.0;             ///< of the working end around the tip [m]
  TriangleSurface mesh;            ///< of a mesh tip, else empty [m]
  std::vector<Vec3> mesh_samples;  ///< vertices near the tip, instrument frame [m]
  std::unique_ptr<CollisionSurface> mesh_surface;
};

// --- instruments: written by the tool stage ------------------------------------------------------

struct InstrumentState {
  Vec3 tip = Vec3::Zero();               ///< [m]
  Vec3 shaft_direction = Vec3::UnitZ();  ///< unit, from the tip towards the trocar
  Vec3 side_direction = Vec3::UnitX();   ///< unit, across the shaft, downwards
  double power = 0.0;                    ///< asked for [W]
  double jaw = 1.0;
};

// --- instruments: written by the contact stages --------------------------------------------------

/// A closed jaw that holds tissue.
struct Grasp {
  Entity organ;
  Vec3 tip_at_start = Vec3::Zero();    ///< world [m]
  Vec3 organ_at_start = Vec3::Zero();  ///< origin of the organ's frame then, world [m]
  Vec3 slipped = Vec3::Zero();         ///< how far the jaw has slid off so far, world [m]
  std::vector<ContactCell> cells;      ///< rest places; `displacement` at the start
  std::vector<SurfacePoint> points;    ///< of the drawn surface, where they are
};

struct InstrumentContact {
  Vec3 force = Vec3::Zero();  ///< on the instrument, from all organs [N]
  std::optional<Grasp> grasp;
  bool jaw_closed = false;
  bool touching = false;  ///< presses some tissue with more than zero force
  // Where the tip burns: the tissue under it.
  Entity organ;                       ///< touched most
  Vec3 rest_point = Vec3::Zero();     ///< organ rest frame [m]
  Vec3 world_point = Vec3::Zero();    ///< [m]
  Vec3 world_normal = Vec3::UnitZ();  ///< outward
  double strongest = 0.0;             ///< force on that organ [N]
};

/// A hook's metal, and the end of the trace that it burns, so that the next frame's heat continues
/// it.
struct BurnTrace {
  ElectrodeTip tip;
  Entity organ;              ///< that it is on, or sparks to; a stale one: none
  ElectrodeContact contact;  ///< there
  CurrentReport current;     ///< of this frame
  double generated = 0.0;    ///< by its generator so far [J]
};

// --- smoke volumes -------------------------------------------------------------------------------

/// What feeds a volume.
struct SmokeEmitter {
  EmitterDescription description;
  Entity instrument;            ///< a hook that burns; a stale one: a place
  double particles_owed = 0.0;  ///< carried to the next frame with
  double mass_owed = 0.0;       ///< this mass [kg]
};

struct SmokeBody {
  SmokeDescription description;
  SmokeVolume volume;
  bool takes_any_hook = false;  ///< its description names no emitters
  std::vector<SmokeEmitter> emitters;
  std::size_t most_particles = 0;
  SmokeGrid grid;  ///< of the last picture
  // With it, where particles are drawn as sprites:
  std::vector<Vec3f> particle_places;  ///< from the domain's least corner [m]  (n)
  std::vector<float> particle_radii;   ///< [m]  (n)
};

// --- gas: one flow for all smoke volumes ---------------------------------------------------------

struct GasBody {
  struct Solid {
    Entity organ;
    Pose pose;  ///< where its cells were marked last
  };
  struct Evacuator {
    EvacuatorDescription description;
    Entity instrument;  ///< draws at its tip; a stale one: at its place
  };
  GasDescription description;
  std::optional<GasGrid> grid;  ///< none: the gas stands still
  std::vector<Evacuator> evacuators;
  std::vector<Solid> solids;  ///< empty until smoke is first there
  double leak_flow = 0.0;     ///< out through all leaks [m3/s]
};

/// What smoke meets.
struct SmokeScenery {
  /// By the drawn surface that instances share.
  std::map<const TriangleSurface*, std::unique_ptr<SurfaceTopology>> topologies;
  std::vector<SmokeObstacle> tools;  ///< of the last frame
};

}  // namespace viscera
