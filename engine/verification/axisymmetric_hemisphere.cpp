#include "engine/verification/axisymmetric_hemisphere.h"

#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/verification/nine_node.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRightAngle = 0.5 * kPi;

/// Displacements (radial, axial) at the nodes of a polar grid.
class Meridian {
 public:
  Meridian(double poisson_ratio, double a_over_R, const AxisymmetricMesh& mesh)
      : poisson_ratio_(poisson_ratio), a_(a_over_R), edge_(std::asin(a_over_R)) {
    const Grading grading{mesh.finest * a_over_R, mesh.growth, mesh.coarsest};
    // Polar angles from the contact's edge to both sides, radii from the surface to the centre.
    std::vector<double> angles;
    for (const double off : graded_borders(edge_, grading))
      angles.insert(angles.begin(), edge_ - off);
    angles.front() = 0.0;
    const auto beyond = graded_borders(kRightAngle - edge_, grading);
    for (std::size_t i = 1; i < beyond.size(); ++i) angles.push_back(edge_ + beyond[i]);
    angles.back() = kRightAngle;
    edge_element_ = graded_borders(edge_, grading).size() - 1;
    std::vector<double> radii;
    for (const double depth : graded_borders(1.0, grading))
      radii.insert(radii.begin(), 1.0 - depth);
    radii.front() = 0.0;
    angles_ = with_middles(angles);
    radii_ = with_middles(radii);
    assemble();
  }

  Result<HemisphereProfile> solve(HemisphereContact contact, double& force) const {
    const std::size_t count = 2 * nodes();
    std::vector<char> fixed(count, 0);
    VectorX wanted = VectorX::Zero(static_cast<Eigen::Index>(count));
    VectorX load = VectorX::Zero(static_cast<Eigen::Index>(count));
    for (std::size_t i = 0; i < angles_.size(); ++i) {
      for (std::size_t j = 0; j < radii_.size(); ++j) {
        const std::size_t node = index(i, j);
        // The centre is a point of the held base.
        if (j == 0 || i + 1 == angles_.size())
          fixed[2 * node] = fixed[2 * node + 1] = 1;
        else if (i == 0)
          fixed[2 * node] = 1;
      }
    }
    const std::size_t surface = radii_.size() - 1, edge_node = 2 * edge_element_;
    // Frictionless: unknowns of the patch are turned, so that the first is along the normal. On the
    // axis the normal is axial and the other unknown is held already.
    std::vector<double> turn(nodes(), 0.0);
    if (contact == HemisphereContact::kPress) {
      add_pressure(load);
    } else {
      for (std::size_t i = 0; i <= edge_node; ++i) {
        const std::size_t node = index(i, surface);
        if (contact == HemisphereContact::kStick || i == 0) {
          fixed[2 * node] = fixed[2 * node + 1] = 1;
          wanted[static_cast<Eigen::Index>(2 * node + 1)] = -kHemisphereDepth;
        } else {
          turn[node] = angles_[i];
          fixed[2 * node + 1] = 1;
          wanted[static_cast<Eigen::Index>(2 * node + 1)] =
              -kHemisphereDepth * std::cos(angles_[i]);
        }
      }
    }

    // u = T v with v the turned unknowns: (tangential, normal), T = [cos sin; -sin cos].
    std::vector<Eigen::Triplet<double>> turning;
    for (std::size_t n = 0; n < nodes(); ++n) {
      const int r = static_cast<int>(2 * n), z = r + 1;
      const double c = std::cos(turn[n]), s = std::sin(turn[n]);
      turning.emplace_back(r, r, c);
      turning.emplace_back(z, z, c);
      if (turn[n] == 0.0) continue;
      turning.emplace_back(r, z, s);
      turning.emplace_back(z, r, -s);
    }
    Eigen::SparseMatrix<double> transform(static_cast<Eigen::Index>(count),
                                          static_cast<Eigen::Index>(count));
    transform.setFromTriplets(turning.begin(), turning.end());
    const Eigen::SparseMatrix<double> stiffness = transform.transpose() * stiffness_ * transform;
    const VectorX known = stiffness * wanted;

    std::vector<int> place(count, -1);
    int free = 0;
    for (std::size_t i = 0; i < count; ++i)
      if (!fixed[i]) place[i] = free++;
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(static_cast<std::size_t>(stiffness.nonZeros()));
    for (int column = 0; column < stiffness.outerSize(); ++column) {
      if (place[static_cast<std::size_t>(column)] < 0) continue;
      for (Eigen::SparseMatrix<double>::InnerIterator it(stiffness, column); it; ++it) {
        const int row = place[static_cast<std::size_t>(it.row())];
        if (row >= place[static_cast<std::size_t>(column)])
          entries.emplace_back(row, place[static_cast<std::size_t>(column)], it.value());
      }
    }
    Eigen::SparseMatrix<double> reduced(free, free);
    reduced.setFromTriplets(entries.begin(), entries.end());
    VectorX right(free);
    for (std::size_t i = 0; i < count; ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      if (place[i] >= 0) right[place[i]] = load[at] - known[at];
    }
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(reduced);
    if (factor.info() != Eigen::Success)
      return failure("axisymmetric hemisphere: the stiffness can't be factored");
    const VectorX solved = factor.solve(right);
    VectorX turned = wanted;
    for (std::size_t i = 0; i < count; ++i)
      if (place[i] >= 0) turned[static_cast<Eigen::Index>(i)] = solved[place[i]];
    const VectorX u = transform * turned;

    const VectorX reaction = stiffness_ * u;
    force = 0.0;
    if (contact == HemisphereContact::kPress) {
      for (std::size_t n = 0; n < nodes(); ++n) force -= load[static_cast<Eigen::Index>(2 * n + 1)];
    } else {
      for (std::size_t i = 0; i <= edge_node; ++i)
        force -= reaction[static_cast<Eigen::Index>(2 * index(i, surface) + 1)];
      force /= kHemisphereDepth;
    }
    std::vector<HemisphereProfile::Row> rows;
    for (std::size_t i = 0; i < angles_.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(2 * index(i, surface));
      rows.push_back({angles_[i], u[at], u[at + 1]});
    }
    return HemisphereProfile(std::move(rows));
  }

 private:
  std::size_t nodes() const { return angles_.size() * radii_.size(); }
  std::size_t index(std::size_t i, std::size_t j) const { return i * radii_.size() + j; }
  Vec2 place(std::size_t i, std::size_t j) const {
    return radii_[j] * Vec2(std::sin(angles_[i]), std::cos(angles_[i]));
  }

  void assemble() {
    const double lambda = poisson_ratio_ / ((1.0 + poisson_ratio_) * (1.0 - 2.0 * poisson_ratio_));
    const double mu = 0.5 / (1.0 + poisson_ratio_);
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t i = 0; i + 2 < angles_.size(); i += 2) {
      for (std::size_t j = 0; j + 2 < radii_.size(); j += 2) {
        Eigen::Matrix<double, 18, 18> element = Eigen::Matrix<double, 18, 18>::Zero();
        for (std::size_t p = 0; p < 3; ++p) {
          for (std::size_t q = 0; q < 3; ++q) {
            const auto na = quadratics(kGaussPlaces[p]), nr = quadratics(kGaussPlaces[q]);
            const auto da = quadratic_slopes(kGaussPlaces[p]),
                       dr = quadratic_slopes(kGaussPlaces[q]);
            Eigen::Matrix2d jacobian = Eigen::Matrix2d::Zero();  // rows: d/dangle, d/dradius
            double r = 0.0;
            for (std::size_t a = 0; a < 3; ++a) {
              for (std::size_t b = 0; b < 3; ++b) {
                const Vec2 x = place(i + a, j + b);
                jacobian.row(0) += da[a] * nr[b] * x.transpose();
                jacobian.row(1) += na[a] * dr[b] * x.transpose();
                r += na[a] * nr[b] * x[0];
              }
            }
            const Eigen::Matrix2d inverse = jacobian.inverse();
            const double weight = 2.0 * kPi * r * std::abs(jacobian.determinant()) *
                                  kGaussWeights[p] * kGaussWeights[q];
            // Strains: radial, axial, hoop, shear.
            Eigen::Matrix<double, 4, 18> strain = Eigen::Matrix<double, 4, 18>::Zero();
            for (std::size_t a = 0; a < 3; ++a) {
              for (std::size_t b = 0; b < 3; ++b) {
                const Vec2 slope = inverse * Vec2(da[a] * nr[b], na[a] * dr[b]);
                const auto column = static_cast<Eigen::Index>(2 * (3 * a + b));
                strain(0, column) = slope[0];
                strain(1, column + 1) = slope[1];
                strain(2, column) = na[a] * nr[b] / r;
                strain(3, column) = slope[1];
                strain(3, column + 1) = slope[0];
              }
            }
            Eigen::Matrix4d elasticity = Eigen::Matrix4d::Zero();
            elasticity.topLeftCorner<3, 3>().setConstant(lambda);
            elasticity.diagonal() += Vec4(2.0 * mu, 2.0 * mu, 2.0 * mu, mu);
            element += weight * strain.transpose() * elasticity * strain;
          }
        }
        const auto unknown = [&](int k) {
          const auto node = static_cast<std::size_t>(k / 2);
          return static_cast<int>(2 * index(i + node / 3, j + node % 3)) + k % 2;
        };
        for (int k = 0; k < 18; ++k)
          for (int l = 0; l < 18; ++l) entries.emplace_back(unknown(k), unknown(l), element(k, l));
      }
    }
    const auto count = static_cast<Eigen::Index>(2 * nodes());
    stiffness_.resize(count, count);
    stiffness_.setFromTriplets(entries.begin(), entries.end());
  }

  void add_pressure(VectorX& load) const {
    const std::size_t surface = radii_.size() - 1;
    for (std::size_t e = 0; e < edge_element_; ++e) {
      for (std::size_t p = 0; p < 3; ++p) {
        const auto n = quadratics(kGaussPlaces[p]), d = quadratic_slopes(kGaussPlaces[p]);
        Vec2 x = Vec2::Zero(), along = Vec2::Zero();
        for (std::size_t a = 0; a < 3; ++a) {
          x += n[a] * place(2 * e + a, surface);
          along += d[a] * place(2 * e + a, surface);
        }
        const double fall = 1.0 - x[0] * x[0] / (a_ * a_);
        const Vec2 force =
            -fall * fall * 2.0 * kPi * x[0] * along.norm() * kGaussWeights[p] * x.normalized();
        for (std::size_t a = 0; a < 3; ++a)
          load.segment<2>(static_cast<Eigen::Index>(2 * index(2 * e + a, surface))) += n[a] * force;
      }
    }
  }

  double poisson_ratio_, a_, edge_;
  std::size_t edge_element_ = 0;  // number of elements within the contact
  std::vector<double> angles_, radii_;
  Eigen::SparseMatrix<double> stiffness_;
};

}  // namespace

Result<HemisphereReference> solve_axisymmetric_hemisphere(double poisson_ratio, double a_over_R,
                                                          const AxisymmetricMesh& mesh) {
  if (!(poisson_ratio >= 0.0 && poisson_ratio < 0.5) || !(a_over_R > 0.0 && a_over_R <= 0.9)) {
    return failure(fmt::format(
        "axisymmetric hemisphere: found Poisson's ratio {:g} and a / R {:g}, expected from 0 to "
        "below 0.5 and above 0 to 0.9",
        poisson_ratio, a_over_R));
  }
  const Meridian meridian(poisson_ratio, a_over_R, mesh);
  HemisphereReference reference;
  reference.poisson_ratio = poisson_ratio;
  reference.a_over_R = a_over_R;
  for (const HemisphereContact contact : kHemisphereContacts) {
    double force = 0.0;
    auto profile = meridian.solve(contact, force);
    if (!profile) return std::unexpected(profile.error());
    reference.profiles[static_cast<std::size_t>(contact)] = std::move(*profile);
    (contact == HemisphereContact::kStick          ? reference.stick
     : contact == HemisphereContact::kFrictionless ? reference.frictionless
                                                   : reference.pressure_force) = force;
  }
  return reference;
}

}  // namespace viscera
