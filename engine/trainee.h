// Watches a run for the measures of the trainee's work in report.json.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/io/report.h"
#include "engine/scene/scene.h"
#include "engine/world.h"

namespace viscera {

/// How a point moves, sample by sample.
class Motion {
 public:
  /// Times ascend [s].
  void add(double time, const Vec3& at);

  double path() const { return path_; }  ///< [m]
  /// See TraineeReport::Tip.
  std::optional<double> smoothness() const;

 private:
  struct Sample {
    double time = 0.0;
    Vec3 at = Vec3::Zero();
  };
  std::array<Sample, 4> last_;  ///< oldest first
  std::size_t count_ = 0;
  double path_ = 0.0;
  double fastest_ = 0.0;       ///< [m/s]
  double jerk_squares_ = 0.0;  ///< integral [m2/s5]
  double begun_ = 0.0;         ///< when it first moved [s]
  double moved_ = 0.0;         ///< when it last did [s]
};

class Trainee {
 public:
  Trainee(const World& world, const SceneDescription& scene);

  /// After every frame.
  void add_frame(const World& world);

  /// Fills in cautery, tissue and trainee; time_in_smoke from the report's smoke.
  void describe(const World& world, RunReport& report) const;

 private:
  struct Force {
    double peak = 0.0, impulse = 0.0, touched = 0.0;  ///< [N], [N s], [s]
  };

  std::vector<Motion> tips_;
  std::vector<Force> forces_;        ///< of each organ body
  std::vector<bool> spared_;         ///< likewise
  double time_ = 0.0;                ///< of the last frame [s]
  double idle_current_ = 0.0;        ///< [s]
  double far_ = 0.0, sparks_ = 0.0;  ///< [J]
};

}  // namespace viscera
