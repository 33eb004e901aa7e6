// The triangles of moving surfaces, binned into those cells that hold particles: what collide.h
// looks into, on the CPU as on the GPU.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

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

 private:
  std::vector<Triangle> triangles_;
  std::vector<std::array<int, 3>> beyond_;
  std::vector<std::size_t> fan_begin_;
  std::vector<int> fans_;
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

class SurfaceCells {
 public:
  /// Takes the surfaces in; where each was in the last call is where it starts from. Surfaces that
  /// weren't there, or have another number of vertices, count as not having moved; with vertices
  /// that aren't finite they are left out. `origin` is the domain's least corner, world [m].
  void advance(std::span<const SmokeSurface> surfaces, const Vec3& origin);
  /// The greatest way of a vertex in that step, of surfaces in reach of the box (domain frame) [m].
  float greatest_way(const Eigen::AlignedBox3f& box) const;

  /// Bins what lies within `margin` of cells with particles, with the surfaces at `fraction` of
  /// the step of length dt, and those capsules.
  void build(std::span<const Float4> positions, double fraction, double dt, float cell,
             float margin, std::span<const SmokeCapsule> capsules);
  /// The same for particles that are elsewhere: their grid, and whether a cell holds any (cells).
  void build(const BinParameters& grid, std::vector<std::uint8_t> occupied, double fraction,
             double dt, float margin, std::span<const SmokeCapsule> capsules);

  /// Of the grid: origin, size, inverse_cell; the rest is for the caller to fill in.
  const BinParameters& grid() const { return grid_; }
  std::span<const std::uint32_t> cell_begin() const { return cell_begin_; }  ///<  (cells + 1)
  std::span<const std::uint32_t> entries() const { return entries_; }  ///< numbers of triangles
  std::span<const SurfaceTriangle> triangles() const { return triangles_; }
  std::span<const std::uint32_t> capsules_near() const { return capsules_near_; }  ///< bits (cells)
  bool empty() const { return entries_.empty() && !any_capsule_; }
  std::size_t memory_bytes() const;

 private:
  /// Own frame to domain frame.
  struct Placement {
    Eigen::Matrix3f turn;
    Vec3f shift;

    Vec3f operator()(const Vec3f& own) const { return turn * own + shift; }
    Eigen::AlignedBox3f operator()(const Eigen::AlignedBox3f& own) const;
  };
  struct Tracked {
    const SurfaceTopology* topology = nullptr;
    std::uint64_t version = 0;
    std::vector<Vec3f> before, now;  // own frame; `before` isn't read of one that keeps its shape
    bool keeps_shape = false;        // in this step
    bool known = false;              // `now` is from the last step
    Placement from, to;
    Eigen::AlignedBox3f own_box, box;  // of `now`, own frame; of the whole step, domain frame
    float way = 0.0f;
    bool present = false;
    /// Triangles near each other, kBlock at a time, and the boxes of those in the step, own frame.
    std::vector<int> order;
    std::vector<Eigen::AlignedBox3f> blocks;
    bool blocks_fit = false;

    const std::vector<Vec3f>& start() const { return keeps_shape ? now : before; }
    bool take_shape(const SmokeSurface& surface);
    void measure();
    void fit_blocks();
  };
  /// What is known of the surface being binned at a fraction of the step: vertices are placed when
  /// they are first asked for.
  class Placed;
  struct Entry {
    std::uint32_t cell, triangle;
  };
  void bin_surface(Tracked& surface, float number, double fraction, double dt, float margin);
  bool any_occupied(const Eigen::AlignedBox3f& box) const;
  template <class Visit>
  void for_each_occupied(const Eigen::AlignedBox3f& box, const Visit& visit) const;
  void bin_capsules(std::span<const SmokeCapsule> capsules, float margin);

  std::unordered_map<std::uint64_t, Tracked> tracked_;
  std::vector<std::uint64_t> order_;  // ids as given
  BinParameters grid_;
  Eigen::AlignedBox3f particles_;
  std::vector<std::uint8_t> occupied_;
  std::vector<Entry> found_;
  std::vector<Vec3f> corners_, normals_;  // of the surface being binned: vertices, their normals
  std::vector<std::uint32_t> placed_, turned_;  // the round in which each of those was found
  std::uint32_t round_ = 0;
  std::vector<int> near_;  // triangles
  std::vector<std::uint32_t> cell_begin_, entries_, capsules_near_;
  std::vector<SurfaceTriangle> triangles_;
  bool any_capsule_ = false;
};

}  // namespace viscera
