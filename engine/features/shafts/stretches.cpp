#include "engine/features/shafts/stretches.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/features/contact/contact_cells.h"

namespace viscera {
namespace {

/// Where nothing is near, the search goes on this far from there [m].
constexpr double kLookAhead = 10e-3;
/// No finer than this along the shaft [m].
constexpr double kFinestStep = 1e-3;
/// Tissue that faces the shaft's end, not its side, isn't beside it: the least part of its normal
/// across the shaft.
constexpr double kLeastAcross = 0.3;
/// Places of a stretch where the direction of contact is found; between them it is interpolated.
constexpr int kMostPlaces = 12;
/// Passes for that direction: it goes on from the last frame's.
constexpr int kPasses = 2;
/// A place that was inside to a quarter of the radius and isn't known is a surprise.
constexpr double kSurprise = 0.25;
/// A stretch keeps its ends where they would move by less than this share of its cells' pitch: the
/// same cells have the same response.
constexpr double kSameEnds = 0.25;

/// Part of `v` across the axis.
Vec3 across(const Vec3& v, const ShaftAxis& axis) {
  return v - v.dot(axis.direction) * axis.direction;
}

/// A place of the shaft that tissue lies beside.
struct Sample {
  double along = 0.0;
  Vec3 outward = Vec3::Zero();
};

class Search {
 public:
  Search(const ShaftAbout& shaft, const TissueSheet& drawn, double finest_spacing,
         std::span<const ShaftStretch> last)
      : shaft_(shaft),
        drawn_(drawn),
        last_(last),
        step_(std::max(shaft.radius, kFinestStep)),
        ring_(std::max(2.0 * shaft.radius, 1.2 * finest_spacing)) {}

  Stretches run() {
    double before = shaft_.from;  // the last place that wasn't near
    double s = shaft_.from;
    while (s <= shaft_.to && found_.all.size() < kMostStretches) {
      const Vec3 at = shaft_.now.at(s);
      const double moved = (at - shaft_.before.at(s)).norm();
      const double near = std::max(shaft_.radius + kContactMargin, moved);
      const auto hit = drawn_.closest(at, near + kLookAhead);
      const auto sample = hit && hit->distance < near ? beside(s, at, moved, *hit) : std::nullopt;
      if (sample) {
        if (samples_.empty()) begins_ = std::max(before, s - step_);
        samples_.push_back(*sample);
        s += step_;
        continue;
      }
      if (!samples_.empty()) close(s);
      before = s;
      const double clear = hit ? hit->distance - near : kLookAhead;
      s += std::max(clear, 0.5 * step_);
    }
    if (!samples_.empty()) close(std::min(s, shaft_.to));
    return std::move(found_);
  }

 private:
  /// Which way is out of the tissue at a place near it; nothing where it is beyond the shaft's end.
  std::optional<Sample> beside(double s, const Vec3& at, double moved,
                               const TissueSheet::Hit& nearest) {
    const Vec3 known = last_outward(s);
    if (!known.isZero(0.0)) return Sample{s, known};
    Vec3 normal = drawn_.normal(nearest.point);
    if (moved > 0.0) {
      const Vec3 was = shaft_.before.at(s);
      if (const auto entered = drawn_.cast(was, (at - was) / moved, moved))
        normal = drawn_.normal(entered->point);
      else if ((at - nearest.position).dot(normal) < -kSurprise * shaft_.radius)
        found_.surprised = true;
    }
    const Vec3 out = across(normal, shaft_.now);
    if (!(out.norm() > kLeastAcross)) return std::nullopt;
    return Sample{s, out.normalized()};
  }

  /// Of the last frame's stretch there; zero: there was none.
  Vec3 last_outward(double s) const {
    for (const ShaftStretch& stretch : last_) {
      if (s < stretch.from - step_ || s > stretch.to + step_) continue;
      const Vec3 out = across(stretch.outward_at(s), shaft_.now);
      if (out.norm() > kLeastAcross) return out.normalized();
    }
    return Vec3::Zero();
  }

  void close(double end) {
    ShaftStretch stretch;
    stretch.from = begins_;
    stretch.to = std::min({end, samples_.back().along + step_, shaft_.to});
    keep_ends(stretch);
    place_sides(stretch);
    samples_.clear();
    found_.all.push_back(std::move(stretch));
  }

  void keep_ends(ShaftStretch& stretch) const {
    double widths = 0.0;
    int count = 0;
    for (const ShaftStretch& last : last_) {
      if (last.to < stretch.from || last.from > stretch.to) continue;
      widths += last.half_width;
      ++count;
      if (std::abs(last.from - stretch.from) < kSameEnds * last.pitch &&
          std::abs(last.to - stretch.to) < kSameEnds * last.pitch) {
        stretch.from = last.from;
        stretch.to = last.to;
      }
    }
    stretch.half_width = count > 0 ? widths / count : 0.0;
  }

  void place_sides(ShaftStretch& stretch) const {
    const double length = stretch.to - stretch.from;
    const int parts =
        std::clamp(static_cast<int>(std::ceil(length / (2.0 * shaft_.radius))), 1, kMostPlaces - 1);
    std::vector<Vec3> found;
    for (int i = 0; i <= parts; ++i) {
      const double s = stretch.from + length * i / parts;
      found.push_back(mean_outward(s, nearest_sample(s)));
    }
    // Neighbours steady each other.
    for (std::size_t i = 0; i < found.size(); ++i) {
      Vec3 sum = 2.0 * found[i];
      if (i > 0) sum += found[i - 1];
      if (i + 1 < found.size()) sum += found[i + 1];
      stretch.outward.push_back(sum.norm() > 1.0 ? Vec3(sum.normalized()) : found[i]);
    }
  }

  Vec3 nearest_sample(double s) const {
    return std::ranges::min_element(samples_, {},
                                    [&](const Sample& one) { return std::abs(one.along - s); })
        ->outward;
  }

  /// The mean normal of the tissue to both sides, wider than the shaft's own dent, whose walls
  /// cancel.
  Vec3 mean_outward(double s, Vec3 outward) const {
    const Vec3 at = shaft_.now.at(s);
    const double high = ring_ + 2.0 * shaft_.radius;
    for (int pass = 0; pass < kPasses; ++pass) {
      const Vec3 aside = shaft_.now.direction.cross(outward);
      Vec3 sum = Vec3::Zero();
      for (const double share : {-1.0, -0.6, 0.6, 1.0}) {
        const Vec3 origin = at + share * ring_ * aside + high * outward;
        if (const auto hit = drawn_.cast(origin, -outward, 2.0 * high))
          sum += drawn_.normal(hit->point);
      }
      const Vec3 out = across(sum, shaft_.now);
      if (!(out.norm() > 1.0)) break;
      outward = out.normalized();
    }
    return outward;
  }

  const ShaftAbout& shaft_;
  const TissueSheet& drawn_;
  std::span<const ShaftStretch> last_;
  double step_, ring_;
  double begins_ = 0.0;
  std::vector<Sample> samples_;
  Stretches found_;
};

}  // namespace

Vec3 ShaftStretch::outward_at(double s) const {
  if (outward.empty()) return Vec3::Zero();
  const double length = to - from;
  const double place = length > 0.0 ? std::clamp((s - from) / length, 0.0, 1.0) *
                                          static_cast<double>(outward.size() - 1)
                                    : 0.0;
  const auto i = std::min(static_cast<std::size_t>(place), outward.size() - 1);
  const std::size_t j = std::min(i + 1, outward.size() - 1);
  const double share = place - static_cast<double>(i);
  const Vec3 mixed = (1.0 - share) * outward[i] + share * outward[j];
  return mixed.norm() > 0.0 ? Vec3(mixed.normalized()) : outward[i];
}

Stretches find_stretches(const ShaftAbout& shaft, const TissueSheet& drawn, double finest_spacing,
                         std::span<const ShaftStretch> last) {
  return Search(shaft, drawn, finest_spacing, last).run();
}

std::optional<std::pair<double, double>> part_in_box(const ShaftAxis& axis, const Box& box,
                                                     double margin) {
  double from = 0.0, to = axis.length;
  for (int c = 0; c < 3; ++c) {
    const double low = box.min()[c] - margin - axis.begin[c];
    const double high = box.max()[c] + margin - axis.begin[c];
    if (std::abs(axis.direction[c]) < 1e-12) {
      if (low > 0.0 || high < 0.0) return std::nullopt;
      continue;
    }
    const double a = low / axis.direction[c], b = high / axis.direction[c];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  if (!(from < to)) return std::nullopt;
  return std::pair(from, to);
}

}  // namespace viscera
