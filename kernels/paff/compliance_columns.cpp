#include "kernels/paff/compliance_columns.h"

#include <algorithm>
#include <string>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// Wide enough for matrix products to run at full speed, small enough to stop soon when asked.
constexpr std::size_t kColumnsAtOnce = 256;

/// Ascending, each once, within [0, count).
bool is_node_list(const std::vector<int>& nodes, std::size_t count) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i] < 0 || static_cast<std::size_t>(nodes[i]) >= count) return false;
    if (i > 0 && nodes[i] <= nodes[i - 1]) return false;
  }
  return true;
}

}  // namespace

std::vector<std::size_t> SurfaceCompliance::touchable_rows() const {
  std::vector<std::size_t> row_of;
  row_of.reserve(3 * touchable.size());
  for (const int node : touchable) {
    const auto found = std::lower_bound(visible.begin(), visible.end(), node);
    const auto place = static_cast<std::size_t>(found - visible.begin());
    for (std::size_t k = 0; k < 3; ++k) row_of.push_back(3 * place + k);
  }
  return row_of;
}

Result<SurfaceCompliance> empty_compliance(std::size_t node_count, std::vector<int> visible,
                                           std::vector<int> touchable, bool symmetric) {
  if (!is_node_list(visible, node_count) || !is_node_list(touchable, node_count) ||
      !std::includes(visible.begin(), visible.end(), touchable.begin(), touchable.end())) {
    return failure("compliance: expected visible and touchable nodes ascending, each once, below " +
                   std::to_string(node_count) + ", touchable ones among the visible");
  }
  SurfaceCompliance compliance{std::move(visible), std::move(touchable), {}, symmetric};
  compliance.columns.resize(compliance.rows() * 3 * compliance.touchable.size());
  return compliance;
}

Result<SurfaceCompliance> compliance_columns(std::size_t node_count, std::vector<int> visible,
                                             std::vector<int> touchable,
                                             const UnitSolver& solve_units,
                                             const Progress& progress) {
  Result<SurfaceCompliance> made =
      empty_compliance(node_count, std::move(visible), std::move(touchable), false);
  if (!made) return made;
  SurfaceCompliance& compliance = *made;
  const std::size_t rows = compliance.rows();
  const std::size_t column_count = 3 * compliance.touchable.size();
  const std::size_t unknowns = 3 * node_count;

  std::vector<int> units;
  std::vector<double> block;
  for (std::size_t first = 0; first < column_count; first += kColumnsAtOnce) {
    if (!progress(static_cast<double>(first) / static_cast<double>(column_count),
                  "computing compliance")) {
      return failure(kCancelled);
    }
    const std::size_t last = std::min(column_count, first + kColumnsAtOnce);
    units.clear();
    for (std::size_t c = first; c < last; ++c) {
      units.push_back(3 * compliance.touchable[c / 3] + static_cast<int>(c % 3));
    }
    block.resize(unknowns * units.size());
    if (const Result<void> solved = solve_units(units, block); !solved) {
      return std::unexpected(solved.error());
    }
    parallel_for_each_index(last - first, 8, [&](std::size_t c) {
      const double* solution = block.data() + c * unknowns;
      float* column = compliance.columns.data() + (first + c) * rows;
      for (std::size_t v = 0; v < compliance.visible.size(); ++v) {
        const double* triple = solution + 3 * compliance.visible[v];
        for (std::size_t k = 0; k < 3; ++k) column[3 * v + k] = static_cast<float>(triple[k]);
      }
    });
  }
  if (!progress(1.0, "computing compliance")) return failure(kCancelled);
  return made;
}

}  // namespace viscera
