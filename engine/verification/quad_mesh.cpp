#include "engine/verification/quad_mesh.h"

#include <cmath>
#include <numbers>

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kBuckets = 1 << 14;

std::vector<double> even(double from, double to, int count) {
  std::vector<double> borders;
  for (int i = 0; i <= count; ++i) borders.push_back(from + (to - from) * i / count);
  return borders;
}

/// The disc of radius 1, y >= 0: a core whose outline is between a square and a circle, and the
/// ring around it, graded towards the rim.
void add_disc(QuadMeshBuilder& builder, const Grading& grading, int around) {
  // A quarter of the rim is one side of the core: it goes around from -pi/4.
  const int side = around / 2;
  constexpr double kCore = 0.45, kBulge = 0.08;
  const auto core_edge = [](double turn) {
    // turn: in quarters, from -0.5 to 0.5 about a side's middle; bulged outwards
    const double along = 2.0 * turn;
    return Vec2(kCore * (1.0 + kBulge * (1.0 - along * along)), kCore * along);
  };
  // Core: a transfinite square between its four bulged sides, the half y >= 0.
  const auto core = [&](double u, double v) {  // u, v in [-1, 1]
    const auto bulge = [&](double t) { return kBulge * (1.0 - t * t); };
    return Vec2(kCore * u * (1.0 + bulge(v)), kCore * v * (1.0 + bulge(u)));
  };
  builder.add(even(-1.0, 1.0, side), even(0.0, 1.0, side / 2), core);
  // Ring: from the core's outline to the rim, by quarters; shares 0 (core) to 1 (rim).
  std::vector<double> shares;
  for (const double off : graded_borders(1.0 - kCore, grading))
    shares.insert(shares.begin(), 1.0 - off / (1.0 - kCore));
  shares.front() = 0.0;
  const auto ring = [&](double middle) {
    return [&, middle](double turn, double share) {
      const Vec2 inner = Eigen::Rotation2Dd(middle) * core_edge(turn);
      const double angle = middle + turn * 0.5 * kPi;
      const Vec2 outer(std::cos(angle), std::sin(angle));
      return Vec2((1.0 - share) * inner + share * outer);
    };
  };
  builder.add(even(0.0, 0.5, side / 2), shares, ring(0.0));
  builder.add(even(-0.5, 0.5, side), shares, ring(0.5 * kPi));
  builder.add(even(-0.5, 0.0, side / 2), shares, ring(kPi));
}

}  // namespace

int QuadMeshBuilder::node_at(const Vec2& place) {
  if (buckets_.empty()) buckets_.resize(kBuckets);
  // Places that are one differ by less than a grain: they may still fall into two cells.
  const auto cell = [&](double x) { return std::llround(x / (16.0 * grain_)); };
  const auto bucket = [&](long long i, long long j) {
    return static_cast<std::size_t>(i * 73856093LL ^ j * 19349663LL) % kBuckets;
  };
  const long long ci = cell(place.x()), cj = cell(place.y());
  for (long long i = ci - 1; i <= ci + 1; ++i)
    for (long long j = cj - 1; j <= cj + 1; ++j)
      for (const int known : buckets_[bucket(i, j)])
        if ((mesh_.nodes[static_cast<std::size_t>(known)] - place).norm() < grain_) return known;
  const int fresh = static_cast<int>(mesh_.nodes.size());
  buckets_[bucket(ci, cj)].push_back(fresh);
  mesh_.nodes.push_back(place);
  return fresh;
}

void QuadMeshBuilder::add(const std::vector<double>& first, const std::vector<double>& second,
                          const std::function<Vec2(double, double)>& place) {
  const std::vector<double> us = with_middles(first), vs = with_middles(second);
  std::vector<int> node(us.size() * vs.size());
  for (std::size_t i = 0; i < us.size(); ++i)
    for (std::size_t j = 0; j < vs.size(); ++j)
      node[i * vs.size() + j] = node_at(place(us[i], vs[j]));
  for (std::size_t i = 0; i + 2 < us.size(); i += 2)
    for (std::size_t j = 0; j + 2 < vs.size(); j += 2) {
      std::array<int, 9> element{};
      for (std::size_t k = 0; k < 9; ++k) element[k] = node[(i + k / 3) * vs.size() + j + k % 3];
      mesh_.elements.push_back(element);
    }
}

QuadMesh rectangle_mesh(const std::vector<double>& x, const std::vector<double>& y) {
  QuadMeshBuilder builder(std::max(x.back() - x.front(), y.back() - y.front()));
  builder.add(x, y, [](double u, double v) { return Vec2(u, v); });
  return std::move(builder).mesh();
}

QuadMesh polar_mesh(const std::vector<double>& angles, const std::vector<double>& radii) {
  QuadMeshBuilder builder(radii.back());
  builder.add(angles, radii, [](double angle, double radius) {
    return Vec2(radius * std::sin(angle), radius * std::cos(angle));
  });
  return std::move(builder).mesh();
}

QuadMesh disc_in_rectangle(const DiscInRectangle& options) {
  // From the rim to a square about the disc, then on to the sides.
  const double square = std::min({options.left, options.right, options.across, 1.8});
  QuadMeshBuilder builder(options.left + options.right);
  add_disc(builder, options.grading, options.around);
  const int side = options.around / 2;
  const auto borders = graded_borders(square - 1.0, options.grading);
  std::vector<double> shares;
  for (const double off : borders) shares.push_back(off / (square - 1.0));
  shares.back() = 1.0;
  const auto beyond = [&](double middle) {
    return [&, middle](double turn, double share) {
      const double angle = middle + turn * 0.5 * kPi;
      const Vec2 rim(std::cos(angle), std::sin(angle));
      const Vec2 outer = Eigen::Rotation2Dd(middle) * Vec2(square, square * 2.0 * turn);
      return Vec2((1.0 - share) * rim + share * outer);
    };
  };
  builder.add(even(0.0, 0.5, side / 2), shares, beyond(0.0));
  builder.add(even(-0.5, 0.5, side), shares, beyond(0.5 * kPi));
  builder.add(even(-0.5, 0.0, side / 2), shares, beyond(kPi));

  // The square's own borders go on as lines across the rectangle.
  const auto flat = [](double u, double v) { return Vec2(u, v); };
  const std::vector<double> along = even(-square, square, side), half = even(0.0, square, side / 2);
  Grading away = options.grading;
  away.finest = 2.0 * square / side;
  const auto on_to = [&](double length) {
    std::vector<double> places;
    for (const double off : graded_borders(length - square, away)) places.push_back(square + off);
    places.back() = length;
    return places;
  };
  const auto mirrored = [](std::vector<double> places) {
    for (double& place : places) place = -place;
    return places;
  };
  const bool has_right = options.right > square, has_left = options.left > square,
             has_across = options.across > square;
  if (has_right) builder.add(on_to(options.right), half, flat);
  if (has_left) builder.add(mirrored(on_to(options.left)), half, flat);
  if (has_across) {
    const auto up = on_to(options.across);
    builder.add(along, up, flat);
    if (has_right) builder.add(on_to(options.right), up, flat);
    if (has_left) builder.add(mirrored(on_to(options.left)), up, flat);
  }
  return std::move(builder).mesh();
}

QuadMesh disc_in_disc(double radius, const Grading& grading, int around) {
  QuadMeshBuilder builder(radius);
  add_disc(builder, grading, around);
  std::vector<double> radii;
  for (const double off : graded_borders(radius - 1.0, grading)) radii.push_back(1.0 + off);
  radii.back() = radius;
  builder.add(even(0.0, kPi, 2 * (around / 2)), radii, [](double angle, double r) {
    return Vec2(r * std::cos(angle), r * std::sin(angle));
  });
  return std::move(builder).mesh();
}

}  // namespace viscera
