#include "engine/io/factor_file.h"

#include <system_error>

#include "engine/io/cache_file.h"

namespace viscera {
namespace {

constexpr int kFormat = 1;  // of the names below

}  // namespace

Result<void> write_factor(const std::filesystem::path& file, const std::string& key,
                          const StiffnessFactor& factor) {
  const PackedFactor packed = factor.pack();
  CacheContents contents;
  contents.array("order", packed.order);
  contents.array("fronts", packed.fronts);
  contents.array("borders", packed.borders);
  contents.array("single_panels", packed.single_panels);
  contents.array("full_panels", packed.full_panels);
  return write_cache_file(file, kFormat, key, contents);
}

Result<StiffnessFactor> read_factor(const std::filesystem::path& file, const std::string& key) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return failure("there is no such file");
  auto data = read_cache_file(file, kFormat, key);
  if (!data) return std::unexpected(data.error());
  return factor_of(*std::move(data));
}

Result<StiffnessFactor> factor_of(CacheData data) {
  PackedFactor packed;
  Error missing;
  const auto take = [&]<class T>(const char* name, std::vector<T>& into) {
    auto values = data.take<T>(name);
    if (values)
      into = std::move(*values);
    else
      missing = values.error();
  };
  take("order", packed.order);
  take("fronts", packed.fronts);
  take("borders", packed.borders);
  take("single_panels", packed.single_panels);
  take("full_panels", packed.full_panels);
  if (!missing.messages.empty()) return std::unexpected(missing);
  return StiffnessFactor::unpack(packed);
}

}  // namespace viscera
