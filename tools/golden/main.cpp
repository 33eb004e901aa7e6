// viscera_golden [--write] [SCENE...]: runs the shipped scenes of tests/scenes/golden.json (or
// those named) and prints each figure that has changed, old -> new. With --write the file is
// written anew; the diff of it belongs into the change that caused it. Exit code 1: a figure left
// its tolerance; 2: there is no such scene, or a run or a file failed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "engine/io/atomic_file.h"
#include "tools/common/bench_figures.h"
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
  for (const std::string& name : names) {
    if (std::ranges::find(*scenes, name, &viscera::GoldenScene::name) != scenes->end()) continue;
    std::cerr << fmt::format("{}: found no scene \"{}\", expected one of:", file.string(), name);
    for (const viscera::GoldenScene& scene : *scenes) std::cerr << ' ' << scene.name;
    std::cerr << '\n';
    return 2;
  }
  const auto scratch = viscera::ScratchFolder::create();
  if (!scratch) {
    std::cerr << scratch.error().text() << '\n';
    return 2;
  }
  const fs::path out = (*scratch)->path();
  // What an older program has prepared says nothing of this one.
  setenv("VISCERA_CACHE", (out / "cache").c_str(), 1);
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
  if (!write) return beyond ? 1 : 0;
  if (auto written = viscera::write_file(file, viscera::golden_text(*scenes)); !written) {
    std::cerr << written.error().text() << '\n';
    return 2;
  }
  return 0;
}
