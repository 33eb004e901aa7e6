// The sealed HDF5 container of caches and recordings. A changed one has another checksum, so the
// right one is put in: behind it lies the library, which trusts what it reads, so recordings are
// read by the child.
#include "engine/io/cache_file.h"
#include "engine/io/foreign_files.h"
#include "kernels/base/hash.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr std::string_view kSignature = "Viscera cache, XXH3-128 ";
constexpr int kFormat = 1;
constexpr const char* kKey = "key";

std::string sealed_bytes(std::string_view input) {
  std::string all(input);
  if (all.size() < kBlock) return all;
  Hasher hasher;
  const std::string hash = hasher.bytes(all.data() + kBlock, all.size() - kBlock).hex();
  return all.replace(0, kSignature.size() + hash.size(), std::string(kSignature) + hash);
}

bool read(std::string_view input) {
  return read_cache_file(scratch("sealed.h5", sealed_bytes(input)), kFormat, kKey).has_value();
}

bool by_child(std::string_view input) {
  return read_sealed_file(scratch("sealed.h5", sealed_bytes(input)), kFormat, kKey).has_value();
}

std::vector<std::string> seeds() {
  const std::vector<double> doubles = {1.0, 2.0, 3.0};
  const std::vector<float> floats = {1.0f};
  const std::vector<int> integers = {1, 2};
  CacheContents contents;
  contents.text("device", "simulated");
  contents.array("header", doubles);
  contents.array("columns", floats);
  contents.array("order", integers);
  const auto file = scratch("written.h5", "");
  expect(write_cache_file(file, kFormat, kKey, contents).has_value(), "a container is written");
  return {file_text(file)};
}

}  // namespace

Target sealed() {
  return {read, seeds, by_child};
}

}  // namespace viscera::fuzz
