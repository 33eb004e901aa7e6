// The node spacing of a cloud as a field, which background cells and surface points follow.
#pragma once

#include <vector>

#include "kernels/points/cloud.h"
#include "kernels/points/neighbours.h"

namespace viscera {

/// h(x): mean of the spacings of the nodes near x, nearer ones weighing more.
class LocalSpacing {
 public:
  explicit LocalSpacing(const PointCloud& cloud);

  /// [m]; the smallest spacing of the cloud where no node is near. Safe from many threads.
  double operator()(const Vec3& x) const;

  double largest() const { return largest_; }
  const std::vector<double>& spacings() const { return spacings_; }

 private:
  std::vector<Vec3> positions_;
  std::vector<double> spacings_, radii_;
  double smallest_, largest_;
  InfluenceGrid grid_;
};

}  // namespace viscera
