#include "engine/organ/implicit_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "kernels/base/random.h"

namespace viscera {
namespace {

// Polynomial smooth minimum, cubic: the crease between two surfaces becomes a fillet of about this
// width, with continuous curvature, so that no line shows in highlights.
double smooth_minimum(double a, double b, double width) {
  if (width <= 0.0) return std::min(a, b);
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - h * h * h * width / 6.0;
}

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
  }

  // Least |x - c(t)| - r(t): from the best sample on by Newton steps. Samples alone would leave the
  // tube faceted along its length.
  double distance(const Vec3& x) const {
    const auto gap = [&x](const Vec4& c) { return (x - c.head<3>()).norm() - c[3]; };
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const double value = gap(samples_[i]);
      if (value < least) least = value, best = i;
    }
    double t = static_cast<double>(best) / kSamples;
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
    return std::min(least, gap(at(t)[0]));
  }

 private:
  static constexpr int kSamples = 4;  // a span

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

  std::vector<Vec4, Eigen::aligned_allocator<Vec4>> knots_, samples_;
};

}  // namespace

SignedDistance ellipsoid(const Vec3& centre, const Vec3& radii) {
  const Vec3 inverse = radii.cwiseInverse();
  const double least = radii.minCoeff();
  return [=](const Vec3& x) {
    const Vec3 scaled = (x - centre).cwiseProduct(inverse);
    const double k0 = scaled.norm(), k1 = scaled.cwiseProduct(inverse).norm();
    return k0 > 1e-9 ? k0 * (k0 - 1.0) / k1 : -least;
  };
}

SignedDistance tube(const std::vector<TubePoint>& points) {
  return [spline = Spline(points)](const Vec3& x) { return spline.distance(x); };
}

SignedDistance metaballs(const std::vector<TubePoint>& balls, double blend) {
  return [=](const Vec3& x) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const TubePoint& ball : balls) {
      nearest = std::min(nearest, (x - ball.centre).norm() - ball.radius);
    }
    double sum = 0.0;
    for (const TubePoint& ball : balls) {
      sum += std::exp((nearest - (x - ball.centre).norm() + ball.radius) / blend);
    }
    return nearest - blend * std::log(sum);
  };
}

SignedDistance rounded_box(const Vec3& centre, const Vec3& size, double round) {
  const Vec3 half = 0.5 * size - Vec3::Constant(round);
  return [=](const Vec3& x) {
    const Vec3 beyond = (x - centre).cwiseAbs() - half;
    return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0) - round;
  };
}

SignedDistance half_space(const Vec3& point, const Vec3& outward) {
  const Vec3 normal = outward.normalized();
  const double offset = normal.dot(point);
  return [=](const Vec3& x) { return normal.dot(x) - offset; };
}

SignedDistance join(SignedDistance a, SignedDistance b, double smooth) {
  return [a = std::move(a), b = std::move(b), smooth](const Vec3& x) {
    return smooth_minimum(a(x), b(x), smooth);
  };
}

SignedDistance intersect(SignedDistance a, SignedDistance b, double smooth) {
  return [a = std::move(a), b = std::move(b), smooth](const Vec3& x) {
    return -smooth_minimum(-a(x), -b(x), smooth);
  };
}

SignedDistance subtract(SignedDistance from, SignedDistance taken, double smooth) {
  return [from = std::move(from), taken = std::move(taken), smooth](const Vec3& x) {
    return -smooth_minimum(-from(x), taken(x), smooth);
  };
}

SignedDistance shell(SignedDistance of, double thickness) {
  return [of = std::move(of), thickness](const Vec3& x) {
    const double f = of(x);
    return std::max(f, -f - thickness);
  };
}

SignedDistance grow(SignedDistance of, double by) {
  return [of = std::move(of), by](const Vec3& x) { return of(x) - by; };
}

SignedDistance moved(SignedDistance of, const Pose& pose) {
  const Mat3 back = pose.orientation.conjugate().toRotationMatrix();
  const Vec3 by = pose.position;
  return [of = std::move(of), back, by](const Vec3& x) { return of(back * (x - by)); };
}

SignedDistance stretched(SignedDistance of, const Vec3& factors) {
  const Vec3 inverse = factors.cwiseInverse();
  const double least = factors.minCoeff();
  return [of = std::move(of), inverse, least](const Vec3& x) {
    return least * of(x.cwiseProduct(inverse));
  };
}

SignedDistance bent(SignedDistance of, int along, int towards, double middle, double radius) {
  return [of = std::move(of), along, towards, middle, radius](const Vec3& x) {
    const double s = x[along] - middle;
    Vec3 straight = x;
    straight[towards] -= s * s / (2.0 * radius);
    return of(straight);
  };
}

SignedDistance tapered(SignedDistance of, const Taper& taper) {
  return [of = std::move(of), taper](const Vec3& x) {
    double s = std::clamp((x[taper.along] - taper.from) / (taper.to - taper.from), 0.0, 1.0);
    s = s * s * (3.0 - 2.0 * s);
    const double scale = taper.from_scale + s * (taper.to_scale - taper.from_scale);
    Vec3 unscaled = x / scale;
    unscaled[taper.along] = x[taper.along];
    return std::min(scale, 1.0) * of(unscaled);
  };
}

SignedDistance roughened(SignedDistance of, double amplitude, double wavelength, std::uint64_t seed,
                         std::uint64_t stream) {
  constexpr int kWaves = 8;
  struct Wave {
    Vec3 wave_vector;
    double phase;
  };
  std::array<Wave, kWaves> waves;
  const Random random(seed, stream);
  for (int i = 0; i < kWaves; ++i) {
    const double length = wavelength * (0.75 + 0.75 * random.uniform(1000 + 2 * i));
    waves[i] = {random.direction(i) * (2.0 * std::numbers::pi / length),
                2.0 * std::numbers::pi * random.uniform(1001 + 2 * i)};
  }
  // Of eight waves of a quarter of the amplitude each, the root mean square is half the amplitude.
  const double share = 0.25 * amplitude;
  return [of = std::move(of), waves, share](const Vec3& x) {
    double sum = 0.0;
    for (const Wave& wave : waves) sum += std::sin(wave.wave_vector.dot(x) + wave.phase);
    return of(x) + share * sum;
  };
}

}  // namespace viscera
