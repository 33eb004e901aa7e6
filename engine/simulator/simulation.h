// The simulator: load a scene, step it, keep and take back its state. Every command of `viscera` is
// a client of this, and so may any program be (docs/guide.md).
//
//   auto model = viscera::Model::load("scenes/kidney_palpation.json", {.assets = "assets"});
//   auto simulation = viscera::Simulation::create(*model);
//   while (simulation->time() < 2.0) simulation->step();
//
// A model is constant: any number of simulations share it, each on a thread of its caller's. A
// simulation is used by one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/simulation/controls.h"
#include "engine/simulation/frame_flag.h"
#include "kernels/base/result.h"
#include "kernels/base/types.h"

namespace viscera {

class SceneModel;
class Trace;
class World;

struct ModelOptions {
  std::filesystem::path assets;               ///< the project's assets folder
  std::vector<std::filesystem::path> search;  ///< more folders with organ surfaces
  /// As --set: {"organs/liver/resolution/finest_spacing_mm", "2.5"}.
  std::vector<std::pair<std::string, std::string>> overrides;
  bool use_cache = true;  ///< of prepared organs
  /// Share of the preparation that is done and what is being done; false ends it. None: silent.
  std::function<bool(double, std::string_view)> progress;
};

/// A scene, prepared.
class Model {
 public:
  /// Reads and prepares a scene file. Every mistake of the file is in the error.
  static Result<Model> load(const std::filesystem::path& scene, const ModelOptions& options);
  explicit Model(std::shared_ptr<const SceneModel> scene, std::vector<std::string> warnings = {});

  const std::string& name() const;
  double duration() const;                  ///< that the scene describes [s]
  double time_step() const;                 ///< of a step [s]
  std::vector<std::string> organs() const;  ///< names, in the scene's order
  std::vector<std::string> tools() const;
  const std::vector<std::string>& warnings() const { return warnings_; }
  const std::shared_ptr<const SceneModel>& scene() const { return scene_; }

 private:
  std::shared_ptr<const SceneModel> scene_;
  std::vector<std::string> warnings_;
};

/// The state of a simulation at one moment; cheap to copy.
class Snapshot {
 public:
  std::size_t bytes() const { return state_ ? state_->size() : 0; }
  double time() const { return time_; }  ///< [s]

 private:
  friend class Simulation;
  std::shared_ptr<const std::vector<std::byte>> state_;
  std::shared_ptr<const SceneModel> model_;
  double time_ = 0.0;
};

/// What held tools are held by.
enum class Hands {
  kNone,      ///< nobody: paths or controls move them
  kLockstep,  ///< their devices, 1,000 ticks a second of the scene's clock
};

struct SimulationOptions {
  Hands hands = Hands::kLockstep;
};

/// What a step has to tell.
struct StepReport {
  FlagSet flags;                    ///< that were raised, in the order of the features
  std::vector<std::string> strays;  ///< numbers that weren't finite, each with its place

  /// Features declare their flags in engine/features/NAME/NAME_flags.h.
  bool has(const FrameFlag& flag) const { return flags.has(flag); }
};

/// A surface as it is now; holds until the next step.
struct SurfaceView {
  std::span<const Vec3f> positions;               ///< organ's frame [m]
  std::span<const std::array<int, 3>> triangles;  ///< counter-clockwise from outside
  Pose pose;                                      ///< of the frame in the world
};

/// Heat in an organ now.
struct HeatView {
  double greatest_temperature = 0.0;  ///< so far [K]; 0: heat isn't followed in it
  double coagulated = 0.0;            ///< volume [m3]
  double vaporised = 0.0;             ///< so far [kg]
};

class Simulation {
 public:
  static Result<Simulation> create(const Model& model, const SimulationOptions& options = {});
  explicit Simulation(std::unique_ptr<World> world);
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;
  ~Simulation();

  double time() const;          ///< [s]
  std::uint64_t frame() const;  ///< steps done

  /// One step of the model's time_step(), tools where the scene's paths have them.
  StepReport step();
  /// The same with the tools elsewhere. Controls that can't be are refused and nothing is stepped:
  /// check_controls() says which.
  Result<StepReport> step(const Controls& controls);
  /// What step() would be given: a start for controls of one's own.
  Controls path_controls() const;

  /// Fails where some part can't be rolled back: a person's hand on a device.
  Result<Snapshot> snapshot() const;
  /// Goes on from there, bit for bit. Fails for another model's.
  Result<void> restore(const Snapshot& snapshot);
  /// A snapshot in a file; load() refuses one of another version, scene or kind of machine, saying
  /// what differs, and leaves the simulation as it was.
  Result<void> save(const std::filesystem::path& file) const;
  Result<void> load(const std::filesystem::path& file);
  /// Equal for equal states, bit for bit.
  std::string hash() const;
  /// Memory that the state takes.
  std::size_t state_bytes() const;

  // --- looking doesn't change what is shown ---
  SurfaceView surface(std::size_t organ) const;
  Vec3 force(std::size_t tool) const;  ///< on it, from all organs [N]
  Vec3 tip(std::size_t tool) const;    ///< [m]
  HeatView heat(std::size_t organ) const;
  double airborne_smoke() const;  ///< [kg]

  // --- for the project's own commands ---
  const World& world() const { return *world_; }
  World& world() { return *world_; }
  /// What steps take goes there from now on; null: nowhere.
  void trace(Trace* trace) { trace_ = trace; }

 private:
  std::unique_ptr<World> world_;
  Trace* trace_ = nullptr;
};

}  // namespace viscera
