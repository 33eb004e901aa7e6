#include "tools/stress/whole_bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/features/contact/contact.h"
#include "engine/features/free_bodies/free_bodies.h"
#include "engine/features/touching/touching.h"
#include "kernels/contact/finite_contact.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// A surface so placed, world.
TriangleSurface placed(const OrganModel& model, const Pose& pose,
                       const std::vector<Vec3f>& positions) {
  TriangleSurface surface;
  surface.triangles = model.surface.triangles;
  for (const Vec3f& x : positions) surface.vertices.push_back(pose.to_world(x.cast<double>()));
  return surface;
}

const OrganModel& model_of(const World& world, Entity organ) {
  return *world.find<OrganBody>(organ)->model;
}

TriangleSurface drawn(const World& world, Entity organ) {
  return placed(model_of(world, organ), pose_of(world, organ),
                world.find<OrganState>(organ)->positions);
}

/// How deep vertices lie inside; 0: outside [m].
std::vector<float> depths(const TriangleSurface& inner, const TriangleSurface& outer) {
  Box box;
  for (const Vec3& v : outer.vertices) box.extend(v);
  std::vector<float> found(inner.vertices.size(), 0.0f);
  if (std::ranges::none_of(inner.vertices, [&](const Vec3& v) { return box.contains(v); }))
    return found;
  const SurfaceTree tree(outer);
  for (std::size_t v = 0; v < found.size(); ++v)
    if (box.contains(inner.vertices[v]))
      found[v] = static_cast<float>(std::max(0.0, -tree.signed_distance(inner.vertices[v])));
  return found;
}

}  // namespace

Insides::Insides(const World& world) {
  const SceneDescription& scene = world.model().scene();
  const auto resting = [&](Entity organ) {
    const OrganModel& model = model_of(world, organ);
    return placed(model, scene.organs[organ.index].pose_at(0.0), model.rest_positions);
  };
  for (const OrganPair& pair : world.all<OrganPair>()) {
    if (pair.folds()) continue;  // its own surface is where its vertices are
    for (const std::size_t inner : {std::size_t{0}, std::size_t{1}}) {
      Side side{pair.organs[inner], pair.organs[1 - inner], {}};
      side.at_rest = depths(resting(side.inner), resting(side.outer));
      sides_.push_back(std::move(side));
    }
  }
}

Insides::Deepest Insides::deepest(const World& world) const {
  Deepest deepest;
  for (const Side& side : sides_) {
    const std::vector<float> now = depths(drawn(world, side.inner), drawn(world, side.outer));
    // Of an organ that was cut other vertices are drawn.
    const bool as_begun = now.size() == side.at_rest.size();
    for (std::size_t v = 0; v < now.size(); ++v) {
      const double beyond =
          static_cast<double>(now[v]) - (as_begun ? static_cast<double>(side.at_rest[v]) : 0.0);
      if (beyond <= deepest.depth) continue;
      deepest = {beyond, world.find<OrganBody>(side.inner)->name + " in " +
                             world.find<OrganBody>(side.outer)->name};
    }
  }
  return deepest;
}

double energy_of(const World& world) {
  double energy = 0.0;
  const Pool<OrganTouch>& touches = world.all<OrganTouch>();
  FiniteBody::Workspace workspace;
  for (std::size_t t = 0; t < touches.size(); ++t) {
    const OrganModel& model = model_of(world, touches.owner(t));
    if (!model.finite) continue;
    const FiniteState motion = touches[t].solver->state().motion;
    energy += model.finite->body().energy(motion.displacements, {}, workspace);
    if (const auto* contact = dynamic_cast<const FiniteContact*>(touches[t].solver.get()))
      energy += contact->near_energy();
    double shares = 0.0, squares = 0.0;
    for (std::size_t node = 0; node < model.cloud.size(); ++node) {
      const double share = std::pow(model.cloud.spacings[node], 3.0);
      shares += share;
      squares += share * Vec3::Map(motion.velocities.data() + 3 * node).squaredNorm();
    }
    const double mass = model.finite->options().density * model.finite->body().volume();
    if (shares > 0.0) energy += 0.5 * mass * squares / shares;
  }
  return energy;
}

void EnergyWatch::add(std::uint64_t frame, double energy) {
  greatest_ = std::max(greatest_, energy);
  if (!least_ || energy < *least_) {
    least_ = energy;
    least_at_ = frame;
  }
  const double may = kEnergyRise * greatest_ + kEnergyFloor;
  if (failure_ || !(energy - *least_ > may)) return;
  failure_ = fmt::format(
      "nothing moved the scene, and its energy rose from {:.3g} J at frame {} to {:.3g} J at frame "
      "{}, expected at most {:.1g} J more",
      *least_, least_at_, energy, frame, may);
}

}  // namespace viscera
