#include "engine/features/jaws/jaws.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/simulation/tool_shape.h"

namespace viscera {
namespace {

Result<void> prepare(SceneModel& model) {
  for (std::size_t i = 0; i < model.instruments().size(); ++i) {
    const JawsDescription* jaws = jaws_of(model.scene().instruments[i]);
    if (!jaws) continue;
    JawsBody body{.force = jaws->force, .friction = jaws->friction};
    std::vector<double> times;
    std::vector<Vec3> angles;
    for (const JawsDescription::Turn& turn : jaws->turns) {
      times.push_back(turn.time);
      angles.emplace_back(turn.angle, 0.0, 0.0);
    }
    body.turns = !times.empty();
    if (body.turns) body.turn = KeyFrames(std::move(times), std::move(angles));
    model.constants().all<JawsBody>().add(model.instruments()[i], std::move(body));
  }
  return {};
}

Result<void> start(World& world) {
  const Pool<JawsBody>& bodies = world.all<JawsBody>();
  for (std::size_t i = 0; i < bodies.size(); ++i) world.all<Jaws>().add(bodies.owner(i), {});
  return {};
}

bool some_turn(const World& world) {
  return std::ranges::any_of(world.all<JawsBody>(),
                             [](const JawsBody& body) { return body.turns; });
}

void turn_jaws(World& world, const FrameContext& context) {
  const Pool<JawsBody>& bodies = world.all<JawsBody>();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!bodies[i].turns) continue;
    InstrumentState& state = *world.find<InstrumentState>(bodies.owner(i));
    state.side_direction =
        Eigen::AngleAxisd(bodies[i].turn.at(context.time).x(), state.shaft_direction) *
        state.side_direction;
  }
}

nlohmann::ordered_json vector_of(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

std::vector<ReportSection> report(const World& world) {
  const Pool<Jaws>& all = world.all<Jaws>();
  if (all.size() == 0) return {};
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Jaws& jaws = all[i];
    list.push_back({{"instrument", world.find<InstrumentBody>(all.owner(i))->description.name},
                    {"force_N", jaws.force},
                    {"slips_at_N", 2.0 * world.find<JawsBody>(all.owner(i))->friction * jaws.force},
                    {"friction_N", jaws.friction.norm()},
                    {"squeeze_N", jaws.squeeze},
                    {"torque_Nm", vector_of(jaws.torque)},
                    {"slid_mm", 1e3 * jaws.way},
                    {"taken_anew", jaws.retaken},
                    {"lost", jaws.lost},
                    {"shut_frames", jaws.shut_frames}});
  }
  return {report_section("jaws", list)};
}

}  // namespace

double share_of_grip(double jaw) {
  return std::clamp(1.0 - jaw / kJawLetsGo, 0.0, 1.0);
}

Feature jaws_feature() {
  return {.name = "jaws",
          .keys = jaws_keys(),
          .prepare = prepare,
          .start = start,
          .states = {state_type<Jaws>()},
          .stages = {{.name = "turn jaws",
                      .reads = {"tool poses"},
                      .writes = {"tool poses"},
                      .changes = {"tool poses"},
                      .needed = some_turn,
                      .run = turn_jaws}},
          .flags = {kTissueLeftJaws, kJawsShut},
          .report = report};
}

}  // namespace viscera
