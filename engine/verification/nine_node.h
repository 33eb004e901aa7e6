// What finite elements of nine nodes share: quadratics on -1, 0, 1, Gauss points, graded steps.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace viscera {

/// Lagrange's quadratics on -1, 0, 1 at t.
inline std::array<double, 3> quadratics(double t) {
  return {0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)};
}
/// Their slopes.
inline std::array<double, 3> quadratic_slopes(double t) {
  return {t - 0.5, -2.0 * t, t + 0.5};
}

inline const std::array<double, 3> kGaussPlaces = {-std::sqrt(0.6), 0.0, std::sqrt(0.6)};
inline constexpr std::array<double, 3> kGaussWeights = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};

/// How elements grow away from where they are finest; lengths in one unit.
struct Grading {
  double finest = 0.01;
  double growth = 1.4;
  double coarsest = 0.5;
};

/// Borders from 0 to `length`: steps from the finest growing up to the coarsest. All shrink a
/// little so that the last one ends at `length`.
inline std::vector<double> graded_borders(double length, const Grading& grading) {
  std::vector<double> borders{0.0};
  for (double step = grading.finest; borders.back() < length * (1.0 - 1e-9);
       step = std::min(grading.coarsest, step * grading.growth))
    borders.push_back(borders.back() + step);
  const double scale = length / borders.back();
  for (double& border : borders) border *= scale;
  return borders;
}

/// Borders from `from` to `to`, finest at each of `places`, which lie between.
inline std::vector<double> borders_about(double from, double to, std::vector<double> places,
                                         const Grading& grading) {
  std::sort(places.begin(), places.end());
  std::vector<double> all{from};
  const auto join = [&](const std::vector<double>& more, double start, double sign, bool turned) {
    std::vector<double> part;
    for (const double off : more) part.push_back(start + sign * off);
    if (turned) std::reverse(part.begin(), part.end());
    for (std::size_t i = 1; i < part.size(); ++i) all.push_back(part[i]);
  };
  double at = from;
  for (std::size_t i = 0; i <= places.size(); ++i) {
    const bool fine_before = i > 0, fine_after = i < places.size();
    const double end = fine_after ? places[i] : to;
    if (end - at < 1e-9 * (to - from)) continue;
    if (fine_before && fine_after) {
      const double half = 0.5 * (end - at);
      join(graded_borders(half, grading), at, 1.0, false);
      join(graded_borders(half, grading), end, -1.0, true);
    } else if (fine_after) {
      join(graded_borders(end - at, grading), end, -1.0, true);
    } else {
      join(graded_borders(end - at, grading), at, 1.0, false);
    }
    all.back() = end;
    at = end;
  }
  return all;
}

/// Borders and the middles between them.
inline std::vector<double> with_middles(const std::vector<double>& borders) {
  std::vector<double> all{borders.front()};
  for (std::size_t i = 1; i < borders.size(); ++i) {
    all.push_back(0.5 * (borders[i - 1] + borders[i]));
    all.push_back(borders[i]);
  }
  return all;
}

}  // namespace viscera
