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

// Where the first of two bodies is farther than this, their intersection is at least as far, and
// the second isn't asked: bodies made of other bodies would take minutes to mesh [m].
constexpr double kClear = 6e-3;

// Polynomial smooth minimum, cubic: the crease between two surfaces becomes a fillet of about this
// width, with continuous curvature, so that no line shows in highlights.
double smooth_minimum(double a, double b, double width) {
  if (width <= 0.0) return std::min(a, b);
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - h * h * h * width / 6.0;
}

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
    const double f = a(x);
    if (f > smooth + kClear) return f;
    return -smooth_minimum(-f, -b(x), smooth);
  };
}

SignedDistance subtract(SignedDistance from, SignedDistance taken, double smooth) {
  return [from = std::move(from), taken = std::move(taken), smooth](const Vec3& x) {
    const double f = from(x);
    if (f > smooth + kClear) return f;
    return -smooth_minimum(-f, taken(x), smooth);
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

SignedDistance mirrored(SignedDistance of, int along) {
  return [of = std::move(of), along](const Vec3& x) {
    Vec3 other = x;
    other[along] = -x[along];
    return of(other);
  };
}

SignedDistance lobulated(SignedDistance of, double height, double size, std::uint64_t seed,
                         std::uint64_t stream) {
  const Random random(seed, stream);
  // One lobule's middle in each cell of a grid. The nearest of 27 may miss one farther than a cell
  // away; there the surface is at its lowest anyway.
  const auto nearest2 = [random, size](const Vec3& x) {
    const Eigen::Array3d home = (x / size).array().floor();
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 27; ++k) {
      const Eigen::Array3d cell = home + Eigen::Array3d(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
      const auto coordinate = [&cell](int a) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[a]) + (1 << 20));
      };
      const std::uint64_t bits =
          random.bits(coordinate(0) | coordinate(1) << 21 | coordinate(2) << 42);
      const auto share = [bits](int shift) {
        return static_cast<double>(bits >> shift & 0xfffff) / 0x100000;
      };
      const Vec3 middle = size * (cell + Eigen::Array3d(share(0), share(20), share(40))).matrix();
      least = std::min(least, (x - middle).squaredNorm());
    }
    return least;
  };
  return [of = std::move(of), nearest2, height, size](const Vec3& x) {
    const double f = of(x);
    // Far from the surface the bumps decide nothing.
    if (f > 3.0 * height || f < -2.0 * height) return f > 0.0 ? f - height : f;
    return f - height * std::max(0.0, 1.0 - nearest2(x) / (size * size));
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
