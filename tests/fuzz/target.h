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

// A file of targets/ each.
#define VISCERA_FUZZ_TARGETS(each)                                                           \
  each(archive) each(cache) each(checkpoint) each(controls) each(gltf) each(igtl) each(json) \
      each(nifti) each(nrrd) each(obj) each(ply) each(recording) each(scene) each(sealed)    \
          each(set) each(stl) each(vdb)
#define VISCERA_FUZZ_TARGET(name) Target name();
VISCERA_FUZZ_TARGETS(VISCERA_FUZZ_TARGET)
#undef VISCERA_FUZZ_TARGET

/// Ends the process, saying what doesn't hold.
inline void expect(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "what was read isn't what its parser promises: %s\n", what);
  std::abort();
}

}  // namespace viscera::fuzz
