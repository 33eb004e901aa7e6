#include "kernels/hive/hive_contact.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/contact/facing.h"

namespace viscera {
namespace {

/// Cells within this share of a hive's usable radius of the first of them stand on one hive: the
/// first is a pattern's middle, and about it all of a tool's lie.
constexpr double kTogether = 0.8;
/// A hive tells of the whole surface, but far from the cells its half-space isn't the body any
/// more: between these distances from its centre [radii of the hive] what it says fades out.
constexpr double kFadesFrom = 2.0, kFadesTo = 4.0;
/// Surface that faces away from the cells' side belongs to another side of the body.
constexpr double kFacesAway = -0.2;

double disc_radius(double area) {
  return std::sqrt(area / std::numbers::pi);
}

double fading(double distance, double radius) {
  const double s = std::clamp((kFadesTo - distance / radius) / (kFadesTo - kFadesFrom), 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}

/// The least compliance of any pattern of forces, over the greatest; chosen by eye.
constexpr double kLeastCompliance = 1e-2;

/// Forces must do work on what they press. Half-spaces under normals that turn, each cut off where
/// the surface faces away, promise it for a few cells alone: patterns of forces that would be given
/// work, or next to none asked for, become as stiff as may be.
void make_positive(MatrixX& response) {
  const MatrixX symmetric = 0.5 * (response + response.transpose());
  if (symmetric.llt().info() == Eigen::Success) return;
  const Eigen::SelfAdjointEigenSolver<MatrixX> modes(symmetric);
  const double least = kLeastCompliance * modes.eigenvalues().maxCoeff();
  response = modes.eigenvectors() * modes.eigenvalues().cwiseMax(least).asDiagonal() *
             modes.eigenvectors().transpose();
}

}  // namespace

HiveContact::HiveContact(const WalkableSurface& surface, const HiveSettings& settings, Hive first)
    : TissueContact(true), surface_(surface), settings_(settings), half_space_(settings.material) {
  hives_.push_back(std::move(first));
  stands_.push_back(0);
}

Result<std::unique_ptr<HiveContact>> HiveContact::create(const WalkableSurface& surface,
                                                         HiveSettings settings) {
  settings.formulation = HiveFormulation::kSubtracted;
  settings.periphery = HivePeriphery::kBoussinesq;
  auto first = Hive::create({&surface, nullptr, nullptr}, settings, 1);
  if (!first) return std::unexpected(first.error());
  return std::unique_ptr<HiveContact>(new HiveContact(surface, settings, std::move(*first)));
}

bool HiveContact::fits(const State& state) const {
  return is_sound(state, 0, 0) && state.columns_built == 0;
}

NearField HiveContact::any_near_field() const {
  return {settings_.material, settings_.radius};
}

void HiveContact::gather_clusters() {
  clusters_.clear();
  const std::vector<Place>& places = state_.places;
  std::vector<Vec3> seeds;
  const double together = kTogether * hives_.front().usable_radius();
  for (std::size_t k = 0; k < places.size(); ++k) {
    std::size_t c = 0;
    while (c < seeds.size() &&
           ((seeds[c] - places[k].position).norm() > together ||
            facing(places[static_cast<std::size_t>(clusters_[c].cells.front())].normal.dot(
                places[k].normal)) == 0.0))
      ++c;
    if (c == seeds.size()) {
      seeds.push_back(places[k].position);
      clusters_.emplace_back();
    }
    clusters_[c].cells.push_back(static_cast<int>(k));
  }
  without_hive_ = 0;
  // All of them first: a vector that grows moves what is pointed at.
  while (hives_.size() < clusters_.size()) {
    auto more = Hive::create({&surface_, nullptr, nullptr}, settings_, 1);
    if (!more) break;
    hives_.push_back(std::move(*more));
    stands_.push_back(0);
  }
  std::vector<char> taken(hives_.size(), 0);
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    clusters_[c].centre = surface_.nearest(seeds[c]);
    clusters_[c].hive = find_hive(clusters_[c].centre, taken);
  }
  for (Cluster& cluster : clusters_) {
    if (!cluster.hive) cluster.hive = build_hive(cluster.centre, taken);
    if (!cluster.hive) without_hive_ += static_cast<int>(cluster.cells.size());
  }
}

/// One that stands there already: built anew it would be the same to the bit.
Hive* HiveContact::find_hive(const SurfaceSpot& centre, std::vector<char>& taken) {
  for (std::size_t h = 0; h < hives_.size(); ++h) {
    const SurfaceSpot& there = hives_[h].centre();
    if (taken[h] || !stands_[h] || there.point.triangle != centre.point.triangle ||
        there.position != centre.position)
      continue;
    taken[h] = 1;
    return &hives_[h];
  }
  return nullptr;
}

/// Null where none can stand.
Hive* HiveContact::build_hive(const SurfaceSpot& centre, std::vector<char>& taken) {
  const auto free = std::find(taken.begin(), taken.end(), 0);
  if (free == taken.end()) return nullptr;
  const auto h = static_cast<std::size_t>(free - taken.begin());
  taken[h] = 1;
  stands_[h] = hives_[h].build(centre) == HiveVerdict::kSound;
  return stands_[h] ? &hives_[h] : nullptr;
}

void HiveContact::make_response() {
  gather_clusters();
  near_fields_.clear();
  beyond_touchable_ = without_hive_;
  const std::vector<Place>& places = state_.places;
  const auto n = static_cast<Eigen::Index>(places.size());
  response_.setZero(3 * n, 3 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Place& one = places[static_cast<std::size_t>(k)];
    for (Eigen::Index l = 0; l <= k; ++l) {
      const Place& other = places[static_cast<std::size_t>(l)];
      const double share = facing(one.normal.dot(other.normal));
      if (share == 0.0) continue;
      const Vec3 offset = one.position - other.position;
      const double radius = disc_radius(0.5 * (one.area + other.area));
      const Mat3 block = share * half_space_.response(disc_to_disc(offset.norm(), radius), offset,
                                                      (one.normal + other.normal).normalized());
      response_.block<3, 3>(3 * k, 3 * l) = block;
      if (k != l) response_.block<3, 3>(3 * l, 3 * k) = block.transpose();
    }
  }
  std::vector<Vec3> at;
  for (const Cluster& cluster : clusters_) {
    if (!cluster.hive) continue;
    at.clear();
    for (const int k : cluster.cells) at.push_back(places[static_cast<std::size_t>(k)].position);
    const MatrixX more = cluster.hive->correction(at);
    for (std::size_t i = 0; i < cluster.cells.size(); ++i)
      for (std::size_t j = 0; j < cluster.cells.size(); ++j)
        response_.block<3, 3>(3 * cluster.cells[i], 3 * cluster.cells[j]) +=
            more.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j));
  }
  make_positive(response_);
}

void HiveContact::drop_response() {
  clusters_.clear();
}

/// Its cells are all that it knows of its surface.
void HiveContact::spread_forces(std::span<const Vec3>, ContactResponse& response) {
  response.touched.clear();
  response.loads.clear();
  state_.response = response;
}

void HiveContact::place_displacements(const ContactResponse&, std::vector<float>& displacements) {
  state_.counted = false;
  ensure_response();
  displacements.clear();
}

void HiveContact::draw(std::span<const float>, std::span<const ContactCell> cells,
                       const ContactSolution& solution, std::vector<Vec3f>& positions) const {
  const std::vector<Vec3>& rest = surface_.surface().vertices;
  positions.resize(rest.size());
  for (std::size_t v = 0; v < rest.size(); ++v) positions[v] = rest[v].cast<float>();
  for (const Cluster& cluster : clusters_) {
    std::vector<Vec3> at, forces;
    std::vector<std::size_t> loaded;
    for (const int cell : cluster.cells) {
      const auto k = static_cast<std::size_t>(cell);
      if (solution.forces[k].isZero(0.0)) continue;
      at.push_back(cells[k].position);
      forces.push_back(solution.forces[k]);
      loaded.push_back(k);
    }
    if (loaded.empty()) continue;
    const VectorX carried = cluster.hive ? cluster.hive->node_loads(at, forces) : VectorX();
    for (std::size_t v = 0; v < rest.size(); ++v) {
      const double distance = (rest[v] - cluster.centre.position).norm();
      if (distance >= kFadesTo * settings_.radius) continue;
      const Vec3& normal = surface_.normals()[v];
      if (normal.dot(cluster.centre.normal) < kFacesAway) continue;
      Vec3 sum = Vec3::Zero();
      for (std::size_t i = 0; i < loaded.size(); ++i) {
        const ContactCell& cell = cells[loaded[i]];
        const double share = facing(cell.normal.dot(normal));
        if (share == 0.0) continue;
        const Vec3 offset = rest[v] - cell.position;
        sum +=
            half_space_.displacement(disc_to_point(offset.norm(), disc_radius(cell.area)), offset,
                                     (cell.normal + normal).normalized(), share * forces[i]);
      }
      if (cluster.hive) sum += cluster.hive->corrected(rest[v], carried);
      positions[v] += (fading(distance, settings_.radius) * sum).cast<float>();
    }
  }
}

}  // namespace viscera
