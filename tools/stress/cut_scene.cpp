#include "tools/stress/cut_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/scene/step_rate.h"
#include "tools/stress/dice.h"
#include "tools/stress/drawn_scene.h"

namespace viscera {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kCutStream = 0x4355'5453ull << 32;
/// So many frames after the last stroke tools and most tissue have come to rest; then as many more.
constexpr std::uint64_t kFramesToSettle = 70, kFramesAtRest = 40;
constexpr double kFarAway = 150.0;   // of trocars [mm]
constexpr double kJawLength = 14.0;  // of scissors [mm]

/// Lengths in mm, as the file has them.
class CutDraft {
 public:
  CutDraft(std::uint64_t seed, int number) : dice_(seed, number, kCutStream) {}

  Result<WholeScene> written(const std::filesystem::path& folder) {
    add_organ();
    const bool falls = dice_.chance(0.5);
    if (falls) add_floor();
    const int graspers = dice_.whole(0, 2);
    for (int i = 0; i < graspers; ++i) add_grasper(i);
    const int blades = dice_.whole(1, 2);
    double end = 0.0;
    for (int i = 0; i < blades; ++i) end = std::max(end, add_blade(i));
    const bool burns = dice_.chance(0.4);
    if (burns) end = add_hook(end);
    const std::uint64_t moving = StepRate().steps_covering(end);
    WholeScene whole{
        .file = folder / "scene.json",
        .description =
            fmt::format("{:.0f} x {:.0f} x {:.0f} mm of {}{}, {} graspers, {} blades, {} strokes{}",
                        size_.x(), size_.y(), size_.z(), tissue_, falls ? " over a floor" : "",
                        graspers, blades, strokes_, burns ? ", a hook" : ""),
        .frames = moving + kFramesToSettle + kFramesAtRest,
        .snapshot_at = static_cast<std::uint64_t>(dice_.whole(0, static_cast<int>(moving))),
        .inverted_at = {},
        .abused = false,
        // What is warm goes on shrinking.
        .still_from = falls || burns ? std::nullopt : std::optional(moving + kFramesToSettle)};
    scene_["version"] = 1;
    scene_["name"] = "cut";
    scene_["duration_s"] = StepRate().time_after(whole.frames + 1);
    if (auto done = write_drawn_scene(scene_, whole.file); !done)
      return std::unexpected(done.error());
    return whole;
  }

 private:
  void add_organ() {
    tissue_ = dice_.one_of(kTissues);
    size_ = {dice_.between(20, 50), dice_.between(20, 50), dice_.between(8, 22)};
    Json organ = {{"name", "organ"}, {"tissue", tissue_}, {"response", "finite"}};
    Json& geometry = organ["geometry"];
    geometry["edge_mm"] = dice_.between(2.0, 4.0);
    if (dice_.chance(0.3)) {
      size_ = Vec3(2.0, 2.0, 1.0) * dice_.between(12, 20);
      geometry["recipe"] = "hemisphere";
      geometry["radius_mm"] = size_.z();
      low_ = 0.0;
    } else {
      geometry["recipe"] = "block";
      geometry["size_mm"] = listed(size_);
      low_ = -0.5 * size_.z();
    }
    const bool by_side = dice_.chance(0.5);
    const Vec3 at = by_side ? Vec3(-0.5 * size_.x() + 0.5, 0, 0) : Vec3(0, 0, low_ + 0.5);
    organ["fixed"] = Json::array(
        {{{"half_space",
           {{"point_mm", listed(at)}, {"normal", by_side ? Json{1, 0, 0} : Json{0, 0, 1}}}}}});
    const double spacing = dice_.between(4.5, 8.0);
    organ["resolution"] = {{"spacing_mm", spacing}, {"finest_spacing_mm", spacing}};
    organ["finite"] = {{"viscous_time_ms", dice_.between(0.0, 60.0)},
                       {"iterations", dice_.whole(2, 8)}};
    organ["cuttable"] = {{"voxel_mm", dice_.between(0.25, 0.5)}};
    if (dice_.chance(0.3)) organ["youngs_modulus_kPa"] = std::pow(10.0, dice_.between(-0.5, 2.0));
    if (dice_.chance(0.3)) organ["poisson_ratio"] = dice_.between(0.0, 0.49);
    scene_["organs"] = Json::array({organ});
  }

  /// What is cut off falls on it; its own weight moves it as long as something does.
  void add_floor() {
    constexpr double kThick = 6.0;
    const double below = dice_.between(2.0, 40.0);
    scene_["gravity"] = Json::object();
    scene_["contact"] = {{"organs", true}, {"organ_friction", dice_.between(0.0, 0.5)}};
    scene_["organs"].push_back(
        {{"name", "floor"},
         {"tissue", "liver"},
         {"deformable", false},
         {"geometry",
          {{"recipe", "block"}, {"size_mm", {200.0, 200.0, kThick}}, {"edge_mm", 10.0}}},
         {"pose", {{"position_mm", {0.0, 0.0, low_ - below - 0.5 * kThick}}}}});
  }

  double top() const { return low_ + size_.z(); }
  Vec3 above(double height) {
    return {dice_.between(-0.4, 0.4) * size_.x(), dice_.between(-0.4, 0.4) * size_.y(),
            top() + height};
  }
  Json tool(const std::string& name, const char* kind) {
    Vec3 away = dice_.direction();
    away.z() = 0.6 + std::abs(away.z());
    return {{"name", name}, {"kind", kind}, {"trocar_mm", listed(kFarAway * away.normalized())}};
  }
  static Json key(double time, const Vec3& tip, double jaw) {
    return {{"time_s", time}, {"tip_mm", listed(tip)}, {"jaw", jaw}};
  }

  void add_grasper(int number) {
    Json grasper = tool(fmt::format("grasper{}", number), "grasper");
    grasper["grip_radius_mm"] = dice_.between(3.0, 5.0);
    const Vec3 foot = above(-1.0);
    Vec3 pull = dice_.direction() * dice_.between(0.0, 0.4) * size_.z();
    pull.z() = std::abs(pull.z());
    grasper["path"] = {key(0.0, foot + Vec3(0, 0, 14), 1.0), key(0.15, foot, 1.0),
                       key(0.25, foot, 0.0), key(0.6, foot + pull, 0.0)};
    scene_["instruments"].push_back(grasper);
  }

  /// When its last stroke has ended [s].
  double add_blade(int number) {
    const bool scissors = dice_.chance(0.4);
    Json blade = tool(fmt::format("blade{}", number), scissors ? "scissors" : "scalpel");
    blade["blade_mm"] = scissors ? kJawLength : dice_.between(6.0, 30.0);
    blade["blade_thickness_mm"] = dice_.between(0.5, 1.2);
    double time = 0.3;
    const Vec3 start = above(kJawLength + 8.0);
    Json path = {key(0.0, start, 1.0), key(time, start, 1.0)};
    const int strokes = dice_.whole(1, 3);
    for (int i = 0; i < strokes; ++i) {
      ++strokes_;
      if (scissors) {
        const Vec3 at = above(-dice_.between(0.1, 1.0) * size_.z());
        path.push_back(key(time += 0.25, at, 1.0));
        path.push_back(key(time += dice_.between(0.1, 0.4), at, 0.0));
        path.push_back(key(time += 0.2, above(kJawLength), 1.0));
        continue;
      }
      // From beyond one side to another place, at times beyond the other side, at some depth.
      const double depth = dice_.between(0.1, 1.1) * size_.z();
      const double turn = dice_.between(0.0, 6.3), reach = 0.5 * size_.head<2>().norm() + 3.0;
      const Vec3 from(reach * std::cos(turn), reach * std::sin(turn), top() - depth);
      const Vec3 middle = above(-depth);
      const Vec3 to = dice_.chance(0.4) ? Vec3(2.0 * middle - from) : middle;
      path.push_back(key(time += 0.2, Vec3(from.x(), from.y(), top() + 5.0), 1.0));
      path.push_back(key(time += 0.1, from, 1.0));
      path.push_back(key(time += (to - from).norm() / dice_.between(30.0, 120.0),
                         {to.x(), to.y(), top() - depth}, 1.0));
      path.push_back(key(time += 0.2, Vec3(to.x(), to.y(), top() + 8.0), 1.0));
    }
    blade["path"] = path;
    scene_["instruments"].push_back(blade);
    return time;
  }

  /// With current over the top from then on, to and fro, deeper each time; when it has ended [s].
  double add_hook(double time) {
    Json hook = tool("hook", "hook");
    hook["mode"] = dice_.one_of(std::array{"cut", "blend", "coagulate", "fulgurate"});
    hook["tip"] = {{"shape", "sphere"}, {"radius_mm", dice_.between(0.5, 1.5)}};
    const double power = dice_.between(10.0, 120.0);
    const Vec3 from = above(0.0), to = above(0.0);
    Json path = {key(0.0, from + Vec3(0, 0, 40), 0.0), key(time, from + Vec3(0, 0, 8), 0.0)};
    const int passes = dice_.whole(1, 3);
    for (int pass = 0; pass <= passes; ++pass) {
      Vec3 at = pass % 2 == 0 ? from : to;
      at.z() -= dice_.between(0.0, 2.0) * (pass + 1);
      path.push_back(key(time += dice_.between(0.3, 1.0), at, 0.0));
      if (pass < passes) path.back()["power_W"] = power;
    }
    path.push_back(key(time += 0.2, to + Vec3(0, 0, 15), 0.0));
    hook["path"] = path;
    scene_["instruments"].push_back(hook);
    return time;
  }

  Dice dice_;
  Json scene_;
  std::string tissue_;
  Vec3 size_ = Vec3::Zero();
  double low_ = 0.0;  // its base
  int strokes_ = 0;
};

}  // namespace

Result<WholeScene> write_cut_scene(std::uint64_t seed, int number,
                                   const std::filesystem::path& folder) {
  return CutDraft(seed, number).written(folder);
}

}  // namespace viscera
