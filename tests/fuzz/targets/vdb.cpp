// A smoke volume. A changed one has another end mark, so the right one is put in: behind it lies
// OpenVDB, which trusts what it reads, so the program lets the child read.
#include "engine/io/foreign_files.h"
#include "engine/io/vdb_volume.h"
#include "kernels/base/hash.h"
#include "tests/fuzz/memory.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

// "viscera whole ", 16 digits, a blank, 32 digits, a line's end.
constexpr std::size_t kMark = 14 + 16 + 1 + 32 + 1;

// The seed, of which all grids are read, takes up to 2 MB [bytes].
constexpr std::size_t kMemory = 4'000'000;

std::string marked(std::string_view volume) {
  char length[17];
  std::snprintf(length, sizeof length, "%016zx", volume.size());
  Hasher hasher;
  return std::string(volume) + "viscera whole " + length + ' ' +
         hasher.bytes(volume.data(), volume.size()).hex() + '\n';
}

bool is_info(const Result<SmokeFileInfo>& info) {
  if (!info) return false;
  expect(info->least.allFinite() && info->greatest.allFinite(), "smoke's box is finite");
  return true;
}

bool read(std::string_view input) {
  const auto file = scratch("smoke.vdb", marked(input));
  const MemoryBudget budget(kMemory);
  return is_info(read_smoke_info_here(file));
}

bool by_child(std::string_view input) {
  return is_info(read_smoke_info(scratch("smoke.vdb", marked(input))));
}

std::vector<std::string> seeds() {
  SmokeGrid grid;
  grid.size = {2, 2, 2};
  grid.voxel = 0.01;
  grid.domain = Box(Vec3::Zero(), Vec3::Constant(0.02));
  grid.density.assign(8, 0.5f);
  grid.temperature.assign(8, 10.0f);
  grid.velocity.assign(8, Vec3f(0.0f, 0.1f, 0.0f));
  std::string bytes = *encode_volume(grid, 0.5, "smoke", "scene");
  bytes.resize(bytes.size() - kMark);
  return {bytes};
}

}  // namespace

Target vdb() {
  return {read, seeds, by_child};
}

}  // namespace viscera::fuzz
