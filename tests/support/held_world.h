// A small world whose held tools are in hands.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "engine/features/held_tools/held_tools.h"
#include "tests/support/small_world.h"

namespace viscera::test {

/// A test failure, and null, where it can't be built.
inline std::unique_ptr<World> in_hand(const SceneDescription& scene, const ServoRun& run = {}) {
  auto world = build(scene);
  if (!world) return nullptr;
  if (const auto hand = hold_tools(*world, run); !hand) {
    ADD_FAILURE() << hand.error().text();
    return nullptr;
  }
  return world;
}

}  // namespace viscera::test
