#include "engine/render/scene_buffers.h"

#include <set>

namespace viscera {

Result<void> SceneBuffers::update(const FrameView& view, bool with_temperature) {
  std::set<std::uint32_t> seen;
  for (const OrganView& organ : view.organs) {
    seen.insert(organ.id);
    if (Result<void> done = organs[organ.id].update(organ); !done) return done;
  }
  std::erase_if(organs, [&](const auto& entry) { return !seen.contains(entry.first); });
  seen.clear();
  for (const InstrumentView& instrument : view.instruments) {
    seen.insert(instrument.id);
    instruments[instrument.id].update(instrument);
  }
  std::erase_if(instruments, [&](const auto& entry) { return !seen.contains(entry.first); });
  seen.clear();
  for (const BedView& bed : view.beds) {
    seen.insert(bed.id);
    beds[bed.id].update(bed);
  }
  std::erase_if(beds, [&](const auto& entry) { return !seen.contains(entry.first); });
  smoke.resize(view.smoke.size());
  for (std::size_t i = 0; i < smoke.size(); ++i) {
    if (Result<void> done = smoke[i].update(view.smoke[i], with_temperature); !done) return done;
  }
  return {};
}

Eigen::Matrix4f model_matrix(const Pose& pose) {
  Eigen::Matrix4d model = Eigen::Matrix4d::Identity();
  model.block<3, 3>(0, 0) = pose.orientation.toRotationMatrix();
  model.block<3, 1>(0, 3) = pose.position;
  return model.cast<float>();
}

Eigen::Matrix4f model_matrix(const InstrumentView& view) {
  const Vec3 along = view.shaft_direction.normalized();
  Vec3 side = view.side_direction - along * along.dot(view.side_direction);
  side = side.norm() > 1e-6 ? side.normalized() : along.unitOrthogonal();
  Eigen::Matrix4d model = Eigen::Matrix4d::Identity();
  model.block<3, 1>(0, 0) = side;
  model.block<3, 1>(0, 1) = along.cross(side);
  model.block<3, 1>(0, 2) = along;
  model.block<3, 1>(0, 3) = view.tip;
  return model.cast<float>();
}

}  // namespace viscera
