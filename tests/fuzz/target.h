// What is fuzzed: a target a parser, its valid inputs, and what must hold of what it reads.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

namespace viscera::fuzz {

struct Target {
  /// Reads the input in this process. True: as something valid. Ends the process where what was
  /// read isn't what the parser promises (expect()).
  bool (*read)(std::string_view input) = nullptr;
  std::vector<std::string> (*seeds)() = nullptr;  ///< valid inputs
  /// As the program reads it where it doesn't trust a library: by viscera_reader. Null: as read().
  bool (*by_child)(std::string_view input) = nullptr;
};

// A file of targets/ each; CMakeLists.txt has the list.
Target archive();
Target cache();
Target checkpoint();
Target controls();
Target gltf();
Target igtl();
Target json();
Target nifti();
Target nrrd();
Target obj();
Target ply();
Target recording();
Target scene();
Target sealed();
Target set();
Target stl();
Target vdb();

/// Ends the process, saying what doesn't hold.
inline void expect(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "what was read isn't what its parser promises: %s\n", what);
  std::abort();
}

}  // namespace viscera::fuzz
