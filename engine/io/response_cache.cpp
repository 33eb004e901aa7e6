#include "engine/io/response_cache.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include "engine/io/cache_quota.h"
#include "kernels/base/finite.h"

namespace viscera {
namespace fs = std::filesystem;

namespace {

constexpr int kFormat = 3;  // of the names and meanings below

static_assert(sizeof(Vec3) == 3 * sizeof(double), "positions are stored as they lie in memory");

/// The figures as one array of doubles: exact for counts below 2^53.
std::vector<double> to_numbers(const PreparationFigures& f) {
  return {static_cast<double>(f.unknowns),
          static_cast<double>(f.stiffness_nonzeros),
          static_cast<double>(f.quadrature_points),
          f.gradient_correction,
          f.fixed_area,
          f.assemble_s,
          f.factor_s,
          f.compliance_s,
          static_cast<double>(f.factor_bytes),
          f.smallest_compliance_eigenvalue};
}

PreparationFigures to_figures(std::span<const double> v) {
  PreparationFigures f;
  f.unknowns = static_cast<std::size_t>(v[0]);
  f.stiffness_nonzeros = static_cast<std::size_t>(v[1]);
  f.quadrature_points = static_cast<std::size_t>(v[2]);
  f.gradient_correction = v[3];
  f.fixed_area = v[4];
  f.assemble_s = v[5];
  f.factor_s = v[6];
  f.compliance_s = v[7];
  f.factor_bytes = static_cast<std::size_t>(v[8]);
  f.smallest_compliance_eigenvalue = v[9];
  return f;
}

constexpr std::size_t kFigures = 10;
constexpr double kExactInteger = 9007199254740992.0;  // 2^53

/// Whether figures that are counts can be such.
bool counts_of(std::span<const double> figures) {
  return std::ranges::all_of(std::array<std::size_t, 4>{0, 1, 2, 8}, [&](std::size_t at) {
    return figures[at] >= 0.0 && figures[at] <= kExactInteger;
  });
}

bool indices_of(const std::vector<int>& indices, std::size_t count) {
  return std::all_of(indices.begin(), indices.end(),
                     [&](int i) { return i >= 0 && static_cast<std::size_t>(i) < count; });
}

}  // namespace

Result<PreparedResponse> response_of(CacheData data) {
  PreparedResponse r;
  auto positions = data.take<double>("positions");
  if (!positions) return std::unexpected(positions.error());
  const std::size_t nodes = positions->size() / 3;
  if (positions->size() != 3 * nodes) return failure("its positions aren't triples");
  auto spacings = data.take<double>("spacings", nodes);
  if (!spacings) return std::unexpected(spacings.error());
  auto surface_count = data.take<int>("surface_count", 1);
  if (!surface_count) return std::unexpected(surface_count.error());
  auto place_count = data.take<int>("places", 1);
  if (!place_count) return std::unexpected(place_count.error());
  const int places = place_count->front();
  if (places < 0)
    return failure("it has " + std::to_string(places) + " places, expected 0 or more");
  auto touchable = data.take<int>("touchable");
  if (!touchable) return std::unexpected(touchable.error());
  auto columns =
      data.take<float>("columns", 9 * static_cast<std::size_t>(places) * touchable->size());
  if (!columns) return std::unexpected(columns.error());
  auto figures = data.take<double>("figures", kFigures);
  if (!figures) return std::unexpected(figures.error());
  auto symmetric = data.take<int>("symmetric", 1);
  if (!symmetric) return std::unexpected(symmetric.error());
  const int surface_nodes = surface_count->front();
  if (surface_nodes < 0 || static_cast<std::size_t>(surface_nodes) > nodes ||
      !indices_of(*touchable, static_cast<std::size_t>(places))) {
    return failure("it names nodes or places that it doesn't have");
  }
  if (!counts_of(*figures)) return failure("it has figures that are no counts");
  if (!all_finite(*positions) || !all_finite(*spacings))
    return failure("it has nodes whose places aren't finite numbers");

  r.cloud.positions.resize(nodes);
  for (std::size_t i = 0; i < nodes; ++i) r.cloud.positions[i] = Vec3(positions->data() + 3 * i);
  r.cloud.spacings = std::move(*spacings);
  r.cloud.surface_count = static_cast<std::size_t>(surface_nodes);
  r.compliance.places = static_cast<std::size_t>(places);
  r.compliance.touchable = std::move(*touchable);
  r.compliance.columns.assign(columns->begin(), columns->end());
  r.compliance.symmetric = symmetric->front() != 0;
  r.figures = to_figures(*figures);
  for (auto& [name, array] : data.arrays()) {
    if (name.starts_with("extra.")) r.extra[name.substr(6)] = std::move(array);
  }
  return r;
}

fs::path ResponseCache::default_folder() {
  const auto variable = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    return value ? fs::path(value) : fs::path();
  };
  if (const fs::path own = variable("VISCERA_CACHE"); !own.empty()) return own;
  if (const fs::path xdg = variable("XDG_CACHE_HOME"); xdg.is_absolute()) return xdg / "viscera";
  if (const fs::path home = variable("HOME"); !home.empty()) return home / ".cache" / "viscera";
  return fs::temp_directory_path() / "viscera_cache";
}

fs::path ResponseCache::file(const std::string& key) const {
  return folder_ / (key + ".h5");
}

CachedResponse ResponseCache::load(const std::string& key) const {
  const fs::path path = file(key);
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return {};
  const auto unusable = [&](const Error& error) {
    return CachedResponse{{}, path.string() + ": rebuilt because " + error.text()};
  };
  auto data = read_cache_file(path, kFormat, key);
  if (!data && !fs::exists(path, ignored)) return {};  // another process has just forgotten it
  if (!data) return unusable(data.error());
  auto response = response_of(std::move(*data));
  if (!response) return unusable(response.error());
  mark_used(path);
  return {std::move(*response), ""};
}

Result<void> ResponseCache::save(const std::string& key, const PreparedResponse& response) const {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) return failure(folder_.string() + ": can't be created: " + error.message());
  const PointCloud& cloud = response.cloud;
  const std::array<int, 1> surface_count = {static_cast<int>(cloud.surface_count)};
  const std::array<int, 1> places = {static_cast<int>(response.compliance.places)};
  const std::array<int, 1> symmetric = {response.compliance.symmetric ? 1 : 0};
  const std::vector<double> figures = to_numbers(response.figures);
  const double* positions = cloud.positions.empty() ? nullptr : cloud.positions.front().data();

  CacheContents contents;
  contents.array("positions", std::span<const double>(positions, 3 * cloud.size()));
  contents.array("spacings", cloud.spacings);
  contents.array("surface_count", std::span<const int>(surface_count));
  contents.array("places", std::span<const int>(places));
  contents.array("touchable", response.compliance.touchable);
  contents.array("columns", std::span<const float>(response.compliance.columns));
  contents.array("symmetric", std::span<const int>(symmetric));
  contents.array("figures", figures);
  for (const auto& [name, array] : response.extra) {
    std::visit([&](const auto& values) { contents.array("extra." + name, values); }, array);
  }
  return write_cache_file(file(key), kFormat, key, contents);
}

}  // namespace viscera
