// Where a ball-ended tool stands on a surface at rest, and which places of it lie under the ball.
//
// The foot is the place x whose mean normal up(x), taken over a ring about it, points at the ball's
// centre c: (c - x) x up(x) = 0. The nearest place, which one would take first, jumps where a tool
// that is deep inside passes a facet's edge; this one moves smoothly, because up does, and so the
// force has no jumps. It is found from the last foot by steps over the surface.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "kernels/contact/patch_contact.h"
#include "kernels/hive/surface_walk.h"

namespace viscera {

/// Which way cells push the tissue.
enum class CellWays {
  kOwnNormals,  ///< each along the ball's normal, as pressure without friction does
  kTogether     ///< all along the foot's normal: what NonlinearHive is made of, and the published
                ///< hive
};

class ToolFoot {
 public:
  /// `radius` [m] of the ball; `rings` of the hexagonal pattern of cells: 1 + 3 rings (rings + 1)
  /// of them. The only place that allocates.
  ToolFoot(double radius, int rings, CellWays ways);

  /// Begins at this place, facing along its normal, under a ball about `centre`.
  void start(const SurfaceSpot& spot, const Vec3& centre) noexcept;
  void forget() { state_.spot.point.triangle = -1; }
  bool standing() const { return state_.spot.on_surface(); }

  /// Moves the foot under a ball about `centre` (organ's frame, at rest). False where it is lost:
  /// the surface is farther from the centre than `reach` [m], or the way ended at a border.
  bool follow(const WalkableSurface& surface, const Vec3& centre, double reach) noexcept;

  const SurfaceSpot& spot() const { return state_.spot; }
  const Vec3& up() const { return state_.up; }  ///< unit, out of the tissue
  /// How deep the ball is below the foot's height; negative: a gap [m].
  double depth() const { return state_.depth; }

  /// The pattern of cells for the present depth: rest places, directions, areas, and how far each
  /// must go along its direction. A pure function of where the tool is.
  void lay_cells(const WalkableSurface& surface) noexcept;
  std::span<const ContactCell> cells() const { return state_.cells; }
  std::span<const double> depths() const { return state_.depths; }
  /// By how much the cells' depths grow per depth of the tool.
  double deepening(std::size_t cell) const { return -state_.cells[cell].direction.dot(state_.up); }
  /// Which way each cell's tissue pushes the tool per force along `direction`: the tissue under a
  /// cell may be tilted, and a tool without friction that goes aside climbs it. It is the gradient
  /// of what the cells measure as depth, so that force is what the stored energy falls by. Of all
  /// cells together that is what they push the tissue by, turned round, to the pattern's accuracy.
  std::span<const Vec3> pushes() const { return state_.pushes; }
  /// No edge lies under the tool. Beyond one, as across a cut, a walk misses what the ball meets.
  bool whole() const;
  double across() const { return state_.across; }  ///< radius of the pattern [m]

  struct State {
    SurfaceSpot spot;
    Vec3 up = Vec3::UnitZ(), side = Vec3::UnitX(), centre = Vec3::Zero();
    double depth = -1.0, across = 0.0;
    std::vector<ContactCell> cells;
    std::vector<double> depths;
    std::vector<double> heights;  ///< of the surface under each cell, from the centre along up [m]
    std::vector<Vec3> pushes;
    static constexpr auto fields() {
      return std::tuple(field("spot", &State::spot), field("up", &State::up),
                        field("side", &State::side), field("centre", &State::centre),
                        field("depth", &State::depth), field("across", &State::across),
                        field("cells", &State::cells), field("depths", &State::depths),
                        field("heights", &State::heights), field("pushes", &State::pushes));
    }
  };
  const State& state() const { return state_; }
  void restore(State state) { state_ = std::move(state); }
  /// Of a foot with as many cells, on this surface.
  bool fits(const State& state, const WalkableSurface& surface) const;

 private:
  Vec3 mean_normal(const WalkableSurface& surface, const SurfaceSpot& spot) const noexcept;

  void lean(std::size_t cell, double pitch) noexcept;

  /// The slope at a cell of the pattern, from its neighbours' heights: a sum of weight *
  /// difference.
  struct Neighbour {
    std::size_t cell;
    Vec2 weight;  ///< for pitch 1
  };

  double radius_;
  CellWays ways_;
  std::vector<Vec2> pattern_;  ///< of pitch 1
  std::vector<std::vector<Neighbour>> neighbours_;
  int rings_;
  State state_;
};
static_assert(fields_cover<ToolFoot::State>());

}  // namespace viscera
