// How a scene's first burn grows: lesion.csv and lesion.svg, with what is published of burns like
// it.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/features/cautery/cautery_keys.h"
#include "engine/io/svg_plot.h"
#include "engine/run/observer.h"
#include "engine/scene/scene.h"
#include "kernels/heat/lesion.h"

namespace viscera {

struct LesionRow {
  double time = 0.0;         ///< since current first flowed [s]
  Lesion lesion;             ///< of what has blanched
  Lesion dead;               ///< of what won't live
  double power = 0.0;        ///< into tissue that is heated [W]
  double temperature = 0.0;  ///< of the hottest tissue [K]
  double vaporised = 0.0;    ///< so far [kg]
  static constexpr auto fields() {
    return std::tuple(field("time", &LesionRow::time), field("lesion", &LesionRow::lesion),
                      field("dead", &LesionRow::dead), field("power", &LesionRow::power),
                      field("temperature", &LesionRow::temperature),
                      field("vaporised", &LesionRow::vaporised));
  }
};
static_assert(fields_cover<LesionRow>());

/// Depth and width against time, of what has blanched and of what is dead; the published ranges at
/// the end.
Plot lesion_plot(std::string title, std::string subtitle, std::span<const LesionRow> rows,
                 const std::optional<PublishedLesion>& published);

/// Nothing to do where the scene doesn't ask for it.
class LesionCurve : public Observer {
 public:
  LesionCurve(const World& world, const SceneDescription& scene);

  Result<void> open(const std::filesystem::path& folder) override;
  void add_frame(const World& world) override;
  /// Writes the files, where something has burnt.
  Result<void> close(const World& world) override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

  std::span<const LesionRow> rows() const { return state_.rows; }

 private:
  struct State {
    std::uint32_t organ = 0;       ///< place of the organ that burns first, among the bodies
    Vec3 point = Vec3::Zero();     ///< where current first flowed, rest frame [m]
    Vec3 outward = Vec3::UnitZ();  ///< of the tissue there
    double begun = 0.0;            ///< [s]
    std::vector<LesionRow> rows;
    static constexpr auto fields() {
      return std::tuple(field("organ", &State::organ), field("point", &State::point),
                        field("outward", &State::outward), field("begun", &State::begun),
                        field("rows", &State::rows));
    }
  };

  const SceneDescription& scene_;
  std::filesystem::path folder_;
  std::optional<Entity> hook_;
  std::size_t organs_ = 0;
  State state_;
};

}  // namespace viscera
