// A shipped scene as a world, without any cache.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/features/features.h"
#include "engine/scene/load_scene.h"
#include "engine/scene/tissues.h"
#include "engine/simulator/build.h"
#include "tests/support/paths.h"

namespace viscera::test {

struct ShippedWorld {
  SceneDescription scene;
  std::unique_ptr<World> world;  ///< null after a test failure: it can't be built
};

inline ShippedWorld build_shipped(const std::string& name,
                                  const std::function<void(SceneDescription&)>& change = {}) {
  SceneLoadOptions options;
  options.assets = project_file("assets");
  options.features = feature_keys();
  auto scene = load_scene(project_file("scenes/" + name + ".json"), options);
  const auto tissues = load_tissues(project_file("assets/tissues.json"));
  if (!scene || !tissues) {
    ADD_FAILURE() << (scene ? tissues.error().text() : scene.error().text());
    return {};
  }
  if (change) change(*scene);
  std::vector<std::string> warnings;
  auto world = build_world(*scene, *tissues, {options.assets, false}, no_progress(), warnings);
  if (!world) {
    ADD_FAILURE() << world.error().text();
    return {};
  }
  return {std::move(*scene), std::move(*world)};
}

}  // namespace viscera::test
