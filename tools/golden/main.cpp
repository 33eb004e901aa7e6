// viscera_golden [--write] [SCENE...]: runs the shipped scenes of tests/scenes/golden.json (or
// those named) and prints each figure that has changed, old -> new. With --write the file is
// written anew; the diff of it belongs into the change that caused it. Exit code 1: a figure left
// its tolerance.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "engine/io/atomic_file.h"
#include "tools/golden/golden.h"

int main(int count, char** words) {
  namespace fs = std::filesystem;
  CLI::App program("Compares what the shipped scenes come to with what was written down");
  bool write = false;
  std::vector<std::string> names;
  std::string root = ".";
  program.add_flag("--write", write, "write tests/scenes/golden.json anew");
  program.add_option("--root", root, "the project's folder")->check(CLI::ExistingDirectory);
  program.add_option("scenes", names, "of the file; none: all");
  CLI11_PARSE(program, count, words);

  const fs::path file = fs::path(root) / "tests/scenes/golden.json";
  auto scenes = viscera::read_golden(file);
  if (!scenes) {
    std::cerr << scenes.error().text() << '\n';
    return 2;
  }
  const fs::path out = fs::temp_directory_path() / fmt::format("viscera_golden_{}", getpid());
  bool beyond = false;
  for (viscera::GoldenScene& scene : *scenes) {
    if (!names.empty() && std::ranges::find(names, scene.name) == names.end()) continue;
    const auto found = viscera::golden_run(scene, root, out / scene.name);
    if (!found) {
      std::cerr << found.error().text() << '\n';
      return 2;
    }
    const auto changes = viscera::golden_changes(scene, *found);
    std::cout << fmt::format("{}, {:g} s: {} figures, {} changed\n", scene.name, scene.duration_s,
                             found->size(), changes.size());
    for (const viscera::GoldenChange& change : changes) {
      std::cout << (change.beyond ? "! " : "  ") << change.line << '\n';
      beyond = beyond || change.beyond;
    }
    std::cout << std::flush;
    if (write) scene = viscera::with_figures(scene, *found);
  }
  fs::remove_all(out);
  if (!write) return beyond ? 1 : 0;
  if (auto written = viscera::write_file(file, viscera::golden_text(*scenes)); !written) {
    std::cerr << written.error().text() << '\n';
    return 2;
  }
  return 0;
}
