#include "tools/stress/whole_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "engine/features/held_tools/haptic_recording.h"
#include "engine/scene/step_rate.h"
#include "haptics/devices/simulated_device.h"
#include "tools/stress/dice.h"
#include "tools/stress/drawn_scene.h"

namespace viscera {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kStream = 0x5748'4f4cull << 32;
constexpr double kFrameSeconds = StepRate().step();
/// Of what organs touch: draws of their own, so that scenes without contact are as before.
constexpr std::uint64_t kContactStream = 0x434f'4e54ull << 32;
/// Organs stand in a row, each in a berth so wide [mm]; where they touch, in a narrower one.
constexpr double kBerth = 44.0, kNarrowest = 30.0;
/// A scene that comes to stand still is stepped on for so many frames.
constexpr std::uint64_t kStillFrames = 40;

/// Draws one scene; what it has is counted on the way.
class Draft {
 public:
  Draft(std::uint64_t seed, int number, std::filesystem::path folder)
      : dice_(seed, number, kStream),
        contact_dice_(seed, number, kContactStream),
        folder_(std::move(folder)) {
    frames_ = static_cast<std::uint64_t>(dice_.whole(6, 90));
    scene_ = {{"version", 1},
              {"name", "whole"},
              {"duration_s", kFrameSeconds * static_cast<double>(frames_ + 1)},
              {"seed", dice_.whole(0, 1000)}};
    organs_ = dice_.whole(1, 3);
    if (!contact_dice_.chance(0.5)) return;
    touching_ = true;
    berth_ = contact_dice_.between(kNarrowest, kBerth);
    falls_ = contact_dice_.chance(0.3);
    still_ = contact_dice_.chance(0.4);
    scene_["contact"] = {
        {"organs", true},
        {"organ_friction", contact_dice_.chance(0.5) ? 0.0 : contact_dice_.between(0.0, 2.0)},
        {"organ_pitch", contact_dice_.between(0.4, 1.5)}};
  }

  Result<WholeScene> written() {
    for (int i = 0; i < organs_; ++i) add_organ(i);
    const int tools = dice_.whole(1, 3);
    for (int i = 0; i < tools; ++i)
      if (auto added = add_tool(i); !added) return std::unexpected(added.error());
    if (falls_) add_free_organ();
    if (organs_ > 1 && dice_.chance(0.5)) add_link();
    if (dice_.chance(0.3)) add_link_to_ground();
    if (dice_.chance(0.5)) add_gravity();
    if (dice_.chance(0.6)) add_smoke();
    if (dice_.chance(0.3)) scene_["heat"] = {{"voxel_mm", dice_.between(0.4, 1.5)}};
    if (still_) quieten();

    WholeScene whole{
        .file = folder_ / "scene.json",
        .description = fmt::format(
            "{} organs ({} local, {} rigid, {} finite, {} of parts), {} tools ({} held), "
            "{} links, {} volumes of smoke{}{}, {} jerks, {} frames{}{}{}",
            organs_, local_, rigid_, finite_, parted_, tools, held_, links_, smoke_,
            scene_.contains("gas") ? ", gas" : "", scene_.contains("gravity") ? ", gravity" : "",
            jerks_, frames_, touching_ ? ", organs touch" : "", falls_ ? ", one falls" : "",
            still_ ? ", then still" : ""),
        .frames = frames_,
        .snapshot_at = static_cast<std::uint64_t>(dice_.whole(0, static_cast<int>(frames_) - 1)),
        .inverted_at = {},
        .abused = false,
        .still_from = {}};
    if (still_) {
      whole.still_from = frames_ - kStillFrames;
      whole.snapshot_at = std::min(whole.snapshot_at, *whole.still_from);
    } else if (finite_ > 0 && dice_.chance(0.5))
      whole.inverted_at = static_cast<std::uint64_t>(
          dice_.whole(static_cast<int>(whole.snapshot_at), static_cast<int>(frames_)));
    whole.abused = jerks_ > 0 || whole.inverted_at;
    if (auto done = write_drawn_scene(scene_, whole.file); !done)
      return std::unexpected(done.error());
    return whole;
  }

 private:
  Vec3 middle(int organ) const { return {berth_ * organ, 0.0, 0.0}; }

  /// A ball or block that nothing holds over a floor of its own, beside the others.
  void add_free_organ() {
    const double x = -50.0, size = contact_dice_.between(16.0, 24.0);
    const double above = contact_dice_.between(0.1, 6.0);
    Json geometry = {{"edge_mm", contact_dice_.between(2.5, 4.0)}};
    if (contact_dice_.chance(0.5)) {
      geometry["recipe"] = "sphere";
      geometry["radius_mm"] = 0.5 * size;
    } else {
      geometry["recipe"] = "block";
      geometry["size_mm"] = {size, contact_dice_.between(16.0, 24.0), size};
    }
    scene_["organs"].push_back(
        {{"name", "falls"},
         {"tissue", contact_dice_.one_of(kTissues)},
         {"pose", {{"position_mm", {x, 0.0, 0.5 * size + above}}}},
         {"free", true},
         {"geometry", geometry},
         {"resolution",
          {{"spacing_mm", contact_dice_.between(5.0, 7.0)}, {"finest_spacing_mm", 5.0}}}});
    scene_["organs"].push_back(
        {{"name", "floor"},
         {"tissue", "rubber"},
         {"deformable", false},
         {"pose", {{"position_mm", {x, 0.0, -10.0}}}},
         {"geometry", {{"recipe", "block"}, {"size_mm", {46.0, 90.0, 20.0}}, {"edge_mm", 10.0}}}});
  }

  /// Takes out of the scene what goes on by itself or has an energy that isn't counted, and lets it
  /// go on when its tools have come to the ends of their paths.
  void quieten() {
    for (const char* key : {"links", "gravity", "heat", "smoke", "gas"}) scene_.erase(key);
    links_ = smoke_ = held_ = 0;
    for (Json& organ : scene_["organs"]) {
      for (const char* key : {"motion", "pulsation", "material"}) organ.erase(key);
      if (organ.contains("deformable")) continue;
      if (!organ.contains("response") || organ["response"] != "finite") {
        for (const char* key : {"displacement_storage", "formulation"}) organ.erase(key);
        organ["response"] = "finite";
      }
      organ["finite"] = {{"viscous_time_ms", contact_dice_.between(0.0, 60.0)},
                         {"iterations", contact_dice_.whole(2, 4)}};
    }
    local_ = 0;
    for (Json& tool : scene_["instruments"]) {
      tool.erase("haptic");
      for (Json& key : tool["path"]) key.erase("power_W");
      tool.erase("mode");
      Json& path = tool["path"];
      for (Json& key : path) key["jaw"] = 1.0;
    }
    frames_ += kStillFrames + 2;
    scene_["duration_s"] = kFrameSeconds * static_cast<double>(frames_ + 1);
  }

  void add_organ(int i) {
    Json organ = {{"name", fmt::format("organ{}", i)},
                  {"tissue", dice_.one_of(kTissues)},
                  {"pose",
                   {{"position_mm", listed(middle(i))},
                    {"rotation_deg",
                     {dice_.between(-20, 20), dice_.between(-20, 20), dice_.between(-180, 180)}}}}};
    const double size = dice_.between(14.0, 20.0);
    Json& geometry = organ["geometry"];
    geometry = {{"edge_mm", dice_.between(2.5, 5.0)}};
    double bottom = -0.5 * size;
    if (dice_.chance(0.5)) {
      geometry["recipe"] = "sphere";
      geometry["radius_mm"] = size;
    } else if (dice_.chance(0.5)) {
      geometry["recipe"] = "hemisphere";
      geometry["radius_mm"] = size;
      bottom = 0.05 * size;
    } else {
      geometry["recipe"] = "block";
      geometry["size_mm"] = {dice_.between(20, 36), dice_.between(20, 36), 2.0 * size};
    }
    organ["fixed"] = Json::array(
        {{{"half_space", {{"point_mm", {0.0, 0.0, bottom}}, {"normal", {0.0, 0.0, 1.0}}}}}});
    organ["resolution"] = {{"spacing_mm", dice_.between(6.0, 9.0)},
                           {"finest_spacing_mm", dice_.between(4.0, 6.0)}};
    if (dice_.chance(0.3)) organ["youngs_modulus_kPa"] = std::pow(10.0, dice_.between(-0.5, 3.0));
    if (dice_.chance(0.3)) organ["poisson_ratio"] = dice_.between(0.0, 0.495);
    if (dice_.chance(0.2)) organ["formulation"] = "galerkin_quadratic";
    if (dice_.chance(0.2)) organ["displacement_storage"] = "half";
    if (dice_.chance(0.4))
      organ["motion"] = {{"amplitude_mm", dice_.between(0.0, 6.0)},
                         {"direction", listed(dice_.direction())},
                         {"period_s", dice_.between(0.3, 5.0)},
                         {"phase_deg", dice_.between(0.0, 360.0)}};
    if (dice_.chance(0.3))
      organ["pulsation"] = {{"strain", dice_.between(0.0, 0.1)},
                            {"rate_per_min", dice_.between(20.0, 400.0)}};
    if (dice_.chance(0.3))
      organ["material"] = {
          {"model", dice_.one_of(std::array{"linear", "stvk", "neo_hookean"})},
          {"prony",
           Json::array({{{"g", dice_.between(0.01, 0.9)}, {"tau_s", dice_.between(0.01, 2.0)}}})}};
    if (dice_.chance(0.25)) {
      organ["response"] = "local";
      organ.erase("pulsation");
      travels_ |= organ.contains("material");
      ++local_;
    } else if (i > 0 && dice_.chance(0.15)) {
      organ["deformable"] = false;
      organ.erase("pulsation");
      ++rigid_;
    } else {
      if (dice_.chance(0.35)) make_finite(organ);
      if (dice_.chance(0.35)) add_parts(organ, size);
    }
    scene_["organs"].push_back(std::move(organ));
  }

  void make_finite(Json& organ) {
    ++finite_;
    organ["response"] = "finite";
    for (const char* key : {"pulsation", "displacement_storage", "formulation"}) organ.erase(key);
    if (organ.contains("material") && organ["material"]["model"] == "stvk")
      organ["material"]["model"] = "neo_hookean";
    organ["finite"] = {{"quasi_static", dice_.chance(0.2)},
                       {"viscous_time_ms", dice_.between(0.0, 60.0)},
                       {"iterations", dice_.whole(1, 4)}};
  }

  void add_parts(Json& organ, double size) {
    ++parted_;
    const int count = dice_.whole(1, 3);
    for (int p = 0; p < count; ++p) {
      Json part;
      if (dice_.chance(0.3))
        part["capsule_mm"] = dice_.between(0.05, 3.0);
      else if (dice_.chance(0.5))
        part["region"] = {{"half_space",
                           {{"point_mm", listed(0.5 * size * dice_.direction())},
                            {"normal", listed(dice_.direction())}}}};
      else
        part["region"] = {{"sphere",
                           {{"centre_mm", listed(Vec3(0, 0, 0.3 * size))},
                            {"radius_mm", dice_.between(2.0, size)}}}};
      part["youngs_modulus_kPa"] = std::pow(10.0, dice_.between(0.0, 2.0));
      if (dice_.chance(0.3)) part["density_kg_m3"] = dice_.between(300.0, 3000.0);
      organ["parts"].push_back(std::move(part));
    }
  }

  /// From outside towards the organ, into it, along it and away; sometimes in it from the first.
  Json path(int organ, bool current) {
    const Vec3 way = (dice_.direction() + Vec3(0, 0, 1.2)).normalized();
    const double deepest = dice_.between(10.0, 21.0);
    const double start = dice_.chance(0.05) ? 8.0 : dice_.between(34.0, 40.0);
    const double duration = kFrameSeconds * static_cast<double>(frames_ + 1);
    const int keys = dice_.whole(1, 6);
    const double power = current ? dice_.between(0.0, 80.0) : 0.0;
    Json path = Json::array();
    for (int k = 0; k < keys; ++k) {
      const double along = keys > 1 ? static_cast<double>(k) / (keys - 1) : 0.0;
      const double depth = k == 0 ? start : start + (deepest - start) * std::min(1.0, 1.6 * along);
      const Vec3 aside = 4.0 * along * dice_.direction();
      Json key = {{"time_s", along * duration},
                  {"tip_mm", listed(middle(organ) + depth * way + aside)}};
      if (current) key["power_W"] = dice_.chance(0.8) ? power : 0.0;
      key["jaw"] = dice_.chance(0.5) ? 0.0 : dice_.between(0.0, 1.0);
      path.push_back(std::move(key));
    }
    if (dice_.chance(0.3)) add_jerks(path);
    return path;
  }

  /// The tip leaps by up to 50 mm within a frame, and mostly comes back in the next.
  void add_jerks(Json& path) {
    ++jerks_;
    Json last = path.back();
    const Json home = last["tip_mm"];
    double time = last["time_s"].get<double>();
    const int leaps = dice_.whole(1, 4);
    for (int leap = 0; leap < leaps; ++leap) {
      const Vec3 way = dice_.between(0.0, 50.0) * dice_.direction();
      for (const bool back : {false, true}) {
        if (back && dice_.chance(0.2)) continue;
        time += kFrameSeconds;
        last["time_s"] = time;
        for (std::size_t c = 0; c < 3; ++c)
          last["tip_mm"][c] =
              home[c].get<double>() + (back ? 0.0 : way[static_cast<Eigen::Index>(c)]);
        path.push_back(last);
      }
      time += kFrameSeconds * dice_.whole(1, 20);
    }
    // The scene goes on to the end of them.
    frames_ = std::max(frames_, static_cast<std::uint64_t>(std::ceil(time / kFrameSeconds)));
    scene_["duration_s"] = kFrameSeconds * static_cast<double>(frames_ + 1);
  }

  Result<void> add_tool(int i) {
    const char* kind = dice_.one_of(std::array{"probe", "grasper", "hook", "spatula"});
    const bool current = std::string_view(kind) == "hook" || std::string_view(kind) == "spatula";
    const int organ = dice_.whole(0, organs_ - 1);
    const std::string name = fmt::format("tool{}", i);
    Json tool = {{"name", name},
                 {"kind", kind},
                 {"tip", {{"radius_mm", dice_.between(0.5, 4.0)}}},
                 {"trocar_mm", listed(middle(organ) +
                                      Vec3(dice_.between(-60, 60), dice_.between(-60, 60), 150))},
                 {"path", path(organ, current)}};
    const bool held = dice_.chance(0.4);
    if (!held && !travels_ && dice_.chance(0.4)) {
      tool["tip"]["shape"] = "capsule";
      tool["tip"]["length_mm"] = dice_.between(2.0, 12.0);
    } else if (dice_.chance(0.2)) {
      tool["tip"] = {{"shape", "point"}};
    }
    if (dice_.chance(0.4)) tool["friction"] = dice_.between(0.0, 2.0);
    if (current && dice_.chance(0.5))
      tool["mode"] = dice_.one_of(std::array{"cut", "blend", "coagulate", "fulgurate"});
    if (held) {
      ++held_;
      if (dice_.chance(0.5)) {
        tool["haptic"] = {{"device", "simulated"},
                          {"grip", dice_.one_of(std::array{"loose", "medium", "firm"})}};
      } else {
        tool["haptic"] = {{"device", "recorded"}, {"recording", name + ".csv"}};
        if (auto saved = save_recording(folder_ / (name + ".csv"), failing_device()); !saved)
          return saved;
      }
    }
    scene_["instruments"].push_back(std::move(tool));
    return {};
  }

  /// A device that is lost now and then, jumps, stands still and shakes.
  HapticRecording failing_device() {
    HapticRecording recording;
    recording.device = "a device that fails";
    recording.limits = phantom_premium_1_0a();
    Pose pose;
    Vec3 speed = Vec3::Zero();
    bool connected = true;
    std::uint64_t sample = 0;
    const auto ticks =
        static_cast<std::size_t>(1000.0 * kFrameSeconds * static_cast<double>(frames_ + 2));
    for (std::size_t tick = 0; tick < ticks; ++tick) {
      if (dice_.chance(0.002)) connected = !connected;
      if (dice_.chance(0.002)) pose.position += dice_.between(0.0, 0.2) * dice_.direction();
      if (dice_.chance(0.01)) speed = dice_.between(0.0, 1.0) * dice_.direction();
      pose.position += recording.dt * speed;
      if (pose.position.norm() > 0.1) pose.position *= 0.1 / pose.position.norm();
      if (!dice_.chance(0.05)) ++sample;
      recording.samples.push_back({recording.dt * static_cast<double>(tick),
                                   {.pose = pose, .sample = sample, .connected = connected},
                                   Vec3::Zero()});
    }
    return recording;
  }

  void add_link() {
    ++links_;
    const int first = dice_.whole(0, organs_ - 2);
    scene_["links"].push_back(
        {{"name", fmt::format("link{}", links_)},
         {"between", {fmt::format("organ{}", first), fmt::format("organ{}", first + 1)}},
         {"region",
          {{"sphere",
            {{"centre_mm", listed(0.5 * (middle(first) + middle(first + 1)))},
             {"radius_mm", dice_.between(6.0, 16.0)}}}}},
         {"stiffness_N_per_m", std::pow(10.0, dice_.between(-1.0, 5.0))}});
  }

  void add_link_to_ground() {
    ++links_;
    const int organ = dice_.whole(0, organs_ - 1);
    scene_["links"].push_back(
        {{"name", fmt::format("link{}", links_)},
         {"between", {fmt::format("organ{}", organ), "ground"}},
         {"region",
          {{"sphere",
            {{"centre_mm", listed(middle(organ) + Vec3(0, 0, 16))}, {"radius_mm", 8.0}}}}},
         {"stiffness_N_per_m", std::pow(10.0, dice_.between(-1.0, 4.0))}});
  }

  void add_gravity() {
    Json table = Json::array();
    const int keys = dice_.whole(1, 3);
    for (int k = 0; k < keys; ++k)
      table.push_back({{"time_s", 0.4 * k},
                       {"head_up_deg", dice_.between(-40.0, 40.0)},
                       {"left_side_down_deg", dice_.between(-60.0, 60.0)}});
    scene_["gravity"] = {{"table", table}};
  }

  void add_smoke() {
    smoke_ = dice_.whole(1, 2);
    const double right = berth_ * (organs_ - 1) + 40.0;
    for (int i = 0; i < smoke_; ++i) {
      Json volume = {
          {"name", fmt::format("smoke{}", i)},
          {"domain", {{"min_mm", {-40.0, -40.0, -10.0}}, {"max_mm", {right, 40.0, 60.0}}}},
          {"voxel_mm", dice_.between(2.0, 5.0)},
          {"max_particles", dice_.whole(10, 4000)},
          {"particle_mass_ug", std::pow(10.0, dice_.between(-2.0, 0.5))}};
      if (i > 0 || dice_.chance(0.5))
        volume["emitters"] =
            Json::array({{{"position_mm", listed(Vec3(dice_.between(-30, 30), 0, 45))},
                          {"direction", listed(dice_.direction())},
                          {"rate_mg_per_s", dice_.between(0.0, 20.0)},
                          {"particles_per_s", dice_.whole(1, 3000)},
                          {"speed_mm_per_s", dice_.between(0.0, 1000.0)},
                          {"excess_K", dice_.between(0.0, 300.0)}}});
      scene_["smoke"].push_back(std::move(volume));
    }
    if (!dice_.chance(0.6)) return;
    scene_["gas"] = {{"cells", dice_.whole(0, 16)}};
    if (dice_.chance(0.6))
      scene_["gas"]["inlets"] = Json::array(
          {{{"position_mm", {-30.0, 0.0, 50.0}}, {"limit_L_per_min", dice_.between(0.0, 20.0)}}});
    if (dice_.chance(0.5))
      scene_["gas"]["leaks"] = Json::array(
          {{{"position_mm", {20.0, 20.0, 55.0}}, {"area_mm2", dice_.between(0.0, 30.0)}}});
    if (dice_.chance(0.5))
      scene_["gas"]["evacuators"] = Json::array(
          {{{"position_mm", {10.0, -20.0, 50.0}}, {"flow_L_per_min", dice_.between(0.0, 30.0)}}});
  }

  Dice dice_, contact_dice_;
  std::filesystem::path folder_;
  std::uint64_t frames_ = 0;
  bool travels_ = false;  ///< hives do, with each tool: they know round tips alone
  int organs_ = 0, local_ = 0, rigid_ = 0, finite_ = 0, parted_ = 0;
  int held_ = 0, links_ = 0, smoke_ = 0, jerks_ = 0;
  bool touching_ = false, falls_ = false, still_ = false;
  double berth_ = kBerth;  // [mm]
  Json scene_;
};

}  // namespace

Result<WholeScene> write_whole_scene(std::uint64_t seed, int number,
                                     const std::filesystem::path& folder) {
  return Draft(seed, number, folder).written();
}

}  // namespace viscera
