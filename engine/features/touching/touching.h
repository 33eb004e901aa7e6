// Organs touch organs: where two surfaces meet, patches of both press each other, and all bodies
// that hang together so are solved as one (kernels/contact/contact_island.h), links between them
// too.
//
// The organ with the finer nodes brings the patches, always the same ones; each meets the place of
// the other's surface that is nearest to it, and keeps that until it has slid off it. Both bring
// places of their sharp edges besides, which may come down between patches (edge_samples.h). So the
// response of both is put together when patches come or go, not in every frame. What overlaps where
// organs lie at rest is kept, and reported.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/features/touching/meeting_samples.h"
#include "engine/features/touching/touching_keys.h"
#include "engine/simulation/feature.h"
#include "kernels/contact/contact_island.h"

namespace viscera {

/// Patches of an organ that may meet others.
struct OrganPatches {
  static constexpr bool kConstant = true;
  std::vector<SurfacePatch> patches;
};

/// Two organs that may meet, or one that may meet itself (folds.h, cut_bodies.h); one component a
/// pair, on an entity of its own. Two whose edges are sharp have one more for each, with
/// EdgeSamples.
struct OrganPair {
  static constexpr bool kConstant = true;
  std::array<Entity, 2> organs;   ///< the first brings its patches
  std::vector<float> overlaps;    ///< of each of these at rest, with the other [m]   (patches)
  double greatest_overlap = 0.0;  ///< [m]
  bool folds() const { return organs[0] == organs[1]; }
  /// Indices of its organs, the lower first.
  std::array<std::uint32_t, 2> between() const {
    return {std::min(organs[0].index, organs[1].index), std::max(organs[0].index, organs[1].index)};
  }
};

/// Of an organ that never deforms: where others meet it, organ frame.
struct StillSurface {
  std::unique_ptr<CollisionSurface> surface;
};

/// Where a patch of a pair's first organ meets its second.
struct Meeting {
  std::uint32_t patch = 0;    ///< of the first
  SurfacePatch on;            ///< of the second
  Vec3 force = Vec3::Zero();  ///< on the first, world [N]
  Vec3 cling = Vec3::Zero();  ///< motion of the first beyond the second where they cling [m]
  static constexpr auto fields() {
    using M = Meeting;
    return std::tuple(field("patch", &M::patch), field("on", &M::on), field("force", &M::force),
                      field("cling", &M::cling));
  }
};
static_assert(fields_cover<Meeting>());

struct PairState {
  static constexpr std::string_view kName = "organs that touch";
  std::vector<Meeting> meetings;  ///< by patch
  /// From what the first organ brings to the second, as the frame began; the search's reach where
  /// that is farther [m]; empty: nothing moved.                                       (patches)
  std::vector<float> gaps;
  Vec3 apart_at_rest = Vec3::Zero();  ///< apart() as both came to rest [m]
  static constexpr auto fields() {
    return std::tuple(field("meetings", &PairState::meetings), field("gaps", &PairState::gaps),
                      field("apart_at_rest", &PairState::apart_at_rest));
  }
};
static_assert(fields_cover<PairState>());

/// A pair's part of this frame's contact problem.
struct PairJoints {
  std::vector<Vec3> normals;   ///< unit, out of the second organ, world        (meetings)
  std::vector<double> depths;  ///< Joint::depth [m]                            (meetings)
  std::array<std::size_t, 2> first_cells{};  ///< of its meetings in both organs' cells
};

/// Of an organ that is in a pair: whether its island's solve answered for it in this frame.
struct InIsland {
  bool solved = false;
};
/// Work arrays.
struct IslandWork {
  ContactIsland solver;
};

/// How it went so far.
struct TouchingFigures {
  static constexpr std::string_view kName = "touching figures";
  std::uint64_t solves = 0;  ///< of islands
  std::uint64_t failed = 0;  ///< islands without an answer
  std::uint64_t most_rows = 0, most_islands = 0, most_pairs = 0;
  std::uint64_t most_resting = 0;  ///< organs at once
  double residual = 0.0;           ///< greatest, with friction, over the greatest force
  double greatest_overlap = 0.0;   ///< beyond that at rest [m]
  double greatest_force = 0.0;     ///< of a pair [N]
  static constexpr auto fields() {
    using F = TouchingFigures;
    return std::tuple(field("solves", &F::solves), field("failed", &F::failed),
                      field("most_rows", &F::most_rows), field("most_islands", &F::most_islands),
                      field("most_pairs", &F::most_pairs), field("most_resting", &F::most_resting),
                      field("residual", &F::residual),
                      field("greatest_overlap", &F::greatest_overlap),
                      field("greatest_force", &F::greatest_force));
  }
};
static_assert(fields_cover<TouchingFigures>());

/// What has moved less than this from where it lies at rest hasn't come to anything: a hundredth of
/// what a tip presses [m].
inline constexpr double kUnmoved = 20e-6;

/// How far the frames of two organs have gone from where they stood as the scene began, the first
/// from the second [m].
Vec3 apart(const World& world, const std::array<Entity, 2>& organs);
/// Whether it gives way: deformable, prepared, and sound so far.
bool yields(const World& world, Entity organ);
/// Pairs of organs that may meet, and organs that may meet themselves.
std::size_t count_pairs(const World& world);
/// How deep each patch lies in the other organ, both at rest at these poses [m]; `finder` finds on
/// the other; `facing`: only where they face it.                                      (patches)
std::vector<float> overlaps_of(const Pose& pose, std::span<const SurfacePatch> patches,
                               const OrganModel& other, const Pose& other_pose,
                               const CollisionSurface& finder, bool facing = true);

/// The patches of an organ of this scene.
std::vector<SurfacePatch> patches_on(const OrganModel& model, const CollisionSurface& finder,
                                     const TouchingDescription& touching);

/// Surfaces, poses -> PairState, PairJoints, the meetings' cells in OrganContact.cells: behind
/// those of the tools.
void meet_organs(World& world, const FrameContext& context);

std::vector<ReportSection> touching_report(const World& world);  ///< "contact"

Feature touching_feature();

}  // namespace viscera
