#include "kernels/contact/touched_compliance.h"

#include <utility>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// Where each of these stood before; -1: nowhere. Both ascend.
std::vector<Eigen::Index> places_before(const std::vector<int>& before,
                                        const std::vector<int>& now) {
  std::vector<Eigen::Index> found(now.size(), -1);
  for (std::size_t i = 0, old = 0; i < now.size(); ++i) {
    while (old < before.size() && before[old] < now[i]) ++old;
    if (old < before.size() && before[old] == now[i]) found[i] = static_cast<Eigen::Index>(old);
  }
  return found;
}

}  // namespace

/// Where it is symmetric only one triangle is read (the rest is its mirror): the columns are long,
/// so every entry is a miss of the cache.
bool TouchedCompliance::gather(const SurfaceCompliance& compliance,
                               const std::vector<int>& touched) {
  if (touched == touched_) return false;
  const bool symmetric = compliance.symmetric;
  const auto m = static_cast<Eigen::Index>(touched.size());
  const Parts before = std::exchange(parts_, {});
  for (std::size_t part = 0; part < 9; ++part) {
    if (symmetric && part / 3 > part % 3) continue;
    parts_[part].resize(m, m);
  }
  const std::vector<Eigen::Index> known = places_before(touched_, touched);
  const std::size_t rows = compliance.rows();
  const auto read = [&](std::size_t row, std::size_t column) {
    const float* entry = compliance.columns.data() +
                         3 * static_cast<std::size_t>(touched[column]) * rows +
                         3 * compliance.touchable[static_cast<std::size_t>(touched[row])];
    const auto i = static_cast<Eigen::Index>(row), j = static_cast<Eigen::Index>(column);
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = symmetric ? a : 0; b < 3; ++b) {
        parts_[3 * a + b](i, j) = entry[b * rows + a];
        // C(j, i) is the transpose of C(i, j).
        if (symmetric) parts_[3 * a + b](j, i) = entry[a * rows + b];
      }
  };
  parallel_for_each_index(touched.size(), 32, [&](std::size_t column) {
    const Eigen::Index old = known[column];
    for (std::size_t row = 0; row < (symmetric ? column + 1 : touched.size()); ++row)
      if (old < 0 || known[row] < 0) read(row, column);
    for (std::size_t part = 0; old >= 0 && part < 9; ++part) {
      if (parts_[part].size() == 0) continue;
      const float* from = before[part].col(old).data();
      float* to = parts_[part].col(static_cast<Eigen::Index>(column)).data();
      for (std::size_t row = 0; row < touched.size(); ++row)
        if (known[row] >= 0) to[row] = from[known[row]];
    }
  });
  touched_ = touched;
  return true;
}

std::size_t TouchedCompliance::memory_bytes() const {
  std::size_t bytes = touched_.capacity() * sizeof(int);
  for (const Eigen::MatrixXf& part : parts_)
    bytes += static_cast<std::size_t>(part.size()) * sizeof(float);
  return bytes;
}

}  // namespace viscera
