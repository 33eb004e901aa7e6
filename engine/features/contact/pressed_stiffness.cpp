#include "engine/features/contact/pressed_stiffness.h"

#include <Eigen/Cholesky>

namespace viscera {

Mat3 pressed_stiffness(const World& world, Entity organ, std::span<const std::size_t> cells,
                       std::span<const Vec3> ways) {
  const auto n = static_cast<Eigen::Index>(cells.size());
  if (n == 0) return Mat3::Zero();
  const std::vector<ContactCell>& all = world.find<OrganContact>(organ)->cells;
  const MatrixX& response = world.find<OrganTouch>(organ)->solver->cell_response();
  if (response.rows() != static_cast<Eigen::Index>(3 * all.size())) return Mat3::Zero();
  MatrixX compliance(n, n), asked(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t k = cells[static_cast<std::size_t>(i)];
    asked.row(i) = ways[static_cast<std::size_t>(i)].transpose();
    for (Eigen::Index j = 0; j < n; ++j) {
      const std::size_t l = cells[static_cast<std::size_t>(j)];
      compliance(i, j) = all[k].direction.dot(
          response.block<3, 3>(static_cast<Eigen::Index>(3 * k), static_cast<Eigen::Index>(3 * l)) *
          all[l].direction);
    }
  }
  const Eigen::LLT<MatrixX> factor(0.5 * (compliance + compliance.transpose()));
  if (factor.info() != Eigen::Success) return Mat3::Zero();
  const Mat3 found = asked.transpose() * factor.solve(asked);
  return 0.5 * (found + found.transpose());
}

}  // namespace viscera
