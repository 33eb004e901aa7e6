// From contact forces to the drawn surfaces of all touched organs on the GPU: the twin of
// kernels/contact/deformation.h. What never changes (compliances, carriers, rest shapes) is
// uploaded once; a frame sends loads, and positions and normals stay where the renderer can draw
// them from.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/compute.h"
#include "engine/gpu/gpu_limits.h"
#include "engine/gpu/pass_timer.h"
#include "engine/gpu/program.h"
#include "kernels/base/result.h"
#include "kernels/contact/deformation.h"
#include "kernels/contact/half_columns.h"
#include "kernels/contact/organ_table.h"

namespace viscera {

/// An organ as a frame deforms it. Organs with the same compliance and drawn surface share them.
struct GpuOrgan {
  std::string name;
  const SurfaceCompliance* compliance = nullptr;
  const DrawnSurface* drawn = nullptr;
  const HalfColumns* half = nullptr;  ///< where given, it is read in place of `compliance`
};

/// What deforms one organ in a frame.
struct GpuLoads {
  std::size_t organ = 0;               ///< index into the organs that create() was given
  std::span<const int> touched;        ///< as in ContactResponse
  std::span<const Vec3> loads;         ///< on those [N]
  std::span<const int> near_vertices;  ///< of near_field_on_surface: each vertex at most once
  std::span<const Vec3f> near_field;   ///< there [m]
};

/// Needs the current EGL context for as long as it lives.
class GpuDeformation {
 public:
  /// Uploads what all the organs need; they lie at rest. An organ that the limits don't admit stays
  /// on the CPU, and refusal() says why. Fails where the kernels don't compile, an organ's parts
  /// don't fit one another, or the device's memory is too small.
  static Result<GpuDeformation> create(std::span<const GpuOrgan> organs,
                                       GpuLimits limits = GpuLimits::of_device());

  /// Why an organ is not on the GPU; empty where it is.
  const std::string& refusal(std::size_t organ) const { return bodies_[organ].refusal; }

  /// Positions and normals of these organs under their loads, one dispatch a pass for all of them
  /// (the compliance product: one a storage buffer, where the compliances need several; those in
  /// half precision have their own); other
  /// organs stay as they are. `timer`, started, gets the marks "upload", "product", "carry", "near"
  /// and "normals". Fails, changing nothing, for an organ that isn't there or is named twice, for
  /// places or vertices that it doesn't have, and for lists that don't match.
  Result<void> deform(std::span<const GpuLoads> organs, PassTimer* timer = nullptr);

  /// Three floats a vertex, all organs one after another; an organ's begin at first_vertex().
  const Buffer& positions() const { return positions_; }
  const Buffer& normals() const { return normals_; }
  std::size_t first_vertex(std::size_t organ) const { return bodies_[organ].first_vertex; }

  /// Copies to the CPU: for tests, and for what the CPU must know.
  std::vector<float> read_displacements(std::size_t organ) const;  ///< of the places, 3 x places
  std::vector<Vec3f> read_positions(std::size_t organ) const;
  std::vector<Vec3f> read_normals(std::size_t organ) const;

  std::size_t bytes() const { return bytes_; }           ///< on the device
  std::size_t shards() const { return shards_.size(); }  ///< storage buffers of compliances

 private:
  /// Consecutive tiles of one compliance in one storage buffer.
  struct TileRun {
    std::size_t shard, first_tile, tiles;  // the first counted within the compliance
    std::size_t offset;                    // in the shard [fours of rows]
  };
  /// What instances share.
  struct Model {
    std::size_t places = 0, touchable = 0, vertices = 0;
    bool half = false;
    double scale = 1.0;  // of half-precision columns
    std::size_t first_slice = 0;
    std::vector<TileRun> runs;
    const GpuOrgan* source = nullptr;  // while creating
  };
  /// A storage buffer of columns, all in one precision.
  struct Shard {
    bool half = false;
    std::size_t size = 0;  // [fours of rows]
    Buffer columns;
  };
  struct Body {
    std::string name, refusal;
    std::size_t model = 0;
    std::size_t displacement = 0;  // first component
    std::size_t first_vertex = 0;
  };
  struct Shape;

  explicit GpuDeformation(GpuLimits limits) : limits_(limits), queue_(limits.groups_per_axis) {}
  Result<void> load_kernels();
  std::string place_model(Model& model, Shape& shape);
  void place_columns(Model& model);
  void place_bodies(std::span<const GpuOrgan> organs, Shape& shape);
  Result<void> upload(const Shape& shape);
  template <class Number>
  void upload_columns(const Model& model, const Number* values);
  Result<void> check(std::span<const GpuLoads> organs) const;
  void upload_loads(std::span<const GpuLoads> organs);
  void sum_columns();
  void move_surfaces(PassTimer* timer);

  GpuLimits limits_;
  ComputeQueue queue_;
  Program product_, product_half_, carry_, near_, normals_kernel_;
  std::vector<Model> models_;
  std::vector<Body> bodies_;
  std::size_t bytes_ = 0;

  std::vector<Shard> shards_;
  Buffer slice_begin_carriers_, carriers_, slice_begin_corners_, corners_, rest_;
  Buffer displacements_, positions_, normals_;

  /// A dispatch's part of the organ table.
  struct Range {
    std::size_t first = 0, count = 0, groups = 0;
  };
  std::vector<Range> shard_ranges_;
  Range surface_range_;
  std::size_t near_count_ = 0;
  Buffer table_, loads_, near_field_;
};

}  // namespace viscera
