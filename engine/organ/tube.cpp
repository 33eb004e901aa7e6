// Tubes about splines, smooth or folded as guts are.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "engine/organ/implicit_shapes.h"

namespace viscera {
namespace {

// A tube's axis with its radius as the fourth coordinate.
class Spline {
 public:
  explicit Spline(const std::vector<TubePoint>& points) {
    for (const TubePoint& point : points) {
      knots_.emplace_back(point.centre.x(), point.centre.y(), point.centre.z(), point.radius);
    }
    // Phantom knots continue the ends straight.
    knots_.insert(knots_.begin(), 2.0 * knots_[0] - knots_[1]);
    knots_.push_back(2.0 * knots_[knots_.size() - 1] - knots_[knots_.size() - 2]);
    const int samples = kSamples * spans() + 1;
    for (int i = 0; i < samples; ++i) samples_.push_back(at(i / double{kSamples})[0]);
    for (int span = 0; span < spans(); ++span) {
      const Vec4& middle = samples_[static_cast<std::size_t>(kSamples * span + kSamples / 2)];
      double reach = 0.0;
      for (int i = 0; i <= kSamples; ++i) {
        const Vec4& sample = samples_[static_cast<std::size_t>(kSamples * span + i)];
        reach = std::max(reach, (sample - middle).head<3>().norm() + sample[3]);
      }
      bounds_.emplace_back(middle.x(), middle.y(), middle.z(), reach);
    }
  }

  struct Nearest {
    double t;    ///< of the axis' place
    double gap;  ///< |x - c(t)| - r(t) [m]
  };

  // Least |x - c(t)| - r(t): from the best sample on by Newton steps. Samples alone would leave the
  // tube faceted along its length.
  Nearest nearest(const Vec3& x) const {
    const auto gap = [&x](const Vec4& c) { return (x - c.head<3>()).norm() - c[3]; };
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t span = 0; span < bounds_.size(); ++span) {
      if (gap(bounds_[span]) > least) continue;
      for (std::size_t i = kSamples * span; i <= kSamples * (span + 1); ++i) {
        const double value = gap(samples_[i]);
        if (value < least) least = value, best = i;
      }
    }
    const double sampled = static_cast<double>(best) / kSamples;
    double t = sampled;
    constexpr double kReach = 1.0 / kSamples;
    const double low = std::max(0.0, t - kReach), high = std::min<double>(spans(), t + kReach);
    for (int step = 0; step < 3; ++step) {
      const auto [c, d, dd] = at(t);
      const Vec3 from = c.head<3>() - x;
      const double length = from.norm();
      if (length < 1e-12) break;
      // The stationary point of the gap, times the distance: linear in t on a straight cylinder.
      const double along = from.dot(d.head<3>());
      const double slope = along - d[3] * length;
      const double curvature = d.head<3>().squaredNorm() + from.dot(dd.head<3>()) -
                               d[3] * along / length - dd[3] * length;
      if (!(curvature > 0.0)) break;
      t = std::clamp(t - slope / curvature, low, high);
    }
    const double refined = gap(at(t)[0]);
    return refined < least ? Nearest{t, refined} : Nearest{sampled, least};
  }

  int spans() const { return static_cast<int>(knots_.size()) - 3; }

  // Value, first and second derivative at t in [0, spans].
  std::array<Vec4, 3> at(double t) const {
    const int span = std::clamp(static_cast<int>(t), 0, spans() - 1);
    const double u = t - span;
    const Vec4 &a = knots_[span], &b = knots_[span + 1], &c = knots_[span + 2],
               &d = knots_[span + 3];
    const Vec4 one = 0.5 * (c - a);
    const Vec4 two = a - 2.5 * b + 2.0 * c - 0.5 * d;
    const Vec4 three = 1.5 * (b - c) + 0.5 * (d - a);
    return {b + u * (one + u * (two + u * three)), one + u * (2.0 * two + u * 3.0 * three),
            2.0 * two + u * 6.0 * three};
  }

 private:
  static constexpr int kSamples = 4;  // a span

  std::vector<Vec4, Eigen::aligned_allocator<Vec4>> knots_, samples_, bounds_;
};

// Arc length and a frame that doesn't turn about the axis (parallel transport), tabulated.
class TubeFrame {
 public:
  explicit TubeFrame(const Spline& spline) {
    const int count = kSteps * spline.spans() + 1;
    Vec3 last = Vec3::Zero(), tangent = Vec3::UnitX(), across = Vec3::UnitY();
    double length = 0.0;
    for (int i = 0; i < count; ++i) {
      const auto [c, d, dd] = spline.at(i / double{kSteps});
      tangent = d.head<3>().normalized();
      if (i == 0) {
        const Vec3 other = std::abs(tangent.z()) < 0.8 ? Vec3::UnitZ() : Vec3::UnitY();
        across = other;
      } else {
        length += (c.head<3>() - last).norm();
      }
      across = (across - across.dot(tangent) * tangent).normalized();
      last = c.head<3>();
      lengths_.push_back(length);
      across_.push_back(across);
    }
  }

  double length(double t) const {
    const auto [i, u] = place(t);
    return lengths_[i] + u * (lengths_[i + 1] - lengths_[i]);
  }
  Vec3 across(double t) const {
    const auto [i, u] = place(t);
    return across_[i] + u * (across_[i + 1] - across_[i]);
  }

 private:
  static constexpr int kSteps = 16;  // a span

  std::pair<std::size_t, double> place(double t) const {
    const double at = std::clamp(t * kSteps, 0.0, static_cast<double>(lengths_.size() - 1));
    const std::size_t i = std::min(static_cast<std::size_t>(at), lengths_.size() - 2);
    return {i, at - static_cast<double>(i)};
  }

  std::vector<double> lengths_;
  std::vector<Vec3> across_;
};

// How deep the surface lies under the tube's own, at arc length s and angle theta.
double furrow(const GutFolds& folds, double s, double theta, double radius) {
  constexpr double kWhole = 2.0 * std::numbers::pi;
  double band = 0.0, row = 0.0;
  if (folds.bands > 0) {
    const double turned = (theta - folds.turn) / kWhole * folds.bands;
    row = std::floor(turned + 0.5);  // nearest band
    const double off = (turned - row) / folds.bands * kWhole * radius;
    const double wide = 0.5 * folds.band_width;
    band = std::exp(-off * off / (wide * wide));
    row = std::floor(turned) - folds.bands * std::floor(std::floor(turned) / folds.bands);
  }
  // A narrow furrow: the bulge between two takes most of the pitch.
  const double shifted = s / folds.pitch + (folds.bands > 0 ? row / folds.bands : 0.0);
  const double wave = 2.2 * std::sin(std::numbers::pi * shifted);
  const double fold = folds.depth * std::exp(-wave * wave);
  return (1.0 - band) * fold + band * folds.band_depth;
}

}  // namespace

SignedDistance tube(const std::vector<TubePoint>& points) {
  return [spline = Spline(points)](const Vec3& x) { return spline.nearest(x).gap; };
}

SignedDistance folded_tube(const std::vector<TubePoint>& points, const GutFolds& folds) {
  const Spline spline(points);
  const double deepest = std::max(folds.depth, folds.band_depth);
  return [spline, frame = TubeFrame(spline), folds, deepest](const Vec3& x) {
    const auto [t, gap] = spline.nearest(x);
    // Far outside only the sign and a bound matter.
    if (gap > 3.0 * deepest) return gap;
    const auto [c, d, dd] = spline.at(t);
    const Vec3 from = x - c.head<3>();
    const Vec3 up = frame.across(t), side = d.head<3>().normalized().cross(up);
    const double theta = std::atan2(from.dot(side), from.dot(up));
    // The furrows fade towards the axis, where the angle has no meaning.
    const double depth = std::min(1.0, from.norm() / (0.5 * c[3]));
    return gap + depth * furrow(folds, frame.length(t), theta, c[3]);
  };
}

}  // namespace viscera
