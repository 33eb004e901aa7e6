// A body and tools in a world of their own, without files: for tests of contact and stages.
#pragma once

#include <iosfwd>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/scene/soft_ball.h"
#include "engine/simulation/frame.h"
#include "engine/simulation/world.h"
#include "engine/simulator/simulation.h"

namespace viscera {

/// For messages of tests.
void PrintTo(const FlagSet& flags, std::ostream* out);

}  // namespace viscera

namespace viscera::test {

/// A tool whose tip follows straight lines between `keys`; trocar 200 mm above.
InstrumentDescription straight_tool(const std::string& name, InstrumentKind kind, double radius,
                                    std::vector<InstrumentKey> keys);

/// A block about the origin: edges `size` [m] with rounding `edge` [m].
RecipeGeometry block_geometry(const Vec3& size, double edge);

/// A bar along x about the origin, held on `held` [m] at its left end: edges `size` [m] with
/// rounding `edge` [m], nodes `spacing` apart, `finest` where instruments reach [m].
SceneDescription held_bar_scene(const Vec3& size, double edge, double held, double spacing,
                                double finest);

/// A ball as a region: of a fine part.
Region ball_region(const Vec3& centre, double radius);

/// Tissues "rubber" (10 kPa, 0.45): what soft_ball_scene() uses. Heat finds it to be like liver.
std::map<std::string, Tissue> test_tissues();

/// Builds the world without any cache; a test failure when it can't be built.
std::unique_ptr<World> build(const SceneDescription& scene);

/// The same as a model, which several simulations may share.
Model build_shared(const SceneDescription& scene);

/// Names tests by the response that is their parameter.
inline constexpr auto kByResponse = [](const auto& info) {
  return std::string(info.param == Response::kLinear ? "Linear" : "Finite");
};

/// Steps until the world's time reaches `time` [s]; all flags raised on the way.
FlagSet step_until(World& world, double time);

/// But for the one that says how far linear tissue is strained: tests press and lift it far.
FlagSet but_for_strain(const FlagSet& flags);

/// Force on the i-th instrument now [N].
Vec3 force_on(const World& world, std::size_t instrument);

}  // namespace viscera::test
