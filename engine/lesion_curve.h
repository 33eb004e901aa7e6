// How a scene's first burn grows: lesion.csv and lesion.svg, with what is published of burns like
// it.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/io/svg_plot.h"
#include "engine/scene/scene.h"
#include "engine/world.h"
#include "kernels/heat/lesion.h"

namespace viscera {

struct LesionRow {
  double time = 0.0;  ///< since current first flowed [s]
  Lesion lesion;
  double power = 0.0;        ///< into tissue that is heated [W]
  double temperature = 0.0;  ///< of the hottest tissue [K]
  double vaporised = 0.0;    ///< so far [kg]
};

/// Depth and width against time; the published ranges at the end.
Plot lesion_plot(std::string title, std::string subtitle, std::span<const LesionRow> rows,
                 const std::optional<PublishedLesion>& published);

/// Nothing to do where the scene doesn't ask for it.
class LesionCurve {
 public:
  LesionCurve(const World& world, const SceneDescription& scene);

  /// After every frame.
  void add_frame(const World& world);
  std::span<const LesionRow> rows() const { return rows_; }
  /// Into a run's folder, where something has burnt.
  Result<void> write(const std::filesystem::path& out) const;

 private:
  const SceneDescription& scene_;
  std::optional<Entity> hook_;
  Entity organ_;
  ElectrodeContact place_;  ///< where current first flowed
  double begun_ = 0.0;      ///< [s]
  std::vector<LesionRow> rows_;
};

}  // namespace viscera
