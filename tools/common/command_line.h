// What the command lines of the programs share: naming a scene, and how a program ends.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

#include "engine/scene/load_scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/result.h"

namespace viscera {

/// Exit code of bad input, no room to begin, a missing driver: the person can mend it.
inline constexpr int kBadInput = 2;
/// Exit code of a run that had begun and then failed: its report says why.
inline constexpr int kFailed = 1;
/// Exit code of a mistake of the program.
inline constexpr int kInternalError = 1;

/// Says the error on stderr; its exit code.
int fail(const Error& error);
/// Zero, or what fail() says.
int code_of(const Result<void>& done);

/// Runs a program's `work` so that no exception and no full disk ends it without a message.
int run_to_the_end(int (*work)(int argc, char** argv), int argc, char** argv);

/// A scene and what changes it, as options of a subcommand.
struct SceneArguments {
  std::string scene;
  std::vector<std::string> assets, sets;
  std::string seed, duration;

  void add_to(CLI::App& command);
  /// The same again for another call of the program.
  std::vector<std::string> words() const;
  Result<SceneDescription> load() const;
};

/// The tissues of the assets.
Result<std::map<std::string, Tissue>> load_known_tissues();

/// Loads what the arguments name and gives it to `use`; its exit code, or that of mistakes.
template <class Use>
int with_scene(const SceneArguments& arguments, const Use& use) {
  auto scene = arguments.load();
  if (!scene) return fail(scene.error());
  auto known = load_known_tissues();
  if (!known) return fail(known.error());
  return code_of(use(*scene, *known));
}

/// An option that takes values between commas.
CLI::Option* add_list(CLI::App& command, const char* name, auto& values, const char* what) {
  return command.add_option(name, values, what)->delimiter(',')->allow_extra_args(false);
}

}  // namespace viscera
