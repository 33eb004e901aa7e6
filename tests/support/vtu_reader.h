// Reads a .vtu of ours back, by VTK's description of the format and not by our writer's code.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "kernels/base/types.h"

namespace viscera::test {

struct VtuContent {
  std::vector<Vec3f> points;
  std::vector<std::array<int, 3>> triangles;
  std::map<std::string, std::vector<Vec3f>> fields;  ///< at the points
};

/// Test failures, and what was read so far, where the file isn't as it should be.
VtuContent read_vtu(const std::filesystem::path& file);

struct PvdContent {
  double time;
  int part;
  std::string name, file;
};
std::vector<PvdContent> read_pvd(const std::filesystem::path& file);

}  // namespace viscera::test
