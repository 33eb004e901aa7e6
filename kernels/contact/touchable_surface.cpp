#include "kernels/contact/touchable_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "kernels/contact/facing.h"
#include "kernels/contact/same_side.h"

namespace viscera {
namespace {

int flat_index(const Eigen::Vector3i& cell, const Eigen::Vector3i& cells) {
  return (cell.z() * cells.y() + cell.y()) * cells.x() + cell.x();
}

Eigen::Vector3i cell_of(const TouchableSurface& surface, const Vec3& x) {
  const Vec3 place = (x - surface.box.min()) / surface.cell;
  Eigen::Vector3i cell;
  for (int a = 0; a < 3; ++a) {
    cell[a] = static_cast<int>(
        std::clamp(std::floor(place[a]), 0.0, static_cast<double>(surface.cells[a] - 1)));
  }
  return cell;
}

void build_grid(TouchableSurface& out) {
  double spacing = 0.0;
  for (const Vec3& x : out.positions) out.box.extend(x);
  for (const double h : out.spacings) spacing += h;
  // About a spreading radius wide, but never more cells than a body's surface has use for.
  const double mean = 2.0 * spacing / static_cast<double>(out.size());
  out.cell = std::max(mean, out.box.sizes().maxCoeff() / 100.0);
  for (int a = 0; a < 3; ++a) {
    out.cells[a] = 1 + static_cast<int>(std::floor(out.box.sizes()[a] / out.cell));
  }
  std::vector<int> cell_of_place(out.size());
  out.cell_begin.assign(static_cast<std::size_t>(out.cells.prod()) + 1, 0);
  for (std::size_t i = 0; i < out.size(); ++i) {
    cell_of_place[i] = flat_index(cell_of(out, out.positions[i]), out.cells);
    ++out.cell_begin[static_cast<std::size_t>(cell_of_place[i]) + 1];
  }
  for (std::size_t c = 1; c < out.cell_begin.size(); ++c)
    out.cell_begin[c] += out.cell_begin[c - 1];
  std::vector<int> next(out.cell_begin.begin(), out.cell_begin.end() - 1);
  out.cell_items.resize(out.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    auto& place = next[static_cast<std::size_t>(cell_of_place[i])];
    out.cell_items[static_cast<std::size_t>(place++)] = static_cast<int>(i);
  }
}

/// Calls visit(place, squared distance) for places nearer than radius, in a fixed order.
template <class Visit>
void places_within(const TouchableSurface& surface, const Vec3& x, double radius,
                   const Visit& visit) {
  const Eigen::Vector3i low = cell_of(surface, x - Vec3::Constant(radius));
  const Eigen::Vector3i high = cell_of(surface, x + Vec3::Constant(radius));
  for (int k = low.z(); k <= high.z(); ++k) {
    for (int j = low.y(); j <= high.y(); ++j) {
      for (int i = low.x(); i <= high.x(); ++i) {
        const auto c = static_cast<std::size_t>(flat_index({i, j, k}, surface.cells));
        for (int at = surface.cell_begin[c]; at < surface.cell_begin[c + 1]; ++at) {
          const int place = surface.cell_items[static_cast<std::size_t>(at)];
          const double d2 = (surface.positions[static_cast<std::size_t>(place)] - x).squaredNorm();
          if (d2 < radius * radius) visit(place, d2);
        }
      }
    }
  }
}

int nearest_place(const TouchableSurface& surface, const Vec3& x) {
  int nearest = -1;
  double least = 0.0;
  // Something is always found once the ball holds the box.
  const double outside = surface.box.exteriorDistance(x);
  for (double radius = outside + surface.cell; nearest < 0; radius *= 2.0) {
    places_within(surface, x, radius, [&](int place, double d2) {
      if (nearest < 0 || d2 < least || (d2 == least && place < nearest)) {
        nearest = place;
        least = d2;
      }
    });
  }
  return nearest;
}

/// (1 - (r / R)^2)^3 with R = kReach sigma: nearly a Gaussian, of finite reach and without a step
/// at its end. kReach is such that the load's own mean displacement on a half-space,
/// proportional to the integral of its squared transform, is that of the Gaussian of the closed
/// forms of NearField (computed: 3.162 would match the variance, and miss that by 3.3 %).
constexpr double kReach = 3.058;

/// Largest factor by which a correction may change a share: what keeps them positive.
constexpr double kMostCorrection = 0.5;

/// Places are irregular, so the centre of the load strays a little from the cell, differently as
/// the cell slides: a linear factor brings it back. Where places end (a border) it can't without
/// negative shares, so it is bounded there.
void centre_shares(std::span<const Vec2> offsets, std::span<LoadShare> shares) {
  Vec2 moment = Vec2::Zero();
  Eigen::Matrix2d inertia = 1e-7 * Eigen::Matrix2d::Identity();
  for (std::size_t i = 0; i < shares.size(); ++i) {
    moment += shares[i].share * offsets[i];
    inertia += shares[i].share * offsets[i] * offsets[i].transpose();
  }
  Vec2 slope = inertia.ldlt().solve(moment);
  const double steepest = slope.norm();
  if (steepest > kMostCorrection) slope *= kMostCorrection / steepest;
  double sum = 0.0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    shares[i].share *= 1.0 - slope.dot(offsets[i]);
    sum += shares[i].share;
  }
  for (LoadShare& share : shares) share.share /= sum;
}

/// Likewise for the second moments, which are those of the bell, by a quadratic factor that leaves
/// sum and centre alone: the mean displacement of what lies under a load depends on its width.
void widen_shares(std::span<const Vec2> offsets, std::span<LoadShare> shares) {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  // Mean of x^2 over (1 - r^2)^3 in the plane.
  constexpr double kSecondMoment = 0.1;
  const auto terms = [&](const Vec2& x) {
    return Vector6(1.0, x.x(), x.y(), x.x() * x.x() - kSecondMoment, x.x() * x.y(),
                   x.y() * x.y() - kSecondMoment);
  };
  Vector6 moments = Vector6::Zero();
  Matrix6 products = Matrix6::Zero();
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const Vector6 p = terms(offsets[i]);
    moments += shares[i].share * p;
    products += shares[i].share * p * p.transpose();
  }
  products.diagonal().array() += 1e-6;
  Vector6 wanted = Vector6::Zero();
  wanted.head<3>() = moments.head<3>();
  const Vector6 factor = products.ldlt().solve(wanted - moments);
  double greatest = 0.0;
  for (const Vec2& x : offsets) greatest = std::max(greatest, std::abs(factor.dot(terms(x))));
  const double part = greatest > kMostCorrection ? kMostCorrection / greatest : 1.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    shares[i].share *= 1.0 + part * factor.dot(terms(offsets[i]));
    sum += shares[i].share;
  }
  for (LoadShare& share : shares) share.share /= sum;
}

}  // namespace

Result<TouchableSurface> touchable_part(const SurfacePlaces& places,
                                        const std::function<bool(const Vec3&)>& is_touchable) {
  TouchableSurface out;
  for (std::size_t p = 0; p < places.size(); ++p) {
    if (!is_touchable(places.positions[p])) continue;
    out.places.push_back(static_cast<int>(p));
    out.positions.push_back(places.positions[p]);
    out.normals.push_back(places.normals[p]);
    out.areas.push_back(places.areas[p]);
    out.spacings.push_back(places.spacings[p]);
  }
  if (out.places.empty()) {
    return failure("touchable surface: found none of " + std::to_string(places.size()) +
                   " places in reach of the instruments, expected at least one");
  }
  out.paths = places.paths;
  build_grid(out);
  return out;
}

double spacing_at(const TouchableSurface& surface, const Vec3& position) {
  const double h = surface.spacings[static_cast<std::size_t>(nearest_place(surface, position))];
  const double radius2 = 9.0 * h * h;
  double sum = 0.0, weighted = 0.0;
  places_within(surface, position, 3.0 * h, [&](int place, double d2) {
    const auto s = static_cast<std::size_t>(place);
    const double fall = 1.0 - d2 / radius2;
    const double weight = surface.areas[s] * fall * fall;
    sum += weight;
    weighted += weight * surface.spacings[s];
  });
  return sum > 0.0 ? weighted / sum : h;
}

std::size_t places_in_reach(const TouchableSurface& surface, const Vec3& position, double sigma) {
  std::size_t count = 0;
  places_within(surface, position, kReach * sigma, [&](int, double) { ++count; });
  return std::max<std::size_t>(1, count);
}

bool spread_load(const TouchableSurface& surface, const Vec3& position, const Vec3& normal,
                 double sigma, std::vector<LoadShare>& shares) {
  std::vector<Vec2> offsets;
  return spread_load(surface, position, normal, sigma, shares, offsets);
}

bool spread_load(const TouchableSurface& surface, const Vec3& position, const Vec3& normal,
                 double sigma, std::vector<LoadShare>& shares, std::vector<Vec2>& offsets) {
  shares.clear();
  offsets.clear();
  const double reach = kReach * sigma;
  const Vec3 first = normal.unitOrthogonal(), second = normal.cross(first);
  places_within(surface, position, reach, [&](int place, double d2) {
    const auto p = static_cast<std::size_t>(place);
    const double fall = 1.0 - d2 / (reach * reach);
    const double share =
        surface.areas[p] * fall * fall * fall * facing(normal.dot(surface.normals[p]));
    if (share > 0.0 && same_side(surface.paths.get(), kSideDepth * surface.spacings[p], position,
                                 normal, surface.positions[p], surface.normals[p]))
      shares.push_back({place, share});
  });
  if (shares.empty()) {
    shares.push_back({nearest_place(surface, position), 1.0});
    return false;
  }
  double sum = 0.0;
  for (const LoadShare& share : shares) {
    const Vec3 offset = surface.positions[static_cast<std::size_t>(share.place)] - position;
    offsets.push_back(Vec2(first.dot(offset), second.dot(offset)) / reach);
    sum += share.share;
  }
  for (LoadShare& share : shares) share.share /= sum;
  centre_shares(offsets, shares);
  widen_shares(offsets, shares);
  return true;
}

std::array<double, 2 * TouchableSurface::kModulusScales> modulus_about(
    const TouchableSurface& surface, const Vec3& position, const Vec3& normal) {
  constexpr double kBell = 3.0;  // standard deviations
  std::array<double, 2 * TouchableSurface::kModulusScales> sum{};
  double whole = 0.0;
  const auto add = [&](int place, double weight) {
    const std::size_t first = sum.size() * static_cast<std::size_t>(place);
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += weight * static_cast<double>(surface.modulus[first + i]);
    whole += weight;
  };
  const double radius = kBell * kFeltSpacings * spacing_at(surface, position);
  places_within(surface, position, radius, [&](int place, double square) {
    const auto i = static_cast<std::size_t>(place);
    const double sigma = kFeltSpacings * surface.spacings[i];
    add(place, facing(surface.normals[i].dot(normal)) * std::exp(-0.5 * square / (sigma * sigma)));
  });
  if (whole == 0.0) add(nearest_place(surface, position), 1.0);
  for (double& value : sum) value /= whole;
  return sum;
}

bool is_touchable(const TouchableSurface& touchable, const Vec3& x) {
  if (touchable.positions.empty()) return false;
  Eigen::Vector3i home;
  for (int a = 0; a < 3; ++a)
    home[a] = static_cast<int>(std::floor((x[a] - touchable.box.min()[a]) / touchable.cell));
  for (int k = home.z() - 1; k <= home.z() + 1; ++k)
    for (int j = home.y() - 1; j <= home.y() + 1; ++j)
      for (int i = home.x() - 1; i <= home.x() + 1; ++i) {
        if (i < 0 || j < 0 || k < 0 || i >= touchable.cells.x() || j >= touchable.cells.y() ||
            k >= touchable.cells.z())
          continue;
        const auto cell =
            static_cast<std::size_t>(i + touchable.cells.x() * (j + touchable.cells.y() * k));
        for (int at = touchable.cell_begin[cell]; at < touchable.cell_begin[cell + 1]; ++at) {
          const auto s =
              static_cast<std::size_t>(touchable.cell_items[static_cast<std::size_t>(at)]);
          if ((touchable.positions[s] - x).norm() < touchable.spacings[s]) return true;
        }
      }
  return false;
}

}  // namespace viscera
