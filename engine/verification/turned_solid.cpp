#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <map>
#include <numbers>

#include "engine/verification/reference_solid.h"

namespace viscera {
namespace {

/// What is in contact yields by this much under a pressure of 1, in units of the body's size.
constexpr double kYield = 1e-5;
constexpr int kMostRounds = 60;

struct Edge {
  std::array<int, 3> nodes;
  Vec2 inside;  ///< a place on the body's side
};

/// Edges of one element alone.
std::vector<Edge> outline(const QuadMesh& mesh) {
  constexpr int kEdges[4][3] = {{0, 1, 2}, {6, 7, 8}, {0, 3, 6}, {2, 5, 8}};
  std::map<std::array<int, 2>, std::pair<int, Edge>> found;
  for (const auto& element : mesh.elements)
    for (const auto& edge : kEdges) {
      const auto at = [&](int i) { return element[static_cast<std::size_t>(edge[i])]; };
      if (at(0) == at(2)) continue;  // drawn together into one place
      auto& entry = found[{std::min(at(0), at(2)), std::max(at(0), at(2))}];
      ++entry.first;
      entry.second = {{at(0), at(1), at(2)}, mesh.nodes[static_cast<std::size_t>(element[4])]};
    }
  std::vector<Edge> edges;
  for (const auto& [ends, entry] : found)
    if (entry.first == 1) edges.push_back(entry.second);
  return edges;
}

class TurnedSolid final : public ReferenceSolid {
 public:
  TurnedSolid(QuadMesh mesh, double poisson_ratio)
      : mesh_(std::move(mesh)), edges_(outline(mesh_)) {
    for (const Vec2& x : mesh_.nodes) {
      nodes_.emplace_back(x.x(), 0.0, x.y());
      size_ = std::max(size_, x.cwiseAbs().maxCoeff());
    }
    assemble(poisson_ratio);
  }

  const std::vector<Vec3>& nodes() const override { return nodes_; }

  Result<SolidAnswer> solve(const SolidConditions& conditions) const override {
    const auto count = static_cast<Eigen::Index>(2 * nodes_.size());
    std::vector<int> place(static_cast<std::size_t>(count), -1);
    VectorX wanted = VectorX::Zero(count), load = VectorX::Zero(count);
    int free = 0;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      std::array<bool, 3> held = conditions.held(nodes_[n]);
      held[0] = held[0] || nodes_[n].x() < 1e-9 * size_;
      const Vec3 to = conditions.displacement ? conditions.displacement(nodes_[n]) : Vec3::Zero();
      for (std::size_t c = 0; c < 2; ++c) {
        const std::size_t unknown = 2 * n + c;
        if (held[2 * c])
          wanted[static_cast<Eigen::Index>(unknown)] = c == 0 ? to.x() : to.z();
        else
          place[unknown] = free++;
      }
    }
    SolidAnswer answer;
    if (conditions.pressure) add_pressure(conditions, load, answer.force);

    const std::vector<ContactPoint> points = contact_points(conditions);
    std::vector<char> touching(points.size(), 1);
    VectorX u;
    answer.converged = false;
    for (int round = 0; round < kMostRounds && !answer.converged; ++round) {
      auto solved = solve_linear(place, free, wanted, load, points, touching);
      if (!solved) return std::unexpected(solved.error());
      u = *std::move(solved);
      answer.converged = true;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const bool presses = points[k].gap(u) < 0.0;
        answer.converged = answer.converged && presses == (touching[k] != 0);
        touching[k] = presses;
      }
    }
    for (std::size_t k = 0; k < points.size(); ++k)
      if (touching[k]) answer.force -= points[k].stiffness(size_) * points[k].gap(u);
    if (conditions.is_tool) {
      const VectorX reaction = stiffness_ * u;
      for (std::size_t n = 0; n < nodes_.size(); ++n)
        if (conditions.is_tool(nodes_[n]))
          answer.force -= reaction[static_cast<Eigen::Index>(2 * n + 1)];
    }
    for (std::size_t n = 0; n < nodes_.size(); ++n)
      answer.displacements.emplace_back(u[static_cast<Eigen::Index>(2 * n)], 0.0,
                                        u[static_cast<Eigen::Index>(2 * n + 1)]);
    return answer;
  }

 private:
  struct ContactPoint {
    std::array<int, 3> nodes;
    std::array<double, 3> shares;
    double area, depth;
    /// Negative: so far is the tool in the surface.
    double gap(const VectorX& u) const {
      double down = -depth;
      for (std::size_t a = 0; a < 3; ++a) down -= shares[a] * u[2 * nodes[a] + 1];
      return down;
    }
    double stiffness(double size) const { return area / (kYield * size); }
  };

  template <class Body>
  void each_edge_point(const SolidConditions& conditions, int parts, const Body& body) const {
    for (const Edge& edge : edges_) {
      const auto at = [&](std::size_t i) {
        return mesh_.nodes[static_cast<std::size_t>(edge.nodes[i])];
      };
      if (!conditions.is_loaded || !conditions.is_loaded({at(1).x(), 0.0, at(1).y()})) continue;
      for (int part = 0; part < parts; ++part)
        for (std::size_t p = 0; p < 3; ++p) {
          const double t = -1.0 + (2.0 * part + 1.0 + kGaussPlaces[p]) / parts;
          const auto value = quadratics(t), slope = quadratic_slopes(t);
          Vec2 x = Vec2::Zero(), along = Vec2::Zero();
          for (std::size_t a = 0; a < 3; ++a) {
            x += value[a] * at(a);
            along += slope[a] * at(a);
          }
          const double area =
              2.0 * std::numbers::pi * x.x() * along.norm() * kGaussWeights[p] / parts;
          Vec2 inward = Vec2(-along.y(), along.x()).normalized();
          if (inward.dot(edge.inside - x) < 0.0) inward = -inward;
          body(edge, value, x, area, inward);
        }
    }
  }

  void add_pressure(const SolidConditions& conditions, VectorX& load, double& force) const {
    each_edge_point(conditions, 4,
                    [&](const Edge& edge, const std::array<double, 3>& value, const Vec2& x,
                        double area, const Vec2& inward) {
                      const Vec2 f = area * conditions.pressure({x.x(), 0.0, x.y()}) * inward;
                      for (std::size_t a = 0; a < 3; ++a)
                        load.segment<2>(2 * edge.nodes[a]) += value[a] * f;
                      force -= f.y();
                    });
  }

  std::vector<ContactPoint> contact_points(const SolidConditions& conditions) const {
    std::vector<ContactPoint> points;
    if (!conditions.depth) return points;
    each_edge_point(conditions, 2,
                    [&](const Edge& edge, const std::array<double, 3>& value, const Vec2& x,
                        double area, const Vec2&) {
                      const double depth = conditions.depth({x.x(), 0.0, x.y()});
                      // What the tool is far from at rest doesn't rise to it.
                      if (depth > -0.05 * size_) points.push_back({edge.nodes, value, area, depth});
                    });
    return points;
  }

  Result<VectorX> solve_linear(const std::vector<int>& place, int free, const VectorX& wanted,
                               const VectorX& load, const std::vector<ContactPoint>& points,
                               const std::vector<char>& touching) const {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(static_cast<std::size_t>(stiffness_.nonZeros()));
    const VectorX known = stiffness_ * wanted;
    VectorX right(free);
    for (std::size_t i = 0; i < place.size(); ++i)
      if (place[i] >= 0)
        right[place[i]] = load[static_cast<Eigen::Index>(i)] - known[static_cast<Eigen::Index>(i)];
    const auto add = [&](std::size_t i, std::size_t j, double value) {
      if (place[i] >= 0 && place[j] >= 0 && place[i] >= place[j])
        entries.emplace_back(place[i], place[j], value);
    };
    for (int column = 0; column < stiffness_.outerSize(); ++column)
      for (Eigen::SparseMatrix<double>::InnerIterator it(stiffness_, column); it; ++it)
        add(static_cast<std::size_t>(it.row()), static_cast<std::size_t>(column), it.value());
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (!touching[k]) continue;
      const ContactPoint& point = points[k];
      const double stiffness = point.stiffness(size_);
      for (std::size_t a = 0; a < 3; ++a) {
        const auto row = static_cast<std::size_t>(2 * point.nodes[a] + 1);
        if (place[row] >= 0) right[place[row]] -= stiffness * point.shares[a] * point.depth;
        for (std::size_t b = 0; b < 3; ++b)
          add(row, static_cast<std::size_t>(2 * point.nodes[b] + 1),
              stiffness * point.shares[a] * point.shares[b]);
      }
    }
    Eigen::SparseMatrix<double> reduced(free, free);
    reduced.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(reduced);
    if (factor.info() != Eigen::Success)
      return failure("reference solid: the stiffness can't be factored; is the body held?");
    const VectorX solved = factor.solve(right);
    VectorX u = wanted;
    for (std::size_t i = 0; i < place.size(); ++i)
      if (place[i] >= 0) u[static_cast<Eigen::Index>(i)] = solved[place[i]];
    if (!u.allFinite()) return failure("reference solid: found no finite solution");
    return u;
  }

  void assemble(double poisson_ratio) {
    const double lambda = poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
    const double mu = 0.5 / (1.0 + poisson_ratio);
    Eigen::Matrix4d elasticity = Eigen::Matrix4d::Zero();
    elasticity.topLeftCorner<3, 3>().setConstant(lambda);
    elasticity.diagonal() += Vec4(2.0 * mu, 2.0 * mu, 2.0 * mu, mu);
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(324 * mesh_.elements.size());
    for (const auto& nodes : mesh_.elements) {
      Eigen::Matrix<double, 18, 18> element = Eigen::Matrix<double, 18, 18>::Zero();
      for (std::size_t p = 0; p < 3; ++p)
        for (std::size_t q = 0; q < 3; ++q) {
          const auto ni = quadratics(kGaussPlaces[p]), nj = quadratics(kGaussPlaces[q]);
          const auto di = quadratic_slopes(kGaussPlaces[p]), dj = quadratic_slopes(kGaussPlaces[q]);
          Eigen::Matrix2d jacobian = Eigen::Matrix2d::Zero();
          double r = 0.0;
          for (std::size_t k = 0; k < 9; ++k) {
            const Vec2 x = mesh_.nodes[static_cast<std::size_t>(nodes[k])];
            jacobian.row(0) += di[k / 3] * nj[k % 3] * x.transpose();
            jacobian.row(1) += ni[k / 3] * dj[k % 3] * x.transpose();
            r += ni[k / 3] * nj[k % 3] * x.x();
          }
          const Eigen::Matrix2d inverse = jacobian.inverse();
          const double weight = 2.0 * std::numbers::pi * r * std::abs(jacobian.determinant()) *
                                kGaussWeights[p] * kGaussWeights[q];
          // Strains: radial, axial, hoop, shear.
          Eigen::Matrix<double, 4, 18> strain = Eigen::Matrix<double, 4, 18>::Zero();
          for (std::size_t k = 0; k < 9; ++k) {
            const Vec2 slope = inverse * Vec2(di[k / 3] * nj[k % 3], ni[k / 3] * dj[k % 3]);
            const auto column = static_cast<Eigen::Index>(2 * k);
            strain(0, column) = slope.x();
            strain(1, column + 1) = slope.y();
            strain(2, column) = ni[k / 3] * nj[k % 3] / r;
            strain(3, column) = slope.y();
            strain(3, column + 1) = slope.x();
          }
          element += weight * strain.transpose() * elasticity * strain;
        }
      for (int k = 0; k < 18; ++k)
        for (int l = 0; l < 18; ++l)
          entries.emplace_back(2 * nodes[static_cast<std::size_t>(k / 2)] + k % 2,
                               2 * nodes[static_cast<std::size_t>(l / 2)] + l % 2, element(k, l));
    }
    const auto count = static_cast<Eigen::Index>(2 * nodes_.size());
    stiffness_.resize(count, count);
    stiffness_.setFromTriplets(entries.begin(), entries.end());
  }

  QuadMesh mesh_;
  std::vector<Edge> edges_;
  std::vector<Vec3> nodes_;
  double size_ = 0.0;
  Eigen::SparseMatrix<double> stiffness_;
};

}  // namespace

std::unique_ptr<ReferenceSolid> turned_solid(QuadMesh mesh, double poisson_ratio) {
  return std::make_unique<TurnedSolid>(std::move(mesh), poisson_ratio);
}

}  // namespace viscera
