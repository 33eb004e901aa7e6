// Drawn surfaces of touched organs on the GPU: the deform stage hands over what loads them, the
// shaders work while tissue burns and smoke moves, the fetch stage takes positions back, as
// the next frame's contact needs them. Normals stay on the GPU, where the renderer draws from.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/gpu/gpu_deformation.h"
#include "engine/gpu/pass_timer.h"
#include "engine/gpu/read_back.h"
#include "engine/render/view.h"
#include "engine/simulation/components.h"

namespace viscera {

class EglContext;
class World;

class GpuSurfaces {
 public:
  /// Uploads what the touchable organs of the world need; organs with one model share it. Null
  /// where there is none. An organ that the device's limits don't admit stays on the CPU. Fails as
  /// GpuDeformation::create does. One thread.
  static Result<std::shared_ptr<GpuSurfaces>> create(std::shared_ptr<EglContext> context,
                                                     const World& world);
  ~GpuSurfaces();
  GpuSurfaces(const GpuSurfaces&) = delete;
  GpuSurfaces& operator=(const GpuSurfaces&) = delete;

  /// Whether this organ is deformed here: none any more once the device has failed.
  bool holds(Entity organ) const { return trouble_.empty() && index_of(organ).has_value(); }
  /// Why nothing is deformed here any more; empty: all is well.
  const std::string& trouble() const { return trouble_; }
  /// Ends it, where somebody else has found that the device failed. The first reason stays.
  void fail(const std::string& why);
  /// Why organs stay on the CPU, one sentence each.
  const std::vector<std::string>& refusals() const { return refusals_; }

  /// Takes the loads of an organ that is held here: it's deformed in this frame.
  void add(Entity organ, const DrawnSurface& drawn, const OrganContact& contact);
  /// One dispatch a pass for all organs added since the last frame; doesn't wait.
  void start();
  /// Waits, then gives each of those organs' positions [m]; an empty span where the device failed.
  void finish(const std::function<void(Entity, std::span<const Vec3f>)>& take);

  /// Where the renderer finds an organ that was deformed here last.
  DeviceSurface surface(Entity organ) const;

  std::size_t organs() const { return index_.size(); }
  std::size_t bytes() const { return deformation_.bytes(); }  ///< on the device
  /// Times on the device of every frame that deformed something, by pass [s].
  struct Pass {
    std::string name;
    std::vector<double> seconds;
  };
  const std::vector<Pass>& passes() const { return passes_; }

 private:
  /// An organ's loads, until they are on their way.
  struct Added {
    Entity organ;
    std::size_t index = 0;
    const ContactResponse* response = nullptr;
    std::vector<int> near_vertices;
    std::vector<Vec3f> near_field;
  };
  GpuSurfaces(std::shared_ptr<EglContext> context, GpuDeformation deformation);
  std::optional<std::size_t> index_of(Entity organ) const;
  void note_times();

  std::shared_ptr<EglContext> context_;  // first made, last destroyed
  GpuDeformation deformation_;
  ReadBack read_back_;
  PassTimer timer_;
  std::map<std::uint32_t, std::size_t> index_;  // entity's index -> organ of deformation_
  std::vector<std::size_t> vertices_;           // of the organs of deformation_
  std::vector<std::string> refusals_;
  std::vector<Added> added_;
  bool started_ = false;
  std::string trouble_;
  std::vector<Pass> passes_;
};

}  // namespace viscera
