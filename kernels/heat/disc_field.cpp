#include "kernels/heat/disc_field.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/lanes_math.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

static_assert(BrickField::kEdge == kLanes, "a row of a brick is one register");

/// Samples along a voxel's edge near the disc, at least and at most, and a little away from it; far
/// away its middle does.
constexpr int kLeastFine = 4, kMostFine = 8, kCoarse = 2;
constexpr double kFinePerRadius = 8.0;
constexpr double kNear = 1.75, kFar = 3.0;  // of the radius
/// Thickness of a shell under the disc, over the distance of samples: none must be empty.
constexpr double kShellPerSample = 1.2;

struct Disc {
  std::array<float, 3> outward;
  float shell, last, beyond, least;  // shell's thickness; last shell; u, root where they end
  int shells;
};

/// |grad u|^2 times `weight` at eight places, lengths over the radius, split between the two
/// nearest shells, so that nothing jumps as the disc moves; the outermost halves have one.
VISCERA_INLINE void weigh(const Disc& disc, const Lanes& x, const Lanes& y, const Lanes& z,
                          const Lanes& weight, LaneInts& shell, Lanes& lower, Lanes& upper) {
  const Lanes zero = {};
  const Lanes depth = disc.outward[0] * x + disc.outward[1] * y + disc.outward[2] * z;
  const Lanes t = x * x + y * y + z * z - 1.0f;
  const Lanes twice = 2.0f * depth;
  Lanes root, zeta, u;
  square_root(root, t * t + twice * twice);
  const Lanes above = 0.5f * (t + root);
  const Lanes below = 2.0f * depth * depth / (root - t + 1e-20f);
  const Lanes zeta_square = t > 0.0f ? above : below;
  square_root(zeta, zeta_square);
  arc_tangent(u, zeta);
  // At the rim the field is without bound, but its integral isn't.
  Lanes amount = weight / ((1.0f + zeta_square) * (root > disc.least ? root : zero + disc.least));
  amount = u > disc.beyond ? zero : amount;
  Lanes place = u / disc.shell - 0.5f;
  place = place > 0.0f ? place : zero;
  place = place < disc.last ? place : zero + disc.last;
  shell = __builtin_convertvector(place, LaneInts);
  shell = shell < disc.shells - 2 ? shell : LaneInts{} + (disc.shells - 2);
  upper = (place - __builtin_convertvector(shell, Lanes)) * amount;
  lower = amount - upper;
}

VISCERA_WIDE void share_voxel(const Disc& disc, const float* const* places, const float* weights,
                              std::size_t count, const float* centre, float* shares) {
  const Disc d = disc;
  float even[DiscField::kMostShells] = {}, odd[DiscField::kMostShells] = {};
  for (std::size_t s = 0; s < count; s += kLanes) {
    Lanes x, y, z, weight, lower, upper;
    LaneInts shell;
    load(x, places[0] + s);
    load(y, places[1] + s);
    load(z, places[2] + s);
    load(weight, weights + s);
    weigh(d, x + centre[0], y + centre[1], z + centre[2], weight, shell, lower, upper);
    for (int l = 0; l < kLanes; l += 2) {
      even[shell[l]] += lower[l];
      odd[shell[l + 1]] += lower[l + 1];
      even[shell[l] + 1] += upper[l];
      odd[shell[l + 1] + 1] += upper[l + 1];
    }
  }
  for (int s = 0; s < DiscField::kMostShells; ++s) shares[s] = even[s] + odd[s];
}

/// By its middle alone; a voxel's mean is more by its square's 24th of the Laplacian, and far away
/// the field falls as the distance's fourth power.
VISCERA_WIDE void share_eight(const Disc& disc, const float* first, float size, float* shares) {
  const Disc d = disc;
  Lanes x;
  for (int l = 0; l < kLanes; ++l) x[l] = first[0] + size * static_cast<float>(l);
  const Lanes y = Lanes{} + first[1], z = Lanes{} + first[2];
  const Lanes square = x * x + y * y + z * z;
  const Lanes weight = size * size * size * (1.0f + 0.5f * size * size / (square + 1e-6f));
  Lanes lower, upper;
  LaneInts shell;
  weigh(d, x, y, z, weight, shell, lower, upper);
  for (int l = 0; l < kLanes; ++l) {
    float* of = shares + DiscField::kMostShells * l;
    std::fill_n(of, DiscField::kMostShells, 0.0f);
    of[shell[l]] = lower[l];
    of[shell[l] + 1] = upper[l];
  }
}

}  // namespace

DiscField::DiscField(const Vec3& point, const Vec3& outward, double radius, double reach,
                     double voxel)
    : point_(point), radius_(radius), reach_(reach), voxel_(voxel) {
  const int fine = std::clamp(static_cast<int>(std::ceil(kFinePerRadius * voxel / radius)),
                              kLeastFine, kMostFine);
  const double last = std::atan(std::sqrt(std::pow(reach / radius, 2) - 1.0));
  shells_ = std::clamp(static_cast<int>(last * radius * fine / (kShellPerSample * voxel)), 2,
                       kMostShells);
  shell_ = last / shells_;
  for (int axis = 0; axis < 3; ++axis) outward_[axis] = static_cast<float>(outward[axis]);
  fine_ = samples_of(fine, voxel / radius);
  coarse_ = samples_of(kCoarse, voxel / radius);
}

DiscField::Samples DiscField::samples_of(int edge, double size) {
  Samples samples;
  const double part = size / edge;
  samples.part = static_cast<float>(part);
  for (int s = 0; s < edge * edge * edge; ++s) {
    const int at[] = {s % edge, s / edge % edge, s / (edge * edge)};
    for (int axis = 0; axis < 3; ++axis)
      samples.place[axis].push_back(static_cast<float>((at[axis] + 0.5) * part - 0.5 * size));
    samples.weight.push_back(static_cast<float>(part * part * part));
  }
  while (samples.weight.size() % kLanes > 0) {
    for (std::vector<float>& values : samples.place) values.push_back(0.0f);
    samples.weight.push_back(0.0f);
  }
  return samples;
}

bool DiscField::share_row(const Vec3& first, std::array<Shares, BrickField::kEdge>& shares) const {
  const Vec3 from = first - point_;
  // The row's nearest voxel, roughly.
  const double x = std::max({0.0, from.x(), -from.x() - voxel_ * BrickField::kEdge});
  if (Vec3(x, from.y(), from.z()).norm() > reach_) return false;
  const auto to_radii = [this](double length) { return static_cast<float>(length / radius_); };
  Disc disc;
  disc.outward = outward_;
  disc.shell = static_cast<float>(shell_);
  disc.shells = shells_;
  disc.last = static_cast<float>(shells_ - 1);
  disc.beyond = static_cast<float>(last());
  disc.least = 0.5f * to_radii(voxel_);
  const float row[3] = {to_radii(from.x()), to_radii(from.y()), to_radii(from.z())};
  share_eight(disc, row, to_radii(voxel_), shares[0].data());
  for (int l = 0; l < BrickField::kEdge; ++l) {
    const double away = (from + Vec3(l * voxel_, 0.0, 0.0)).norm();
    if (away > kFar * radius_ + voxel_) continue;
    const Samples& samples = away < kNear * radius_ + voxel_ ? fine_ : coarse_;
    const float* places[] = {samples.place[0].data(), samples.place[1].data(),
                             samples.place[2].data()};
    const float centre[3] = {row[0] + static_cast<float>(l) * to_radii(voxel_), row[1], row[2]};
    disc.least = 0.5f * samples.part;
    share_voxel(disc, places, samples.weight.data(), samples.weight.size(), centre,
                shares[static_cast<std::size_t>(l)].data());
  }
  for (Shares& one : shares)
    for (float& share : one) share *= static_cast<float>(radius_);
  return true;
}

}  // namespace viscera
