#include "kernels/hive/axial_tissue.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/base/wide.h"
#include "kernels/hive/hyperelastic.h"

namespace viscera {
namespace {

/// Where the grid ends, in radii of the pattern, and its first depth.
constexpr double kFarthest = 12.0, kFirstDepth = 0.3;

/// `count` steps from `from` to `to`, the first `first`, each longer than the last by one ratio.
void graded_steps(double from, double to, double first, int count, std::vector<double>& out) {
  const double way = (to - from) / first;
  double low = 1.0, high = 100.0;
  for (int i = 0; i < 100; ++i) {
    const double q = 0.5 * (low + high);
    const double sum = std::abs(q - 1.0) < 1e-9 ? count : (std::pow(q, count) - 1.0) / (q - 1.0);
    (sum > way ? high : low) = q;
  }
  double step = first, at = from;
  for (int i = 1; i < count; ++i) {
    out.push_back(at += step);
    step *= low;
  }
  out.push_back(to);
}

/// x L^-1 of band columns: rows of right-hand sides `sides` wide, all at once.
VISCERA_WIDE void forward(const double* band, int n, int width, double* x, int sides) {
  for (int j = 0; j < n; ++j) {
    const double* column = band + j * (width + 1);
    double* own = x + j * sides;
    for (int k = 0; k < sides; ++k) own[k] *= column[0];
    const int end = std::min(width, n - 1 - j);
    for (int i = 1; i <= end; ++i) {
      double* other = own + i * sides;
      const double f = column[i];
      for (int k = 0; k < sides; ++k) other[k] -= f * own[k];
    }
  }
}

VISCERA_WIDE void backward(const double* band, int n, int width, double* x, int sides) {
  for (int j = n - 1; j >= 0; --j) {
    const double* column = band + j * (width + 1);
    double* own = x + j * sides;
    const int end = std::min(width, n - 1 - j);
    for (int i = 1; i <= end; ++i) {
      const double* other = own + i * sides;
      const double f = column[i];
      for (int k = 0; k < sides; ++k) own[k] -= f * other[k];
    }
    for (int k = 0; k < sides; ++k) own[k] *= column[0];
  }
}

/// Columns of L below the diagonal; on it 1 / L_jj. False: not positive.
VISCERA_WIDE bool band_cholesky(double* band, int n, int width) {
  for (int j = 0; j < n; ++j) {
    double* column = band + j * (width + 1);
    if (!(column[0] > 0.0)) return false;
    const double inverse = 1.0 / std::sqrt(column[0]);
    column[0] = inverse;
    const int end = std::min(width, n - 1 - j);
    for (int i = 1; i <= end; ++i) column[i] *= inverse;
    for (int i = 1; i <= end; ++i) {
      const double f = column[i];
      if (f == 0.0) continue;
      double* later = column + i * (width + 1);
      for (int k = i; k <= end; ++k) later[k - i] -= f * column[k];
    }
  }
  return true;
}

/// A symmetric positive matrix, by Gauss-Jordan steps without exchanges.
bool invert(AxialTissue::RingMatrix& matrix) {
  const Eigen::Index n = matrix.rows();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double pivot = matrix(k, k);
    if (!(pivot > 0.0)) return false;
    matrix(k, k) = 1.0;
    for (Eigen::Index j = 0; j < n; ++j) matrix(k, j) /= pivot;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (i == k) continue;
      const double f = matrix(i, k);
      matrix(i, k) = 0.0;
      for (Eigen::Index j = 0; j < n; ++j) matrix(i, j) -= f * matrix(k, j);
    }
  }
  return true;
}

}  // namespace

AxialGrid AxialGrid::graded(std::span<const double> ring_ends, int nodes) {
  AxialGrid grid;
  const int between = static_cast<int>(ring_ends.size());
  const int deep = std::max(4, static_cast<int>(std::lround(std::sqrt(0.75 * nodes))));
  const int wide = std::max(between + 3, nodes / deep);
  // About half of the radii under the tool.
  const int parts = std::max(1, (wide - 1) / (2 * between));
  double from = 0.0;
  for (const double end : ring_ends) {
    for (int part = 0; part < parts; ++part)
      grid.radii.push_back(from + (end - from) * part / parts);
    from = end;
  }
  grid.radii.push_back(from);
  const double step = from / (parts * between);
  graded_steps(from, kFarthest, step, std::max(3, wide - static_cast<int>(grid.radii.size())),
               grid.radii);
  grid.depths.push_back(0.0);
  graded_steps(0.0, kFarthest, std::min(kFirstDepth, step), deep - 1, grid.depths);
  return grid;
}

AxialTissue::AxialTissue(AxialGrid grid, std::span<const double> ring_ends, HyperelasticModel model,
                         double lambda_over_mu)
    : model_(model),
      lambda_(lambda_over_mu),
      columns_(static_cast<int>(grid.radii.size())),
      rows_(static_cast<int>(grid.depths.size())),
      width_(2 * rows_ + 3),
      sides_(2 * static_cast<int>(ring_ends.size()) + 1) {
  const auto node = [&](int column, int row) { return column * rows_ + row; };
  for (int c = 0; c + 1 < columns_; ++c)
    for (int k = 0; k + 1 < rows_; ++k) {
      const auto at = static_cast<std::size_t>(c), below = static_cast<std::size_t>(k);
      const double r0 = grid.radii[at], r1 = grid.radii[at + 1];
      const double z0 = -grid.depths[below + 1], z1 = -grid.depths[below];
      Element element{{node(c, k + 1), node(c + 1, k + 1), node(c + 1, k), node(c, k)}, {}, 0.0};
      const double place = 1.0 / std::sqrt(3.0);
      for (std::size_t q = 0; q < 4; ++q) {
        const double x = q == 0 || q == 3 ? -place : place, y = q < 2 ? -place : place;
        const double r = 0.5 * (r0 + r1) + 0.5 * x * (r1 - r0);
        Point& point = element.points[q];
        point.weight = 2.0 * std::numbers::pi * r * 0.25 * (r1 - r0) * (z1 - z0);
        element.volume += point.weight;
        for (std::size_t a = 0; a < 4; ++a) {
          const double sx = a == 0 || a == 3 ? -1.0 : 1.0, sy = a < 2 ? -1.0 : 1.0;
          point.by_r[a] = 0.25 * sx * (1.0 + sy * y) * 2.0 / (r1 - r0);
          point.by_z[a] = 0.25 * sy * (1.0 + sx * x) * 2.0 / (z1 - z0);
          point.over_r[a] = 0.25 * (1.0 + sx * x) * (1.0 + sy * y) / r;
        }
      }
      elements_.push_back(element);
    }
  for (int c = 0; c < columns_; ++c)
    for (int k = 0; k < rows_; ++k) {
      const bool far = c == columns_ - 1 || k == rows_ - 1;
      if (far || c == 0) held_.push_back(dof(node(c, k), 0));
      if (far) held_.push_back(dof(node(c, k), 1));
    }
  double begin = 0.0;
  for (const double end : ring_ends) {
    std::vector<double> weights(static_cast<std::size_t>(columns_), 0.0);
    for (int c = 0; c + 1 < columns_; ++c) {
      const auto at = static_cast<std::size_t>(c);
      const double r0 = grid.radii[at], r1 = grid.radii[at + 1];
      const double low = std::max(r0, begin), high = std::min(r1, end);
      if (!(high > low)) continue;
      // The mean over the ring of a linear function, weighted by r: exact by Simpson's rule.
      for (const auto& [r, part] :
           {std::pair(low, 1.0), std::pair(0.5 * (low + high), 4.0), std::pair(high, 1.0)}) {
        const double weight = part / 6.0 * (high - low) * 2.0 * r / (end * end - begin * begin);
        weights[at] += weight * (r1 - r) / (r1 - r0);
        weights[at + 1] += weight * (r - r0) / (r1 - r0);
      }
    }
    shares_.emplace_back();
    for (int c = 0; c < columns_; ++c)
      if (weights[static_cast<std::size_t>(c)] > 0.0)
        shares_.back().push_back({node(c, 0), weights[static_cast<std::size_t>(c)]});
    begin = end;
  }
  const auto n = static_cast<std::size_t>(2 * nodes());
  unknowns_ = static_cast<int>(n - held_.size());
  u_.resize(n);
  residual_.resize(n);
  step_.resize(n);
  band_.resize(n * static_cast<std::size_t>(width_ + 1));
  solved_.resize(n * static_cast<std::size_t>(sides_));
  reset();
}

void AxialTissue::reset() noexcept {
  std::fill(u_.begin(), u_.end(), 0.0);
}

AxialTissue::RingVector AxialTissue::mean(int component) const noexcept {
  RingVector out = RingVector::Zero(rings());
  for (int j = 0; j < rings(); ++j)
    for (const Share& share : shares_[static_cast<std::size_t>(j)])
      out[j] += share.weight * u_[static_cast<std::size_t>(dof(share.node, component))];
  return out;
}

void AxialTissue::add_element(const Element& element) noexcept {
  // Entries of F that an axisymmetric motion has: rr, rz, hoop, zr, zz.
  constexpr int kRow[5] = {0, 0, 1, 2, 2}, kColumn[5] = {0, 2, 1, 0, 2};
  std::array<double, 4> ur, uz;
  for (std::size_t a = 0; a < 4; ++a) {
    ur[a] = u_[static_cast<std::size_t>(dof(element.nodes[a], 0))];
    uz[a] = u_[static_cast<std::size_t>(dof(element.nodes[a], 1))];
  }
  const auto gradient = [&](const Point& point) {
    Mat3 f = Mat3::Identity();
    for (std::size_t a = 0; a < 4; ++a) {
      f(0, 0) += point.by_r[a] * ur[a];
      f(0, 2) += point.by_z[a] * ur[a];
      f(1, 1) += point.over_r[a] * ur[a];
      f(2, 0) += point.by_r[a] * uz[a];
      f(2, 2) += point.by_z[a] * uz[a];
    }
    return f;
  };
  const std::array<HyperelasticPoint, 4> states{
      HyperelasticPoint(model_, 1.0, gradient(element.points[0])),
      HyperelasticPoint(model_, 1.0, gradient(element.points[1])),
      HyperelasticPoint(model_, 1.0, gradient(element.points[2])),
      HyperelasticPoint(model_, 1.0, gradient(element.points[3]))};
  double theta = 0.0;
  for (std::size_t q = 0; q < 4; ++q) {
    theta += element.points[q].weight * states[q].theta();
    energy_ += element.points[q].weight * states[q].shear_energy();
    if (model_ == HyperelasticModel::kNeoHookean)
      least_volume_ = std::min(least_volume_, states[q].theta());
  }
  const VolumeEnergy volume(model_, lambda_, theta / element.volume);
  energy_ += element.volume * volume.value;

  double stiffness[8][8] = {}, force[8] = {}, dilation[8] = {};
  for (std::size_t q = 0; q < 4; ++q) {
    const Point& point = element.points[q];
    const HyperelasticPoint& at = states[q];
    double tangent[5][5], stress[5], slope[5];
    for (int i = 0; i < 5; ++i) {
      stress[i] = point.weight * at.shear_stress()(kRow[i], kColumn[i]);
      slope[i] = point.weight * at.theta_slope()(kRow[i], kColumn[i]);
      for (int j = 0; j <= i; ++j)
        tangent[i][j] = tangent[j][i] =
            point.weight *
            (at.shear_tangent(kRow[i], kColumn[i], kRow[j], kColumn[j]) +
             volume.slope * at.theta_curvature(kRow[i], kColumn[i], kRow[j], kColumn[j]));
    }
    for (std::size_t b = 0; b < 4; ++b) {
      const double x = point.by_r[b], z = point.by_z[b], h = point.over_r[b];
      double by_ur[5], by_uz[5];
      for (int i = 0; i < 5; ++i) {
        by_ur[i] = tangent[i][0] * x + tangent[i][1] * z + tangent[i][2] * h;
        by_uz[i] = tangent[i][3] * x + tangent[i][4] * z;
      }
      force[2 * b] += stress[0] * x + stress[1] * z + stress[2] * h;
      force[2 * b + 1] += stress[3] * x + stress[4] * z;
      dilation[2 * b] += slope[0] * x + slope[1] * z + slope[2] * h;
      dilation[2 * b + 1] += slope[3] * x + slope[4] * z;
      for (std::size_t a = b; a < 4; ++a) {
        const double xa = point.by_r[a], za = point.by_z[a], ha = point.over_r[a];
        stiffness[2 * a][2 * b] += by_ur[0] * xa + by_ur[1] * za + by_ur[2] * ha;
        stiffness[2 * a + 1][2 * b] += by_ur[3] * xa + by_ur[4] * za;
        stiffness[2 * a][2 * b + 1] += by_uz[0] * xa + by_uz[1] * za + by_uz[2] * ha;
        stiffness[2 * a + 1][2 * b + 1] += by_uz[3] * xa + by_uz[4] * za;
      }
    }
  }
  const double rank_one = volume.curvature / element.volume;
  for (std::size_t i = 0; i < 8; ++i) {
    const int row = dof(element.nodes[i / 2], static_cast<int>(i % 2));
    residual_[static_cast<std::size_t>(row)] += force[i] + volume.slope * dilation[i];
    for (std::size_t j = 0; j <= i; ++j) {
      const int column = dof(element.nodes[j / 2], static_cast<int>(j % 2));
      const double entry = stiffness[i][j] + rank_one * dilation[i] * dilation[j];
      band(std::max(row, column), std::min(row, column)) += entry;
    }
  }
}

void AxialTissue::assemble() noexcept {
  std::fill(band_.begin(), band_.end(), 0.0);
  std::fill(residual_.begin(), residual_.end(), 0.0);
  energy_ = 0.0;
  least_volume_ = 1.0;
  for (const Element& element : elements_) add_element(element);
}

/// Takes a row and column out of the matrix.
void AxialTissue::hold(int at) noexcept {
  const int n = 2 * nodes();
  for (int j = std::max(0, at - width_); j < at; ++j) band(at, j) = 0.0;
  for (int i = at + 1; i <= std::min(n - 1, at + width_); ++i) band(i, at) = 0.0;
  band(at, at) = 1.0;
}

bool AxialTissue::linearise(const RingVector& load, const RingVector& load_slope) noexcept {
  assemble();
  const int n = 2 * nodes(), g = rings();
  const auto side = [&](int at) { return solved_.data() + at * sides_; };
  std::fill(solved_.begin(), solved_.end(), 0.0);
  for (int i = 0; i < n; ++i) side(i)[2 * g] = -residual_[static_cast<std::size_t>(i)];
  for (int j = 0; j < g; ++j) {
    const auto& nodes_of = shares_[static_cast<std::size_t>(j)];
    for (const Share& share : nodes_of) {
      side(dof(share.node, 1))[j] -= share.weight;
      side(dof(share.node, 0))[g + j] += share.weight;
      side(dof(share.node, 0))[2 * g] += share.weight * load[j];
      for (const Share& other : nodes_of)
        if (other.node <= share.node)
          band(dof(share.node, 0), dof(other.node, 0)) -=
              load_slope[j] * share.weight * other.weight;
    }
  }
  for (const int at : held_) {
    hold(at);
    std::fill_n(side(at), sides_, 0.0);
  }
  if (!band_cholesky(band_.data(), n, width_)) return false;
  forward(band_.data(), n, width_, solved_.data(), sides_);
  backward(band_.data(), n, width_, solved_.data(), sides_);
  // How far pressures q, loads dp and what is left of the residual move the rings:
  //   v = v0 + compliance q + lift dp + free,   lateral = lateral0 + lift^T q + aside dp + slack.
  RingMatrix compliance = RingMatrix::Zero(g, g), aside = RingMatrix::Zero(g, g);
  RingVector slack = RingVector::Zero(g);
  lift_.setZero(g, g);
  free_.setZero(g);
  for (int j = 0; j < g; ++j)
    for (const Share& share : shares_[static_cast<std::size_t>(j)]) {
      const double *down = side(dof(share.node, 1)), *out = side(dof(share.node, 0));
      for (int b = 0; b < g; ++b) {
        compliance(j, b) -= share.weight * down[b];
        lift_(j, b) -= share.weight * down[g + b];
        aside(j, b) += share.weight * out[g + b];
      }
      free_[j] -= share.weight * down[2 * g];
      slack[j] += share.weight * out[2 * g];
    }
  // With v given, q is what holds it there.
  if (!invert(compliance)) return false;
  linear_.stiffness = compliance;
  linear_.reaction = -compliance.lazyProduct(free_);
  linear_.cross = lift_.transpose().lazyProduct(compliance);
  linear_.yield = aside - linear_.cross.lazyProduct(lift_);
  linear_.lateral = lateral() + slack - linear_.cross.lazyProduct(free_);
  return linear_.reaction.allFinite() && linear_.stiffness.allFinite() &&
         linear_.lateral.allFinite() && std::isfinite(energy_);
}

double AxialTissue::advance(const RingVector& dv, const RingVector& dp, double farthest,
                            double& share) noexcept {
  const int n = 2 * nodes(), g = rings();
  RingVector wanted = dv - free_;
  wanted -= lift_.lazyProduct(dp);
  const RingVector q = linear_.stiffness.lazyProduct(wanted);
  double most = 0.0;
  for (int i = 0; i < n; ++i) {
    const double* at = solved_.data() + i * sides_;
    double sum = at[2 * g];
    for (int a = 0; a < g; ++a) sum += at[a] * q[a] + at[g + a] * dp[a];
    step_[static_cast<std::size_t>(i)] = sum;
    most = std::max(most, std::abs(sum));
  }
  share = most > farthest ? farthest / most : 1.0;
  for (std::size_t i = 0; i < step_.size(); ++i) u_[i] += share * step_[i];
  return most;
}

}  // namespace viscera
