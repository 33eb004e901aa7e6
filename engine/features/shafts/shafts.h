// Shafts touch organs, and each other (press_tools.h): the round part of each instrument between
// its working end and its trocar, and the endoscope's barrel. A shaft presses along lines of
// contact (shaft_cells.h), and its force reaches the hand by the lever about the trocar (lever.h).
//
// A shaft's cells are none of the tip's: no CellRange names them, so nothing burns, grasps or
// stands a hand's hive by them. They lie behind those of tips in an organ's contact problem.
#pragma once

#include <string>
#include <vector>

#include "engine/features/contact/frame_feel.h"
#include "engine/features/shafts/lever.h"
#include "engine/features/shafts/shafts_flags.h"
#include "engine/features/shafts/shafts_keys.h"
#include "engine/features/shafts/stretches.h"
#include "engine/simulation/feature.h"
#include "engine/simulation/key_frames.h"

namespace viscera {

/// Of an instrument; the endoscope's is on an entity of its own.
struct Shaft {
  static constexpr bool kConstant = true;
  /// An organ that it doesn't touch, since it is in it as the scene begins.
  struct Spared {
    Entity organ;
    double depth = 0.0;         ///< how deep it begins in it [m]
    bool holds_trocar = false;  ///< the trocar lies in it
  };
  std::string name;
  double radius = 0.0;    ///< [m]
  double friction = 0.0;  ///< Coulomb's coefficient
  std::vector<Spared> spared;
};

/// Where the endoscope is.
struct EndoscopeBarrel {
  static constexpr bool kConstant = true;
  KeyFrames tip, target;  ///< the lens, and what its axis points at [m]
};

/// A shaft near an organ.
struct ShaftMeeting {
  Entity organ;
  ShaftAxis axis;  ///< as the last step had it, organ's frame
  std::vector<ShaftStretch> stretches;
  Cling cling;                ///< with friction; no spots: nothing clings
  Vec3 force = Vec3::Zero();  ///< on the shaft, world [N]
  static constexpr auto fields() {
    using M = ShaftMeeting;
    return std::tuple(field("organ", &M::organ), field("axis", &M::axis),
                      field("stretches", &M::stretches), field("cling", &M::cling),
                      field("force", &M::force));
  }
};
static_assert(fields_cover<ShaftMeeting>());

/// The greatest so far.
struct ShaftFigures {
  double force = 0.0;          ///< on all of the shaft [N]
  double at_tip = 0.0;         ///< what of it the hand feels [N]
  double reaction = 0.0;       ///< of the trocar [N]
  double torque = 0.0;         ///< about the trocar [N m]
  double length = 0.0;         ///< pressed [m]
  double overlap = 0.0;        ///< how deep the drawn surface lay in it [m]
  std::uint64_t cells = 0;     ///< on one organ
  std::vector<double> organs;  ///< force of each organ, in the scene's order [N]
  std::vector<double> tools;   ///< of each shaft, in their pool's order [N]
  double crossed = 0.0;        ///< how deep it lay in another [m]
  static constexpr auto fields() {
    using F = ShaftFigures;
    return std::tuple(field("force", &F::force), field("at_tip", &F::at_tip),
                      field("reaction", &F::reaction), field("torque", &F::torque),
                      field("length", &F::length), field("overlap", &F::overlap),
                      field("cells", &F::cells), field("organs", &F::organs),
                      field("tools", &F::tools), field("crossed", &F::crossed));
  }
};
static_assert(fields_cover<ShaftFigures>());

struct ShaftState {
  static constexpr std::string_view kName = "shafts";
  /// On which side of another that it crosses it is: 1, that of the product of both directions.
  struct Side {
    Entity other;
    double side = 1.0;
    static constexpr auto fields() {
      return std::tuple(field("other", &Side::other), field("side", &Side::side));
    }
  };
  ShaftAxis axis;                      ///< of this step; world
  std::vector<ShaftMeeting> meetings;  ///< by organ
  ShaftLoad load;                      ///< of all of them
  LeverForces lever;                   ///< none of the endoscope's
  Mat3 stiffness = Mat3::Zero();       ///< of a held tool: by how much lever.at_tip falls [N/m]
  std::vector<Side> sides;             ///< of those behind it in the pool
  ShaftFigures greatest;
  static constexpr auto fields() {
    using S = ShaftState;
    return std::tuple(field("axis", &S::axis), field("meetings", &S::meetings),
                      field("load", &S::load), field("lever", &S::lever),
                      field("stiffness", &S::stiffness), field("sides", &S::sides),
                      field("greatest", &S::greatest));
  }
};
static_assert(fields_cover<ShaftState>());

/// Where it is at the end of the step that ends at `time` [s], tools being placed; world.
ShaftAxis axis_of_shaft(const World& world, Entity shaft, double time);

/// Poses, surfaces -> ShaftState, its cells in OrganContact.cells: behind those of the tips.
void meet_shafts(World& world, const FrameContext& context);
/// Forces on cells -> ShaftState, InstrumentContact::force.
void feel_shafts(World& world, const FrameContext& context);

/// End of the cells that shafts press on this organ in this frame; 0: none do.
std::size_t end_of_shaft_cells(const World& world, Entity organ);
/// Of all shafts on this organ, in size [N].
double force_of_shafts(const World& world, Entity organ);

std::vector<ReportSection> shafts_report(const World& world);  ///< "shafts"

Feature shafts_feature();

}  // namespace viscera
