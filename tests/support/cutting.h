// Blades of tests.
#pragma once

#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/parting/parting_keys.h"
#include "tests/support/small_world.h"

namespace viscera::test {

/// A scalpel that stands upright, its trocar so far above that it hardly leans. It waits where it
/// begins, goes straight to the end within the time between, and stays there.
inline InstrumentDescription upright_scalpel(const Vec3& from, const Vec3& to, double begins,
                                             double ends, const BladeDescription& blade) {
  InstrumentDescription scalpel =
      straight_tool("scalpel", InstrumentKind::kScalpel, 0.5e-3,
                    {{0.0, from, 0.0, 1.0}, {begins, from, 0.0, 1.0}, {ends, to, 0.0, 1.0}});
  scalpel.trocar = Vec3(from.x(), 0.0, 20.0);
  scalpel.extras.set(blade);
  return scalpel;
}

inline const Vec3 kBarToSever(36e-3, 16e-3, 16e-3);  ///< about the origin, held at its left end [m]
inline constexpr double kSweptBy = 0.2;              ///< a blade is through it by then [s]

/// A blade along `along` is drawn through that bar along y, its middle at this place of x and z.
inline SceneDescription bar_to_sever(const Vec3& along, const Vec3& through) {
  SceneDescription scene = held_bar_scene(kBarToSever, 2e-3, 0.1e-3, 4.2e-3, 4.2e-3);
  scene.organs[0].response = Response::kFinite;
  scene.organs[0].extras.set(CuttableDescription{0.4e-3});
  scene.extras.set(GravityDescription{});
  constexpr double kLength = 44e-3, kSide = 13e-3;
  const Vec3 tip = through - 0.5 * kLength * along;
  InstrumentDescription scalpel = straight_tool(
      "scalpel", InstrumentKind::kScalpel, 0.5e-3,
      {{0.0, tip + Vec3(0, kSide, 0), 0.0, 1.0}, {kSweptBy, tip - Vec3(0, kSide, 0), 0.0, 1.0}});
  scalpel.trocar = 20.0 * along;
  scalpel.extras.set(BladeDescription{kLength, 0.8e-3});
  scene.instruments = {scalpel};
  return scene;
}

}  // namespace viscera::test
