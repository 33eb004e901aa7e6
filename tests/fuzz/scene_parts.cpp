#include "tests/fuzz/scene_parts.h"

#include <cmath>

#include "engine/features/bag/bag_keys.h"
#include "engine/features/beds/beds_keys.h"
#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/cautery/cautery_keys.h"
#include "engine/features/clips/clips_keys.h"
#include "engine/features/coagulation/coagulation_keys.h"
#include "engine/features/gas/gas_keys.h"
#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/features/jaws/jaws_keys.h"
#include "engine/features/links/links_keys.h"
#include "engine/features/parting/parting_keys.h"
#include "engine/features/shafts/shafts_keys.h"
#include "engine/features/smoke/smoke_keys.h"
#include "engine/features/touching/touching_keys.h"
#include "tests/engine/scene/whole_scene.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

/// Assets of these few tissues: a short table is soon read. The folder of the scene, too.
std::filesystem::path small_assets() {
  Json table = *parse_json(file_text(project_file("assets/tissues.json")), "tissues.json");
  Json few = Json::object();
  for (const char* name : {"liver", "rubber", "kidney"}) few[name] = table["tissues"][name];
  table["tissues"] = few;
  scratch("organs/liver.json", "{}");
  scratch("organs/kidney.json", "{}");
  scratch("ball.obj", "v 0 0 0\n");
  scratch("map.nii", "not read here");
  return scratch("tissues.json", table.dump(1)).parent_path();
}

}  // namespace

bool is_scene(const std::string& text,
              const std::vector<std::pair<std::string, std::string>>& overrides) {
  static const SceneLoadOptions options = {
      .assets = small_assets(),
      .features = {held_tools_keys(), breathing_keys(), gravity_keys(), cautery_keys(),
                   smoke_keys(), gas_keys(), shafts_keys(), jaws_keys(), touching_keys(),
                   links_keys(), coagulation_keys(), parting_keys(), beds_keys(), clips_keys(),
                   bag_keys()}};
  SceneLoadOptions with = options;
  with.overrides = overrides;
  const auto loaded = load_scene(scratch("scene.json", text), with);
  if (!loaded) {
    expect(!loaded.error().messages.empty(), "a refusal has a reason");
    return false;
  }
  expect(std::isfinite(loaded->duration) && loaded->duration > 0.0, "a scene lasts");
  for (const OrganDescription& organ : loaded->organs)
    expect(organ.pose.position.allFinite() && organ.pose.orientation.coeffs().allFinite() &&
               std::isfinite(organ.resolution.spacing),
           "an organ's numbers are finite");
  return true;
}

std::vector<std::string> scenes() {
  Json whole = test::whole_scene();
  whole["organs"][0].erase("pulsation");  // whose keys stand among its stages
  return {whole.dump(1), test::least_scene().dump(),
          file_text(project_file("scenes/sphere_press.json")),
          file_text(project_file("scenes/kidney_palpation.json"))};
}

}  // namespace viscera::fuzz
