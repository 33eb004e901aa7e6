#include "tools/common/command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>

#include "engine/features/features.h"
#include "engine/io/interrupt.h"
#include "kernels/base/printable.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

constexpr std::size_t kMostMessages = 20, kLongestMessage = 2000;

/// Of very many mistakes the first are enough to begin with.
Error few_of(const Error& error) {
  Error few;
  for (std::size_t i = 0; i < std::min(kMostMessages, error.messages.size()); ++i)
    few.messages.push_back(shortened(error.messages[i], kLongestMessage));
  if (const std::size_t more = error.messages.size() - few.messages.size(); more > 0)
    few.messages.push_back(fmt::format("and {} more", more));
  return few;
}

}  // namespace

int fail(const Error& error) {
  if (error.messages.size() == 1 && error.messages[0] == kCancelled) {
    std::cerr << "stopped; what was written is whole\n";
    return 128 + interrupt_signal();
  }
  std::cerr << printable(few_of(error).text()) << '\n';
  return kBadInput;
}

int code_of(const Result<void>& done) {
  return done ? 0 : fail(done.error());
}

int run_to_the_end(int (*work)(int argc, char** argv), int argc, char** argv) {
  // A file that passes a limit of its size is then an error of its write, like a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  // A reader of our output that goes is no reason to leave a run without its files.
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return work(argc, argv);
  } catch (const std::bad_alloc&) {
    std::cerr << "out of memory: coarser spacings, fewer triangles or smaller volumes need less; "
                 "`viscera check` says how much\n";
    return kBadInput;
  } catch (const std::exception& error) {
    std::cerr << "internal error: " << printable(error.what()) << '\n';
    return kInternalError;
  }
}

void SceneArguments::add_to(CLI::App& command) {
  command.add_option("scene", scene, "scene file")->required();
  command.add_option("--assets", assets, "a further folder in which geometry files are looked for")
      ->allow_extra_args(false);
  command
      .add_option("--set", sets,
                  "KEY=VALUE: overrides a key of the scene, e.g. "
                  "organs/liver/resolution/finest_spacing_mm=2.5")
      ->allow_extra_args(false);
  command.add_option("--seed", seed, "overrides the scene's seed");
  command.add_option("--duration", duration, "overrides the scene's duration [s]");
}

std::vector<std::string> SceneArguments::words() const {
  std::vector<std::string> all{scene};
  for (const std::string& folder : assets) all.insert(all.end(), {"--assets", folder});
  for (const std::string& set : sets) all.insert(all.end(), {"--set", set});
  if (!seed.empty()) all.insert(all.end(), {"--seed", seed});
  return all;
}

Result<SceneDescription> SceneArguments::load() const {
  SceneLoadOptions options;
  options.features = feature_keys();
  options.assets = assets_folder();
  options.search.assign(assets.begin(), assets.end());
  for (const std::string& folder : assets)
    if (std::error_code error; !std::filesystem::is_directory(folder, error))
      return failure(fmt::format("--assets {}: no such folder", folder));
  for (const std::string& set : sets) {
    const std::size_t equals = set.find('=');
    if (equals == std::string::npos || equals == 0)
      return failure(fmt::format("--set {}: expected KEY=VALUE", set));
    options.overrides.emplace_back(set.substr(0, equals), set.substr(equals + 1));
  }
  if (!seed.empty()) options.overrides.emplace_back("seed", seed);
  if (!duration.empty()) options.overrides.emplace_back("duration_s", duration);
  return load_scene(scene, options);
}

Result<std::map<std::string, Tissue>> load_known_tissues() {
  return load_tissues(assets_folder() / "tissues.json");
}

}  // namespace viscera
