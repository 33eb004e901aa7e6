#include "kernels/paff/local_spacing.h"

#include <algorithm>

#include "kernels/paff/shape_functions.h"

namespace viscera {
namespace {

std::vector<double> twice(std::vector<double> spacings) {
  for (double& spacing : spacings) spacing *= 2.0;
  return spacings;
}

}  // namespace

LocalSpacing::LocalSpacing(const PointCloud& cloud)
    : positions_(cloud.positions),
      spacings_(cloud.spacings),
      radii_(twice(cloud.spacings)),
      smallest_(*std::min_element(spacings_.begin(), spacings_.end())),
      largest_(*std::max_element(spacings_.begin(), spacings_.end())),
      grid_(positions_, radii_) {}

double LocalSpacing::operator()(const Vec3& x) const {
  thread_local std::vector<int> near;
  grid_.reaching(x, near);
  double weights = 0.0, sum = 0.0;
  for (const int node : near) {
    const std::size_t j = static_cast<std::size_t>(node);
    const double weight = quartic_weight((positions_[j] - x).norm() / radii_[j]);
    weights += weight;
    sum += weight * spacings_[j];
  }
  return weights > 0.0 ? sum / weights : smallest_;
}

}  // namespace viscera
