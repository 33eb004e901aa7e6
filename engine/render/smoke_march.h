// Light marched through smoke: a grid of columns over the picture and slices along the view axis
// that holds what has gathered from the lens up to each slice, for pixels to read at their own
// distance.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "engine/render/canvas.h"
#include "engine/render/scene_buffers.h"

namespace viscera {

/// Volumes of smoke that a picture may have: a scene's eight, and fog.
inline constexpr std::size_t kMostSmokeVolumes = 9;

class SmokeMarch {
 public:
  static Result<SmokeMarch> create(const QualitySettings& settings);
  /// False when no smoke is to be seen, and nothing was computed. `with_temperature`: also the
  /// smoke's temperature on the way.
  Result<bool> march(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas,
                     bool with_temperature);
  /// What smoke.frag reads, after a march that gave true.
  void bind(Program& program) const;

 private:
  struct Programs {
    Program light, march;
  };
  Result<Programs*> programs_for(std::size_t volumes, bool with_temperature);
  /// Axial distances between which smoke may be seen [m]; empty where the second is the less.
  Eigen::Vector2f find_slices(const FrameView& view, const SceneBuffers& buffers,
                              const std::vector<std::size_t>& volumes) const;
  int samples_in_slice(const FrameView& view, const std::vector<std::size_t>& volumes) const;
  void set_medium(Program& program, const FrameView& view, const SceneBuffers& buffers,
                  const std::vector<std::size_t>& volumes);

  int columns_ = 0, slice_count_ = 0;
  std::map<std::pair<std::size_t, bool>, Programs> programs_;  // by volumes, with temperature
  Texture light_, marched_, heated_;
  Eigen::Vector2f light_tangents_ = Eigen::Vector2f::Ones();
  Eigen::Vector2f slices_ = Eigen::Vector2f::Zero();      // axial [m]
  Eigen::Vector3f background_ = Eigen::Vector3f::Zero();  // optics [1/m]
};

}  // namespace viscera
