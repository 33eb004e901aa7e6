// Clips: two bars that squeeze what lies between them and stay there, carried by the tissue.
//
// A clip applier closes as a grasper does. The clip that it leaves is a body without weight that
// nobody holds: its bars come together at the speed of a hand, and with what they hold they move
// and turn so that the tissue's forces on them, and their moments, cancel. That is found within
// each frame's solve, as slipping jaws are (deformation.h).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/features/clips/clips_keys.h"
#include "engine/simulation/feature.h"

namespace viscera {

/// On an instrument that applies clips.
struct ClipApplier {
  static constexpr bool kConstant = true;
  ClipsDescription clips;
};

/// Where a clip is, in the organ's frame.
struct ClipPose {
  Vec3 centre = Vec3::Zero();    ///< midway between the bars [m]
  Mat3 axes = Mat3::Identity();  ///< columns: along the bars, from the lower to the upper, across
  static constexpr auto fields() {
    return std::tuple(field("centre", &ClipPose::centre), field("axes", &ClipPose::axes));
  }
};
static_assert(fields_cover<ClipPose>());

struct Clip {
  Entity organ;
  ClipPose pose;
  double open = 0.0;                  ///< between the bars as they met tissue [m]
  double apart = 0.0;                 ///< the bars now [m]
  double shut = 0.0;                  ///< the bars at last [m]
  double applied = 0.0;               ///< when [s]
  std::uint64_t upper = 0;            ///< cells on the upper bar
  std::vector<ContactCell> cells;     ///< of the upper bar, then of the lower; rest places
  std::vector<SurfacePoint> points;   ///< of the drawn surface, where they are
  std::vector<Vec3> arms;             ///< from the centre, by the axes [m]
  Mat3 axes_then = Mat3::Identity();  ///< as it was applied
  std::vector<Vec3> beside;  ///< TissueContact::beside_places, at rest; empty: not known yet [m]
  std::uint64_t first = 0;   ///< of the organ's cells, this frame
  // Within a frame: where it was in the last trial, with what pull, and how it moved on from there;
  // pull and motion as hold_clips.cpp has them.
  std::uint64_t trials = 0;
  ClipPose before;
  std::array<double, 6> pull{}, motion{};
  std::array<double, 36> learned{};  ///< by trials of its stiffness, beyond the tissue's response
  double squeeze = 0.0;              ///< of either bar [N]
  bool fell = false;                 ///< what it held is gone

  static constexpr auto fields() {
    using C = Clip;
    return std::tuple(
        field("organ", &C::organ), field("pose", &C::pose), field("open", &C::open),
        field("apart", &C::apart), field("shut", &C::shut), field("applied", &C::applied),
        field("upper", &C::upper), field("cells", &C::cells), field("points", &C::points),
        field("arms", &C::arms), field("axes_then", &C::axes_then), field("beside", &C::beside),
        field("first", &C::first), field("trials", &C::trials), field("before", &C::before),
        field("pull", &C::pull), field("motion", &C::motion), field("learned", &C::learned),
        field("squeeze", &C::squeeze), field("fell", &C::fell));
  }
  /// Its bars have come as near as they do, and squeeze.
  bool closed() const { return !fell && shut < open && apart <= shut && squeeze > 0.0; }
  /// Of either bar on the tissue [Pa].
  double pressure() const;
};
static_assert(fields_cover<Clip>());

/// The clips that an applier has left.
struct AppliedClips {
  static constexpr std::string_view kName = "clips";
  std::vector<Clip> clips;
  bool closed = false;  ///< the applier
  static constexpr auto fields() {
    using A = AppliedClips;
    return std::tuple(field("clips", &A::clips), field("closed", &A::closed));
  }
};
static_assert(fields_cover<AppliedClips>());

/// Visits all clips that were left, with what their applier says of them: (clip, ClipsDescription).
template <class AnyWorld, class Visit>
void each_clip(AnyWorld& world, const Visit& visit) {
  auto& all = world.template all<AppliedClips>();
  for (std::size_t i = 0; i < all.size(); ++i)
    for (auto& clip : all[i].clips)
      visit(clip, world.template find<ClipApplier>(all.owner(i))->clips);
}

/// End of clips' cells on an organ; 0: there are none.
std::size_t end_of_clip_cells(const World& world, Entity organ);

/// Before an organ's contact is solved: what clips learn goes by what they moved in that solve.
void begin_clips(World& world, Entity organ);
/// After an organ's contact was solved: moves and turns its clips as the answer asks, and their
/// cells. True: it must be solved again.
bool settle_clips(World& world, Entity organ);

/// Whether a duct is cut, and closed.
struct DuctFigures {
  Entity organ;
  std::string name;
  double pressure = 0.0;  ///< [Pa]
  bool cut = false;
  bool open = false;  ///< cut, and not closed towards an end that feeds it
};
std::vector<DuctFigures> duct_figures(const World& world);

Feature clips_feature();

}  // namespace viscera
