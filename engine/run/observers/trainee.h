// Watches a run for the measures of the trainee's work in report.json.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "engine/run/observer.h"
#include "engine/scene/scene.h"

namespace viscera {

/// How a point moves, sample by sample.
class Motion {
 public:
  /// Times ascend [s].
  void add(double time, const Vec3& at);

  double path() const { return path_; }  ///< [m]
  /// See TraineeFigures::Tip.
  std::optional<double> smoothness() const;

  static constexpr auto fields() {
    return std::tuple(field("last", &Motion::last_), field("count", &Motion::count_),
                      field("path", &Motion::path_), field("fastest", &Motion::fastest_),
                      field("jerk_squares", &Motion::jerk_squares_),
                      field("begun", &Motion::begun_), field("moved", &Motion::moved_));
  }

 private:
  struct Sample {
    double time = 0.0;
    Vec3 at = Vec3::Zero();
    static constexpr auto fields() {
      return std::tuple(field("time", &Sample::time), field("at", &Sample::at));
    }
  };
  std::array<Sample, 4> last_;  ///< oldest first
  std::size_t count_ = 0;
  double path_ = 0.0;
  double fastest_ = 0.0;       ///< [m/s]
  double jerk_squares_ = 0.0;  ///< integral [m2/s5]
  double begun_ = 0.0;         ///< when it first moved [s]
  double moved_ = 0.0;         ///< when it last did [s]
};

static_assert(fields_cover<Motion>());

/// Measures of the trainee's work.
struct TraineeFigures {
  struct Organ {
    std::string name;
    double peak_force = 0.0;  ///< of all instruments together [N]
    double mean_force = 0.0;  ///< while touched [N]
    double touched = 0.0;     ///< [s]
  };
  struct Tip {
    std::string name;
    double path = 0.0;  ///< [m]
    /// -ln(T^3 / v^2 times the integral of jerk^2), v the greatest speed [Hogan2009]; greater is
    /// smoother. None: it never moved, or for too short.
    std::optional<double> smoothness;
  };
  struct SparedBurn {
    std::string organ;
    double coagulated = 0.0, dead = 0.0;  ///< of that the coagulated is a part [m3]
  };
  struct TornBed {
    std::string bed;
    std::size_t bonds = 0;  ///< that force has parted
    double area = 0.0;      ///< of these [m2]
  };
  struct Perforated {
    std::string organ;
    std::size_t places = 0;
  };
  struct OpenDuct {
    std::string organ, duct;
  };
  double energy = 0.0;                         ///< that hooks delivered [J]
  double idle_current = 0.0;                   ///< current asked for with no tissue to take it [s]
  std::optional<double> greatest_temperature;  ///< of tissue [K]
  std::vector<SparedBurn> spared_burns;        ///< of organs that the scene spares
  std::vector<Perforated> perforated;          ///< walls that heat or blades went through
  std::vector<OpenDuct> open_ducts;            ///< cut, and closed by no clip
  std::vector<TornBed> torn_beds;              ///< of which force has parted some
  std::vector<Organ> organs;                   ///< that were touched
  std::vector<Tip> tips;
};

class Trainee : public Observer {
 public:
  Trainee(const World& world, const SceneDescription& scene);

  void add_frame(const World& world) override;
  TraineeFigures figures(const World& world) const;
  /// Adds "trainee".
  void describe(const World& world, RunReport& report) const override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

 private:
  struct Force {
    double peak = 0.0, impulse = 0.0, touched = 0.0;  ///< [N], [N s], [s]
    static constexpr auto fields() {
      return std::tuple(field("peak", &Force::peak), field("impulse", &Force::impulse),
                        field("touched", &Force::touched));
    }
  };
  struct State {
    std::vector<Motion> tips;
    std::vector<Force> forces;  ///< of each organ body
    double time = 0.0;          ///< of the last frame [s]
    double idle_current = 0.0;  ///< [s]
    static constexpr auto fields() {
      return std::tuple(field("tips", &State::tips), field("forces", &State::forces),
                        field("time", &State::time), field("idle_current", &State::idle_current));
    }
  };

  State state_;
  std::vector<bool> spared_;  ///< of each organ body
};

}  // namespace viscera
