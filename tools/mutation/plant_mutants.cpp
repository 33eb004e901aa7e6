// plant_mutants --seed 1 --count 300 --into TREE [--without FILE] SOURCE...: draws mutants from
// these sources (paths below the current folder), writes the sources with them planted to the same
// paths below TREE, and prints what was drawn: number, file:line, kind, token and the line. Those
// whose file:line stands in the file --without are drawn, but not planted.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "engine/io/atomic_file.h"
#include "tools/mutation/mutant_sites.h"

namespace viscera {
namespace {

std::string text_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string line_of(const std::string& source, std::size_t at) {
  const std::size_t begin = source.rfind('\n', at) + 1;
  std::string line = source.substr(begin, source.find('\n', at) - begin);
  line.erase(0, line.find_first_not_of(' '));
  return line;
}

int plant(const std::vector<std::string>& files, std::uint64_t seed, int count,
          const std::filesystem::path& tree, const std::string& without_file) {
  std::vector<std::string> sources;
  for (const std::string& file : files) sources.push_back(text_of(file));
  std::set<std::string> without;
  std::ifstream in(without_file);
  for (std::string place; std::getline(in, place);) without.insert(place);
  std::vector<std::vector<PickedMutant>> by_file(files.size());
  for (const PickedMutant& one : pick_mutants(sources, seed, count)) {
    const std::string place = fmt::format("{}:{}", files[one.file], one.site.line);
    const bool planted = !without.contains(place);
    std::cout << fmt::format("{}\t{}\t{}\t{}\t{}\t{}\n", one.number, place,
                             mutant_kind_name(one.site.kind), one.site.token,
                             planted ? "planted" : "left out",
                             line_of(sources[one.file], one.site.begin));
    if (planted) by_file[one.file].push_back(one);
  }
  for (std::size_t f = 0; f < files.size(); ++f) {
    // What hasn't changed isn't written, so that it isn't compiled again.
    const std::string text =
        by_file[f].empty() ? sources[f] : plant_mutants(sources[f], by_file[f]);
    if (text_of((tree / files[f]).string()) == text) continue;
    if (auto written = write_file(tree / files[f], text); !written) {
      std::cerr << written.error().text() << '\n';
      return 1;
    }
  }
  return 0;
}

}  // namespace
}  // namespace viscera

int main(int count, char** words) {
  CLI::App program("Plants mutants in sources; tools/mutate uses it");
  std::uint64_t seed = 1;
  int number = 300;
  std::string tree, without;
  std::vector<std::string> files;
  program.add_option("--seed", seed, "the same seed, the same mutants");
  program.add_option("--count", number, "how many")->check(CLI::Range(1, 4096));
  program.add_option("--into", tree, "folder of the planted sources")->required();
  program.add_option("--without", without, "file of places (file:line) to leave as they are");
  program.add_option("sources", files)->required()->check(CLI::ExistingFile);
  CLI11_PARSE(program, count, words);
  return viscera::plant(files, seed, number, tree, without);
}
