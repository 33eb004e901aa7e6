// A folder with a small but whole scene that a test spoils in one way or another.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine/scene/json_file.h"
#include "engine/scene/load_scene.h"
#include "tests/engine/scene/whole_scene.h"
#include "tests/support/paths.h"

namespace viscera::test {

class SceneFolder {
 public:
  /// Holds ball.obj and assets/ with the project's tissues and the recipes liver and kidney.
  SceneFolder();

  std::filesystem::path write(const std::string& name, const std::string& text) const;
  Result<SceneDescription> load_text(const std::string& text) const;
  Result<SceneDescription> load(const Json& scene) const { return load_text(scene.dump(1)); }

  /// The messages without the file's name in front; empty when it loads.
  std::vector<std::string> mistakes(const Json& scene) const;

  SceneLoadOptions options;  ///< with the keys of all features

  std::filesystem::path path() const { return folder_.path(); }

 private:
  TemporaryFolder folder_;
};

/// The messages for the whole scene with one value put in (the path as a JSON pointer).
std::vector<std::string> mistakes_with(const std::string& pointer, const Json& value);

/// A line each.
std::string all(const std::vector<std::string>& messages);

/// Whether exactly one message starts with `path` + ": " and contains each of `parts`.
bool mentions(const std::vector<std::string>& messages, const std::string& path,
              const std::vector<std::string>& parts);

#define EXPECT_ONE_MISTAKE(messages, path, ...)                       \
  do {                                                                \
    const std::vector<std::string> found_ = (messages);               \
    EXPECT_EQ(found_.size(), 1u) << viscera::test::all(found_);       \
    EXPECT_TRUE(viscera::test::mentions(found_, path, {__VA_ARGS__})) \
        << viscera::test::all(found_);                                \
  } while (false)

}  // namespace viscera::test
