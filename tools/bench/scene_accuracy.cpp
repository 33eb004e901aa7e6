#include "tools/bench/scene_accuracy.h"

#include <algorithm>
#include <cmath>

#include "engine/io/interrupt.h"
#include "engine/simulation/frame.h"
#include "engine/simulator/build.h"
#include "engine/simulator/loop.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

/// Shapes are compared every so many frames.
constexpr int kFramesPerShape = 15;

/// What one run did: forces in every frame, shapes now and then.
struct Course {
  std::vector<std::vector<Vec3>> forces;                ///< [instrument][frame] [N]
  std::vector<std::vector<std::vector<Vec3f>>> shapes;  ///< [organ][time][vertex], from rest [m]
};

Result<Course> run(const SceneDescription& scene, const std::map<std::string, Tissue>& tissues) {
  std::vector<std::string> warnings;
  auto model = build_model(scene, tissues, {assets_folder(), false}, until_interrupted(), warnings);
  if (!model) return std::unexpected(model.error());
  auto simulation = Simulation::create(Model(*model), {.hands = Hands::kNone});
  if (!simulation) return std::unexpected(simulation.error());
  Course course;
  course.forces.resize(scene.instruments.size());
  course.shapes.resize(scene.organs.size());
  Loop loop{.until = scene.steps.steps_covering(scene.duration)};
  loop.look = [&](Simulation& one, const StepReport&) -> Result<void> {
    if (interrupted()) return failure(kCancelled);
    for (std::size_t i = 0; i < course.forces.size(); ++i) course.forces[i].push_back(one.force(i));
    if (one.frame() % kFramesPerShape != 0) return {};
    for (std::size_t o = 0; o < course.shapes.size(); ++o) {
      const OrganBody& body = *one.world().find<OrganBody>((*model)->organs()[o]);
      const SurfaceView surface = one.surface(o);
      std::vector<Vec3f> moved(surface.positions.size());
      for (std::size_t v = 0; v < moved.size(); ++v)
        moved[v] = surface.positions[v] - body.model->rest_positions[v];
      course.shapes[o].push_back(std::move(moved));
    }
    return {};
  };
  if (auto stepped = step_through(*simulation, loop); !stepped)
    return std::unexpected(stepped.error());
  return course;
}

/// Relative root of summed squares; 0 where nothing happened.
template <class Vector>
void add_difference(const std::vector<Vector>& coarse, const std::vector<Vector>& fine,
                    double& error, double& size) {
  for (std::size_t i = 0; i < std::min(coarse.size(), fine.size()); ++i) {
    error += static_cast<double>((coarse[i] - fine[i]).squaredNorm());
    size += static_cast<double>(fine[i].squaredNorm());
  }
}

double relative(double error, double size) {
  return size > 0.0 ? std::sqrt(error / size) : 0.0;
}

}  // namespace

Result<SceneAccuracy> compare_with_half_spacing(const SceneDescription& scene,
                                                const std::map<std::string, Tissue>& tissues) {
  SceneDescription half = scene;
  for (OrganDescription& organ : half.organs) {
    organ.resolution.spacing *= 0.5;
    organ.resolution.finest *= 0.5;
  }
  const auto fine = run(half, tissues);
  if (!fine) return std::unexpected(fine.error());
  const auto coarse = run(scene, tissues);
  if (!coarse) return std::unexpected(coarse.error());
  SceneAccuracy accuracy;
  for (std::size_t i = 0; i < fine->forces.size(); ++i) {
    double error = 0.0, size = 0.0;
    add_difference(coarse->forces[i], fine->forces[i], error, size);
    accuracy.force_error = std::max(accuracy.force_error, relative(error, size));
  }
  for (std::size_t o = 0; o < fine->shapes.size(); ++o) {
    double error = 0.0, size = 0.0;
    for (std::size_t t = 0; t < fine->shapes[o].size(); ++t) {
      if (coarse->shapes[o][t].size() != fine->shapes[o][t].size())
        return failure("found drawn surfaces that depend on the node spacing");
      add_difference(coarse->shapes[o][t], fine->shapes[o][t], error, size);
    }
    accuracy.profile_error = std::max(accuracy.profile_error, relative(error, size));
  }
  return accuracy;
}

}  // namespace viscera
