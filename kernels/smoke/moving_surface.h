// A closed triangle surface that moves and deforms in a step of smoke, and its shape at any moment
// of the step.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// What of a closed, outward-oriented triangle surface stays while it deforms: made once.
class SurfaceTopology {
 public:
  using Triangle = Eigen::Vector3i;

  explicit SurfaceTopology(std::vector<Triangle> triangles);

  std::span<const Triangle> triangles() const { return triangles_; }
  /// The triangle beyond the edge from corner e to corner e + 1; -1 where there is none.
  int beyond(std::size_t triangle, int e) const { return beyond_[triangle][e]; }
  std::span<const int> around(int vertex) const {  ///< triangles at a vertex
    return std::span(fans_).subspan(fan_begin_[vertex],
                                    fan_begin_[vertex + 1] - fan_begin_[vertex]);
  }
  std::size_t vertices() const { return fan_begin_.size() - 1; }
  /// The same for the same triangles, in any process.
  std::uint64_t signature() const { return signature_; }

 private:
  std::vector<Triangle> triangles_;
  std::vector<std::array<int, 3>> beyond_;
  std::vector<std::size_t> fan_begin_;
  std::vector<int> fans_;
  std::uint64_t signature_ = 0;
};

/// A surface as it is at the end of a step.
struct SmokeSurface {
  std::uint64_t id = 0;  ///< by which it is known in the next step
  const SurfaceTopology* topology = nullptr;
  std::span<const Vec3f> positions;  ///< of the vertices, own frame [m]
  Pose pose;                         ///< of that frame in the world
  /// Counts changes of `positions`: the same again says that they are. 0: not known.
  std::uint64_t version = 0;
};

class MovingSurface {
 public:
  using Box3f = Eigen::AlignedBox3f;
  /// Triangles of a block: few enough that one is small, enough that boxes are few. As many blocks
  /// make a group.
  static constexpr std::size_t kBlock = 16;

  /// Own frame to domain frame.
  struct Placement {
    Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();
    Vec3f shift = Vec3f::Zero();

    Vec3f operator()(const Vec3f& own) const { return turn * own + shift; }
    Box3f operator()(const Box3f& own) const;
    static constexpr auto fields() {
      return std::tuple(field("turn", &Placement::turn), field("shift", &Placement::shift));
    }
  };
  /// How the last step left it.
  struct State {
    std::uint64_t topology = 0;  ///< its signature
    std::uint64_t version = 0;   ///< of the shape
    std::vector<Vec3f> shape;    ///< own frame [m]                                (vertices)
    Box3f bounds;                ///< of the shape
    Placement place;
    /// Triangles near each other stand together: as the shape was when they were first asked for.
    std::vector<int> order;
    /// Own frame. Those of a step in which the shape changed hold for the next ones without a
    /// change too, and are wider than theirs.
    std::vector<Box3f> blocks, groups;
    bool blocks_fit = false;

    static constexpr auto fields() {
      return std::tuple(field("topology", &State::topology), field("version", &State::version),
                        field("shape", &State::shape), field("bounds", &State::bounds),
                        field("place", &State::place), field("order", &State::order),
                        field("blocks", &State::blocks), field("groups", &State::groups),
                        field("blocks_fit", &State::blocks_fit));
    }
  };

  MovingSurface() = default;
  MovingSurface(MovingSurface&&) noexcept = default;
  MovingSurface& operator=(MovingSurface&&) noexcept = default;
  /// A copy has the state, as a restored one: advance() comes first.
  MovingSurface(const MovingSurface& other) : state_(other.state_) {}
  MovingSurface& operator=(const MovingSurface& other) {
    restore(State(other.state_));
    return *this;
  }

  const State& state() const { return state_; }
  /// Whether its numbers agree. Whether it is of a surface's triangles, advance() finds out.
  static bool fits(const State& state);
  void restore(State state);

  /// The step that ends with this; it starts where the last one ended, or, for a surface of other
  /// vertices than then, where this is. `origin` is the domain's least corner, world [m]. False
  /// where positions aren't finite.
  bool advance(const SmokeSurface& surface, const Vec3& origin);

  const SurfaceTopology& topology() const { return *topology_; }
  const Box3f& box() const { return box_; }  ///< of the whole step, domain frame [m]
  float way() const { return way_; }         ///< the greatest of a vertex in the step [m]

  /// Triangles near each other stand together here; blocks and groups are of this order.
  std::span<const int> order() const { return state_.order; }
  /// Makes the boxes of blocks and groups, where the step has others than the last.
  void fit_blocks();
  std::size_t blocks() const { return state_.blocks.size(); }
  std::size_t groups() const { return state_.groups.size(); }
  Box3f block(std::size_t b) const {
    return swept(state_.blocks[b]);
  }  ///< in the step, domain frame [m]
  Box3f group(std::size_t g) const { return swept(state_.groups[g]); }
  std::size_t memory_bytes() const;

  /// The surface at a fraction of the step. While it holds its shape and doesn't turn, the normals
  /// at vertices are kept from one moment to the next; so there may be one moment at a time.
  class Moment {
   public:
    Moment(MovingSurface& surface, float fraction);

    Vec3f corner(int vertex) const { return placed(own(vertex)); }  ///< domain frame [m]
    Vec3f way(int vertex) const;                                    ///< in the whole step [m]
    Vec3f face_normal(int triangle) const { return turned(own_face_normal(triangle)); }
    /// Whether corner_normal() needs find_normal() first; true once for each vertex.
    bool lacks_normal(int vertex);
    /// May be called at once for several vertices.
    void find_normal(int vertex);
    /// Sum of the faces' around by angle [Baerentzen2005].
    Vec3f corner_normal(int vertex) const { return turned(surface_->normals_[vertex]); }

   private:
    Vec3f own(int vertex) const;
    Vec3f own_face_normal(int triangle) const;
    Vec3f placed(const Vec3f& own) const { return turns_ ? own : Vec3f(turn_ * own + shift_); }
    Vec3f turned(const Vec3f& own) const { return turns_ ? own : Vec3f(turn_ * own); }

    MovingSurface* surface_;
    float fraction_;
    bool turns_;  // then everything is computed in the domain's frame
    Eigen::Matrix3f turn_;
    Vec3f shift_;
  };

 private:
  bool take_shape(const SmokeSurface& surface);
  void measure();
  const std::vector<Vec3f>& start() const { return keeps_shape_ ? state_.shape : before_; }
  Box3f swept(const Box3f& own) const { return from_(own).merged(state_.place(own)); }

  State state_;
  // Of the step.
  const SurfaceTopology* topology_ = nullptr;
  std::vector<Vec3f> before_;  // own frame; isn't read of one that keeps its shape
  bool keeps_shape_ = false;
  bool known_ = false;  // the shape is from the last step
  bool turns_ = false;
  Placement from_;
  Box3f box_;  // domain frame
  float way_ = 0.0f;
  // Of the shape or a moment, made when they are asked for.
  std::vector<Vec3f> normals_;
  std::vector<std::uint32_t> found_;  // the round in which a normal was found
  std::uint32_t round_ = 0;
  bool normals_hold_ = false;  // those of this round are of the shape as it is now
};
static_assert(StateOwner<MovingSurface> && fields_cover<MovingSurface::State>() &&
              fields_cover<MovingSurface::Placement>());

}  // namespace viscera
