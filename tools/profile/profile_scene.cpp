#include "tools/profile/profile_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/links/links_keys.h"
#include "engine/run/view.h"

namespace viscera {
namespace {

constexpr std::size_t kBerthsInARow = 8;
/// Between what stands in neighbouring berths [m]: wider than any contact is looked for.
constexpr double kClearance = 50e-3;

Box in_world(const Box& local, const Pose& pose) {
  Box world;
  for (int corner = 0; corner < 8; ++corner)
    world.extend(pose.to_world(local.corner(static_cast<Box::CornerType>(corner))));
  return world;
}

InstrumentDescription moved(InstrumentDescription tool, const Vec3& by, std::size_t set) {
  if (set > 0) tool.name = fmt::format("{}_{}", tool.name, set + 1);
  tool.trocar += by;
  for (InstrumentKey& key : tool.path) key.tip += by;
  return tool;
}

}  // namespace

Vec3 Berths::offset(std::size_t berth) const {
  const Vec3 pitch = occupied.sizes() + Vec3::Constant(kClearance);
  return Vec3(static_cast<double>(berth % kBerthsInARow) * pitch.x(),
              static_cast<double>(berth / kBerthsInARow) * pitch.y(), 0.0);
}

Box occupied_by(const SceneDescription& scene, const std::vector<InstrumentBody>& instruments,
                const OrganModels& models) {
  Box box;
  for (std::size_t i = 0; i < scene.organs.size(); ++i) {
    const OrganDescription& organ = scene.organs[i];
    const Box rest = in_world(models[i]->rest_bounds, organ.pose);
    box.extend(rest);
    if (const MotionDescription* motion = motion_of(organ))
      box.extend(rest.translated(motion->amplitude * motion->direction));
  }
  for (const InstrumentBody& tool : instruments)
    for (const InstrumentKey& key : tool.description.path) {
      box.extend(Vec3(key.tip + Vec3::Constant(tool.extent)));
      box.extend(Vec3(key.tip - Vec3::Constant(tool.extent)));
    }
  return box;
}

SceneDescription fill_berths(const SceneDescription& scene, const Berths& berths,
                             const Occupancy& wanted) {
  SceneDescription filled = scene;
  filled.organs.clear();
  filled.extras.remove<LinkDescriptions>();  // what they tie isn't side by side in the berths
  filled.instruments.clear();
  for (std::size_t berth = 0; berth < wanted.organs; ++berth) {
    OrganDescription organ = scene.organs[berths.organ_at(berth)];
    if (berth >= berths.order.size())
      organ.name = fmt::format("{}_{}", organ.name, berth / berths.order.size() + 1);
    organ.pose.position += berths.offset(berth);
    filled.organs.push_back(std::move(organ));
  }
  // Beyond the last row there is no organ.
  const std::size_t empty = (wanted.organs / kBerthsInARow + 2) * kBerthsInARow;
  for (std::size_t set = 0; set < wanted.tools; ++set) {
    const Vec3 by = berths.offset(set < wanted.touched ? set : empty + set);
    for (const InstrumentDescription& tool : scene.instruments)
      filled.instruments.push_back(moved(tool, by, set));
  }
  return filled;
}

OrganModels models_of(const OrganModels& models, const Berths& berths, std::size_t organs) {
  OrganModels filled;
  for (std::size_t berth = 0; berth < organs; ++berth)
    filled.push_back(models[berths.organ_at(berth)]);
  return filled;
}

CameraDescription camera_on_all(const SceneDescription& scene, const World& world) {
  Box all;
  const Pool<OrganBody>& organs = world.all<OrganBody>();
  for (std::size_t o = 0; o < organs.size(); ++o)
    all.extend(in_world(organs[o].model->rest_bounds, pose_of(world, organs.owner(o))));
  CameraDescription camera = *scene.camera;
  const CameraView first = Endoscope(camera).at(0.0);
  const double distance =
      0.5 * all.diagonal().norm() / std::sin(0.5 * std::min(camera.field_of_view, 2.0));
  camera.optics = 0.0;
  camera.path = {{0.0, all.center() - distance * first.forward, all.center(), 0.0}};
  return camera;
}

}  // namespace viscera
