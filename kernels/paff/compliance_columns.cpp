#include "kernels/paff/compliance_columns.h"

#include <algorithm>
#include <string>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// Wide enough for matrix products to run at full speed, small enough to stop soon when asked.
constexpr std::size_t kColumnsAtOnce = 256;

bool is_ascending_below(const std::vector<int>& places, std::size_t count) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i] < 0 || static_cast<std::size_t>(places[i]) >= count) return false;
    if (i > 0 && places[i] <= places[i - 1]) return false;
  }
  return true;
}

/// The unit load of column `column`: phi_J on that component of every node J of its place.
void add_load(const SparseWeights& places, const std::vector<int>& touchable, std::size_t column,
              SparseLoads& loads) {
  const auto place = static_cast<std::size_t>(touchable[column / 3]);
  const auto entries = static_cast<std::size_t>(places.row_begin[place + 1]);
  for (auto e = static_cast<std::size_t>(places.row_begin[place]); e < entries; ++e) {
    loads.unknowns.push_back(3 * places.nodes[e] + static_cast<int>(column % 3));
    loads.values.push_back(static_cast<double>(places.values[e]));
  }
  loads.begin.push_back(static_cast<int>(loads.unknowns.size()));
}

}  // namespace

void read_places(const SparseWeights& places, const double* unknowns, float* column) {
  for (std::size_t p = 0; p < places.rows(); ++p) {
    Vec3 sum = Vec3::Zero();
    const auto entries = static_cast<std::size_t>(places.row_begin[p + 1]);
    for (auto e = static_cast<std::size_t>(places.row_begin[p]); e < entries; ++e) {
      sum += static_cast<double>(places.values[e]) * Vec3::Map(unknowns + 3 * places.nodes[e]);
    }
    Vec3f::Map(column + 3 * p) = sum.cast<float>();
  }
}

std::vector<std::size_t> SurfaceCompliance::touchable_rows() const {
  std::vector<std::size_t> rows;
  rows.reserve(3 * touchable.size());
  for (const int place : touchable) {
    for (std::size_t k = 0; k < 3; ++k) rows.push_back(3 * static_cast<std::size_t>(place) + k);
  }
  return rows;
}

Result<SurfaceCompliance> empty_compliance(std::size_t node_count, const SparseWeights& places,
                                           std::vector<int> touchable, bool symmetric) {
  const bool known = std::all_of(places.nodes.begin(), places.nodes.end(), [&](int node) {
    return node >= 0 && static_cast<std::size_t>(node) < node_count;
  });
  if (!known || !is_ascending_below(touchable, places.rows())) {
    return failure(
        "compliance: expected places whose nodes are below " + std::to_string(node_count) +
        ", and touchable places ascending, each once, below " + std::to_string(places.rows()));
  }
  SurfaceCompliance compliance;
  compliance.places = places.rows();
  compliance.touchable = std::move(touchable);
  compliance.symmetric = symmetric;
  compliance.columns.resize(compliance.rows() * 3 * compliance.touchable.size());
  return compliance;
}

Result<SurfaceCompliance> compliance_columns(std::size_t node_count, const SparseWeights& places,
                                             std::vector<int> touchable, const LoadSolver& solve,
                                             const Progress& progress) {
  Result<SurfaceCompliance> made =
      empty_compliance(node_count, places, std::move(touchable), false);
  if (!made) return made;
  SurfaceCompliance& compliance = *made;
  const std::size_t rows = compliance.rows();
  const std::size_t column_count = 3 * compliance.touchable.size();
  const std::size_t unknowns = 3 * node_count;

  std::vector<double> block;
  for (std::size_t first = 0; first < column_count; first += kColumnsAtOnce) {
    if (!progress(static_cast<double>(first) / static_cast<double>(column_count),
                  "computing compliance")) {
      return failure(kCancelled);
    }
    const std::size_t last = std::min(column_count, first + kColumnsAtOnce);
    SparseLoads loads;
    for (std::size_t c = first; c < last; ++c) add_load(places, compliance.touchable, c, loads);
    block.resize(unknowns * loads.size());
    if (const Result<void> solved = solve(loads, block); !solved) {
      return std::unexpected(solved.error());
    }
    parallel_for_each_index(last - first, 8, [&](std::size_t c) {
      read_places(places, block.data() + c * unknowns,
                  compliance.columns.data() + (first + c) * rows);
    });
  }
  if (!progress(1.0, "computing compliance")) return failure(kCancelled);
  return made;
}

}  // namespace viscera
