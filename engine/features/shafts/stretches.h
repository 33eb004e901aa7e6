// Stretches of a shaft that lie along an organ's surface.
//
// On which side of the shaft the tissue is doesn't follow from the nearest place of the surface: a
// shaft that was swept into an organ may be nearer to its far side. It is the side that it was on:
// from where each place of the shaft was a frame ago, outside, the way to where it is now either
// crosses the surface as it is drawn, and there it went in, or it doesn't.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/features/contact/tissue_sheet.h"
#include "engine/features/shafts/shaft_axis.h"

namespace viscera {

/// All in the organ's frame.
struct ShaftStretch {
  double from = 0.0, to = 0.0;  ///< along the shaft [m]
  std::vector<Vec3> outward;    ///< unit, away from the tissue, across the shaft; at places as far
                                ///< from each other, the first at `from`, the last at `to`
  double half_width = 0.0;      ///< of the line of contact under the last forces [m]
  double pitch = 0.0;           ///< between neighbouring cells [m]
  std::uint64_t begin = 0, end = 0;  ///< its cells in the organ's contact problem
  std::vector<double> along;         ///< of each cell [m]
  std::vector<SurfacePoint> points;  ///< of each cell

  Vec3 outward_at(double along) const;
  static constexpr auto fields() {
    using S = ShaftStretch;
    return std::tuple(field("from", &S::from), field("to", &S::to), field("outward", &S::outward),
                      field("half_width", &S::half_width), field("pitch", &S::pitch),
                      field("begin", &S::begin), field("end", &S::end), field("along", &S::along),
                      field("points", &S::points));
  }
};
static_assert(fields_cover<ShaftStretch>());

/// A shaft about an organ.
struct ShaftAbout {
  ShaftAxis now, before;        ///< in the organ's frame of both moments
  double radius = 0.0;          ///< [m]
  double from = 0.0, to = 0.0;  ///< the part of it that may come near [m]
};

struct Stretches {
  std::vector<ShaftStretch> all;  ///< without cells
  bool surprised = false;         ///< a place was deep inside and hadn't been seen to go in
};

/// On the surface as it is drawn. `last`: of the last frame. At most kMostStretches.
Stretches find_stretches(const ShaftAbout& shaft, const TissueSheet& drawn, double finest_spacing,
                         std::span<const ShaftStretch> last);

inline constexpr std::size_t kMostStretches = 8;

/// Between 0 and the length, what of the axis lies in the box grown by `margin`; nothing: none.
/// Both world [m].
std::optional<std::pair<double, double>> part_in_box(const ShaftAxis& axis, const Box& box,
                                                     double margin);

}  // namespace viscera
