#include "engine/simulation/instruments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/io/foreign_files.h"
#include "engine/simulation/tool_shape.h"
#include "kernels/base/thin_out.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// Vertices of a mesh tip within this distance of its end look for tissue [m].
constexpr double kMeshEnd = 8e-3;
constexpr std::size_t kMeshSamples = 200;
/// A tip that touches an organ at the start may be this deep in it [m].
constexpr double kStartsInside = 1e-4;

/// A unit vector across the shaft that points as far down as it can: where a hook bends, and the
/// plane in which jaws open. A vertical shaft takes +x.
Vec3 side_of(const Vec3& shaft) {
  const Vec3 down = -Vec3::UnitZ();
  const Vec3 across = down - down.dot(shaft) * shaft;
  if (across.norm() > 1e-6) return across.normalized();
  return (Vec3::UnitX() - Vec3::UnitX().dot(shaft) * shaft).normalized();
}

KeyFrames tip_path(const InstrumentDescription& instrument) {
  std::vector<double> times;
  std::vector<Vec3> tips;
  for (const InstrumentKey& key : instrument.path) {
    times.push_back(key.time);
    tips.push_back(key.tip);
  }
  return KeyFrames(std::move(times), std::move(tips));
}

KeyFrames jaw_path(const InstrumentDescription& instrument) {
  std::vector<double> times;
  std::vector<Vec3> jaws;
  for (const InstrumentKey& key : instrument.path) {
    times.push_back(key.time);
    jaws.emplace_back(key.jaw, 0.0, 0.0);
  }
  return KeyFrames(std::move(times), std::move(jaws));
}

Result<InstrumentBody> make_instrument(const InstrumentDescription& description) {
  InstrumentBody body;
  body.description = description;
  body.tip = tip_path(description);
  body.jaw = jaw_path(description);
  body.extent = std::max(description.tip.radius, kPointTipRadius) + description.tip.length;
  if (description.tip.shape != TipDescription::Shape::kMesh) return body;

  auto mesh = import_surface(description.tip.file, description.tip.unit);
  if (!mesh) return std::unexpected(mesh.error());
  body.mesh = std::move(*mesh);
  if (const double enclosed = volume(body.mesh); enclosed < 0.0)
    return failure(fmt::format(
        "{}: instrument \"{}\": the mesh is inside-out (it encloses {:.3g} mm3), expected "
        "triangles that run counter-clockwise as seen from outside",
        description.tip.file.string(), description.name, 1e9 * enclosed));
  std::vector<Vec3f> positions;
  double across = 0.0;
  for (const Vec3& v : body.mesh.vertices) {
    positions.push_back(v.cast<float>());
    if (v.norm() > kMeshEnd) continue;
    body.mesh_samples.push_back(v);
    across = std::max(across, v.head<2>().norm());
  }
  if (body.mesh_samples.empty())
    return failure(
        fmt::format("{}: instrument \"{}\": the mesh has no vertex within {:g} mm of its "
                    "origin, expected the tip there and the shaft along +z",
                    description.tip.file.string(), description.name, 1e3 * kMeshEnd));
  thin_out(body.mesh_samples, kMeshSamples);
  body.description.tip.radius = std::max(across, kPointTipRadius);
  body.extent = kMeshEnd;
  body.mesh_surface = std::make_shared<const CollisionSurface>(body.mesh, positions);
  // Worlds on several threads share it: its tree is made now, not by who asks first.
  body.mesh_surface->closest(Vec3::Zero(), kMeshEnd);
  return body;
}

std::string buried_message(const SceneDescription& scene, std::size_t instrument,
                           const std::string& organ, double depth) {
  return fmt::format(
      "{}: instruments/{}/path/0/tip_mm: the tip starts {:.2f} mm inside organ \"{}\", expected a "
      "place outside every organ (move it at least {:.2f} mm)",
      scene.file.string(), instrument, 1e3 * depth, organ, 1e3 * depth);
}

}  // namespace

void place_tool(const InstrumentBody& body, double time, InstrumentState& state) {
  state.jaw = body.jaw.at(time).x();
  const InstrumentKey& key = body.description.path[body.tip.key_at(time)];
  state.power = key.power;
  state.blade = key.blade;
  aim_tool(body, body.tip.at(time), state);
}

void aim_tool(const InstrumentBody& body, const Vec3& tip, InstrumentState& state) {
  state.tip = tip;
  const Vec3 shaft = body.description.trocar - state.tip;
  // A tip in its own trocar has no direction; it keeps the last one.
  if (shaft.norm() > 1e-9) state.shaft_direction = shaft.normalized();
  state.side_direction = Eigen::AngleAxisd(body.description.roll, state.shaft_direction) *
                         side_of(state.shaft_direction);
}

Result<std::vector<InstrumentBody>> make_instruments(const SceneDescription& scene) {
  std::vector<InstrumentBody> instruments;
  for (const InstrumentDescription& description : scene.instruments) {
    auto body = make_instrument(description);
    if (!body) return std::unexpected(body.error());
    instruments.push_back(std::move(*body));
  }
  return instruments;
}

Result<void> check_tips(const SceneDescription& scene,
                        const std::vector<InstrumentBody>& instruments,
                        const OrganDescription& organ, const TriangleSurface& surface) {
  Error buried;
  const Box box = bounds(surface);
  std::optional<SurfaceTree> tree;  // made when some tip is in the organ's box
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    InstrumentState state;
    place_tool(instruments[i], 0.0, state);
    const ToolShape tool = tool_shape(instruments[i], state, organ.pose_at(0.0));
    double deepest = 0.0;
    for (const Vec3& probe : tool.probes()) {
      if (box.exteriorDistance(probe) > tool.probe_radius()) continue;
      if (!tree) tree.emplace(surface);
      deepest = std::max(deepest, tool.probe_radius() - tree->signed_distance(probe));
    }
    if (deepest > kStartsInside)
      buried.messages.push_back(buried_message(scene, i, organ.name, deepest));
  }
  if (!buried.messages.empty()) return std::unexpected(buried);
  return {};
}

}  // namespace viscera
