#include "engine/features/contact/tissue_as_met.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <optional>

namespace viscera {
namespace {

/// Where no cells of the tool are: the motion of the drawn surface over this many mean spacings of
/// its vertices about the foot, and at least so many radii of the tool.
constexpr double kSpacingsAbout = 2.0, kRadiiAbout = 1.5;
/// A fit with less spread across the foot than this, over that along it, knows no slope there.
constexpr double kLeastSpread = 1e-3;
/// Holds count out to so many times the width of the cells that they were found at.
constexpr double kHoldReach = 2.0;

/// Values over places about a foot, to first order: value(x) = sum_i (1, a, b)_i coefficient_i.
class FirstOrder {
 public:
  FirstOrder(std::span<const Vec3> places, const Vec3& normal) : normal_(normal.normalized()) {
    for (const Vec3& place : places) centre_ += place;
    centre_ /= static_cast<double>(places.size());
    along_x_ = normal_.unitOrthogonal();
    along_y_ = normal_.cross(along_x_);
    const auto n = static_cast<Eigen::Index>(places.size());
    MatrixX basis(n, 3);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vec3 off = places[static_cast<std::size_t>(k)] - centre_;
      basis.row(k) << 1.0, off.dot(along_x_), off.dot(along_y_);
      width_ = std::max(width_, off.norm());
    }
    const Mat3 gram = basis.transpose() * basis;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> spread(gram.bottomRightCorner<2, 2>());
    const bool flat = n >= 3 && spread.eigenvalues()[0] >
                                    kLeastSpread * std::max(spread.eigenvalues()[1], 1e-300);
    fit_ = MatrixX::Zero(3, n);
    if (flat)
      fit_ = gram.inverse() * basis.transpose();
    else
      fit_.row(0).setConstant(1.0 / static_cast<double>(n));
  }

  const Vec3& centre() const { return centre_; }
  const Vec3& along_x() const { return along_x_; }
  const Vec3& along_y() const { return along_y_; }
  double width() const { return width_; }
  const MatrixX& fit() const { return fit_; }  ///< coefficients from values, 3 x n

  /// The rigid motion nearest to x -> x + u(x).
  Pose motion(std::span<const Vec3> displacements) const {
    Mat3 coefficients = Mat3::Zero();  // a column each
    for (std::size_t k = 0; k < displacements.size(); ++k)
      coefficients += displacements[k] * fit_.col(static_cast<Eigen::Index>(k)).transpose();
    Mat3 rest, moved;
    rest << along_x_, along_y_, normal_;
    moved.col(0) = along_x_ + coefficients.col(1);
    moved.col(1) = along_y_ + coefficients.col(2);
    moved.col(2) = moved.col(0).cross(moved.col(1)).normalized();
    const Eigen::JacobiSVD<Mat3> parts(moved * rest.transpose(),
                                       Eigen::ComputeFullU | Eigen::ComputeFullV);
    Mat3 turn = parts.matrixU() * parts.matrixV().transpose();
    if (!turn.allFinite() || turn.determinant() < 0.0) turn = Mat3::Identity();
    Pose pose;
    pose.orientation = Quaternion(turn).normalized();
    pose.position = centre_ + coefficients.col(0) - pose.orientation * centre_;
    return pose;
  }

  /// A response among the places, (3 n) x (3 n), as the holds' share in it; seen in the frame that
  /// `turn` takes to where the response was.
  FootHold hold(const MatrixX& taken, const Quaternion& turn) const {
    const Eigen::Index n = fit_.cols();
    MatrixX weights = MatrixX::Zero(9, 3 * n);
    const Mat3 back = turn.toRotationMatrix().transpose();
    for (Eigen::Index k = 0; k < n; ++k)
      for (Eigen::Index c = 0; c < 3; ++c) weights.block<3, 3>(3 * c, 3 * k) = fit_(c, k) * back;
    const Eigen::Matrix<double, 9, 9> sum = weights * taken * weights.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> modes(0.5 *
                                                                           (sum + sum.transpose()));
    FootHold hold;
    if (modes.info() != Eigen::Success || !sum.allFinite()) return hold;
    hold.centre = centre_;
    hold.along_x = along_x_;
    hold.along_y = along_y_;
    hold.reach = kHoldReach * width_;
    hold.root = modes.eigenvectors() * modes.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
    return hold;
  }

 private:
  Vec3 normal_, centre_ = Vec3::Zero(), along_x_, along_y_;
  double width_ = 0.0;
  MatrixX fit_;
};

Pose composed(const Pose& outer, const Pose& inner) {
  return {outer.to_world(inner.position), (outer.orientation * inner.orientation).normalized()};
}

/// Under a tool that presses or holds: from its cells, since the drawn surface shows its own dent.
/// False: this frame's contact has no answer.
bool meet_touched(World& world, Entity organ, const CellRange& range, TissueSnapshot& snapshot) {
  const OrganContact& contact = *world.find<OrganContact>(organ);
  if (!contact.solution.converged) return false;
  const auto others =
      world.find<OrganTouch>(organ)->solver->hold_of_others(contact.cells, range.begin, range.end);
  if (!others) return false;
  if (others->taken.size() == 0 && !world.find<FreeShape>(organ)) return true;  // it is alone
  std::vector<Vec3> places;
  Vec3 normal = Vec3::Zero();
  for (std::size_t k = range.begin; k < range.end; ++k) {
    places.push_back(contact.cells[k].position);
    normal += contact.cells[k].normal;
  }
  if (!(normal.norm() > 0.0)) return false;
  const FirstOrder about(places, normal);
  const Pose motion = about.motion(others->free);
  snapshot.pose = composed(snapshot.pose, motion);
  if (others->taken.size() > 0) snapshot.hold = about.hold(others->taken, motion.orientation);
  return true;
}

/// Under a tool that doesn't: as the surface is drawn.
void meet_drawn(const World& world, Entity organ, const SurfacePoint& nearest, double radius,
                TissueSnapshot& snapshot) {
  const OrganState& state = *world.find<OrganState>(organ);
  if (!state.deformed || nearest.triangle < 0) return;
  const TriangleSurface& rest = world.find<OrganBody>(organ)->model->surface;
  const Vec3 foot = position(rest, nearest);
  const auto& corners = rest.triangles[static_cast<std::size_t>(nearest.triangle)];
  const auto corner = [&](std::size_t c) -> const Vec3& {
    return rest.vertices[static_cast<std::size_t>(corners[c])];
  };
  const Vec3 across = (corner(1) - corner(0)).cross(corner(2) - corner(0));
  const double edge = std::sqrt(across.norm());
  const double about = std::max(kSpacingsAbout * edge, kRadiiAbout * radius);
  const OrganModel& model = *world.find<OrganBody>(organ)->model;
  std::vector<Vec3> places, displacements;
  for (std::size_t v = 0; v < rest.vertices.size(); ++v) {
    if ((rest.vertices[v] - foot).squaredNorm() > about * about ||
        model.rest_normals[v].cast<double>().dot(across) <= 0.0)
      continue;
    places.push_back(rest.vertices[v]);
    displacements.push_back((state.positions[v] - model.rest_positions[v]).cast<double>());
  }
  if (places.empty()) return;
  snapshot.pose = composed(snapshot.pose, FirstOrder(places, across).motion(displacements));
}

}  // namespace

bool meet_tissue(World& world, Entity organ, Entity instrument, double reach,
                 TissueSnapshot& snapshot) {
  snapshot.pose = pose_of(world, organ);
  snapshot.hold = {};
  snapshot.nearest = {};
  const OrganContact* contact = world.find<OrganContact>(organ);
  if (!contact || world.find<OrganState>(organ)->frozen) return true;
  const Vec3& tip = world.find<InstrumentState>(instrument)->tip;
  // Embree's boxes are fitted again by who asks: not for what is far.
  if (world.find<OrganTouch>(organ)->bounds.exteriorDistance(tip) > reach) return true;
  const auto hit = contact->surface->closest(pose_of(world, organ).to_local(tip), reach);
  if (!hit) return true;
  snapshot.nearest = hit->point;
  for (const CellRange& range : world.find<OrganTouch>(organ)->ranges)
    if (range.instrument == instrument) return meet_touched(world, organ, range, snapshot);
  meet_drawn(world, organ, hit->point, world.find<InstrumentBody>(instrument)->extent, snapshot);
  return true;
}

}  // namespace viscera
