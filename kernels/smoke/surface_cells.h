// The triangles of moving surfaces, binned into those cells that hold particles: what collide.h
// looks into, on the CPU as on the GPU.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/smoke/moving_surface.h"
#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// How far about a particle surfaces count: as about one at rest, and the way that it has gone.
struct SurfaceReach {
  float still = 0.0f;  ///< [m]
  float time = 0.0f;   ///< for which particles have moved as fast as they are now [s]
};

/// Of a particle, by the squares of its speed and of the fastest one's: below kPaces.
std::uint32_t pace_of(float square, float fastest_square);

class SurfaceCells {
 public:
  struct Tracked {
    std::uint64_t id = 0;
    MovingSurface surface;

    static constexpr auto fields() {
      return std::tuple(field("id", &Tracked::id), field("surface", &Tracked::surface));
    }
  };
  struct State {
    std::vector<Tracked> surfaces;  ///< of the last step, as they were given then

    static constexpr auto fields() { return std::tuple(field("surfaces", &State::surfaces)); }
  };

  SurfaceCells() = default;
  SurfaceCells(SurfaceCells&&) noexcept = default;
  SurfaceCells& operator=(SurfaceCells&&) noexcept = default;
  /// A copy has the state, as a restored one: advance() comes first, then build().
  SurfaceCells(const SurfaceCells& other) : state_(other.state_) {}
  SurfaceCells& operator=(const SurfaceCells& other) {
    restore(State(other.state_));
    return *this;
  }

  const State& state() const { return state_; }
  static bool fits(const State& state);
  void restore(State state);

  /// Takes the surfaces in; where each was in the last call is where it starts from. Surfaces that
  /// weren't there, or have another number of vertices, count as not having moved; with vertices
  /// that aren't finite they are left out. `origin` is the domain's least corner, world [m].
  void advance(std::span<const SmokeSurface> surfaces, const Vec3& origin);
  /// The greatest way of a vertex in that step, of surfaces in reach of the box (domain frame) [m].
  float greatest_way(const Eigen::AlignedBox3f& box) const;

  /// Bins what lies within reach of cells with particles, with the surfaces at `fraction` of the
  /// step of length dt, and those capsules. A cell reaches as far as its quickest particle needs,
  /// by its pace. Deterministic for any number of threads.
  void build(std::span<const Float4> positions, std::span<const Float4> velocities, double fraction,
             double dt, float cell, const SurfaceReach& reach,
             std::span<const SmokeCapsule> capsules);
  /// The same for particles that are elsewhere: their grid; the cells that hold any of a pace, a
  /// bit each, one pace after another (kPaces x words of 32); the fastest one's speed [m/s].
  void build(const BinParameters& grid, std::span<const std::uint32_t> cells_of_pace, float fastest,
             double fraction, double dt, const SurfaceReach& reach,
             std::span<const SmokeCapsule> capsules);

  /// Of the grid: origin, size, inverse_cell; the rest is for the caller to fill in.
  const BinParameters& grid() const { return grid_; }
  std::span<const std::uint32_t> cell_begin() const { return cell_begin_; }  ///<  (cells + 1)
  /// Numbers of triangles; in a cell those of a surface follow each other.
  std::span<const std::uint32_t> entries() const { return entries_; }
  std::span<const SurfaceTriangle> triangles() const { return triangles_; }
  /// A ball about each triangle: the mean of the corners, w: the farthest corner's distance.
  std::span<const Float4> balls() const { return balls_; }
  std::span<const std::uint32_t> owners() const { return owners_; }  ///< their surfaces' numbers
  std::span<const std::uint32_t> capsules_near() const {
    return capsules_near_;
  }  ///< bits c % 32 (cells)
  bool empty() const { return entries_.empty() && !any_capsule_; }
  std::size_t memory_bytes() const;

 private:
  struct Group {
    std::uint32_t surface, group;
  };
  struct Near {
    std::uint32_t surface;
    int triangle;
    std::uint32_t cells_end;  // in the cells of its piece of work
  };
  /// What one piece of work found.
  struct Found {
    std::vector<Near> triangles;
    std::vector<std::uint32_t> cells;
    std::size_t first_triangle = 0;  // of the piece, among all
  };

  /// Cells whose quickest particle is of one pace.
  struct Layer {
    std::vector<std::uint64_t> cells;  // bits, each row along x in whole words
    std::vector<Int4> listed;          // the same, ascending by z, y and x
    Eigen::AlignedBox3f box;           // about them, domain frame
    float margin = 0.0f;               // that they reach [m]

    Eigen::AlignedBox3f about(const Eigen::AlignedBox3f& one) const;
  };

  void take_grid(const BinParameters& grid);
  void occupy(std::uint32_t pace, std::uint32_t x, std::uint32_t y, std::uint32_t z);
  void set_reach(float fastest, const SurfaceReach& reach);
  void list_cells(Layer& layer) const;
  void bin_all(double fraction, double dt, std::span<const SmokeCapsule> capsules);
  using NearLayers = std::array<const Layer*, kPaces + 1>;  // up to a null
  NearLayers layers_near(const Eigen::AlignedBox3f& box, const NearLayers& among) const;
  void find_triangles(const Group& group, const MovingSurface::Moment& moment, Found& found) const;
  void sort_entries();
  void find_normals();
  void fill_triangles(double dt);
  template <class Visit>
  bool any_occupied_word(const Layer& layer, const Eigen::AlignedBox3f& box,
                         const Visit& visit) const;
  template <class Visit>
  void for_each_occupied(const Layer& layer, const Eigen::AlignedBox3f& box,
                         const Visit& visit) const;
  void bin_capsules(std::span<const SmokeCapsule> capsules);

  State state_;
  BinParameters grid_;
  std::array<Layer, kPaces> layers_;
  std::size_t words_ = 0;  // of a row of a layer
  std::vector<MovingSurface::Moment> moments_;
  std::vector<MovingSurface*> surfaces_;  // that may be near, as the moments
  std::vector<std::uint32_t> numbers_;    // of those among the given
  std::vector<Group> groups_;
  std::vector<Found> found_;
  struct Vertex {
    std::uint32_t surface;
    int vertex;
  };
  std::vector<Vertex> wanted_;
  std::vector<std::uint32_t> cell_begin_, entries_, capsules_near_;
  std::vector<SurfaceTriangle> triangles_;
  std::vector<Float4> balls_;
  std::vector<std::uint32_t> owners_;
  bool any_capsule_ = false;
};
static_assert(StateOwner<SurfaceCells> && fields_cover<SurfaceCells::State>() &&
              fields_cover<SurfaceCells::Tracked>());

}  // namespace viscera
