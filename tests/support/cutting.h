// Blades of tests.
#pragma once

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

}  // namespace viscera::test
