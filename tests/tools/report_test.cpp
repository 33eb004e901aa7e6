// report.json of a run, and what its state hash promises.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/support/baselines.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

using Type = Json::value_t;

bool has_type(const Json& value, Type type) {
  if (type == Type::number_float) return value.is_number();
  if (type == Type::number_unsigned) return value.is_number_unsigned();
  return value.type() == type;
}

void expect_keys(const Json& object, const std::vector<std::pair<std::string, Type>>& keys,
                 bool exactly) {
  ASSERT_TRUE(object.is_object()) << object;
  for (const auto& [key, type] : keys) {
    ASSERT_TRUE(object.contains(key)) << key;
    EXPECT_TRUE(has_type(object[key], type)) << key << ": " << object[key];
  }
  if (exactly) {
    EXPECT_EQ(object.size(), keys.size()) << object;
  }
}

std::string hash_of(const SceneFolder& folder, std::vector<std::string> options) {
  options.push_back("--no-render");
  const ProgramResult result = folder.run(options);
  EXPECT_EQ(result.code, 0) << result.told();
  return folder.report()["state_hash"];
}

TEST(RunReport, HasItsKeysWithTheirTypes) {
  const SceneFolder folder;
  const ProgramResult result =
      folder.run({"--no-render", "--backend", "cpu", "--threads", "2", "--seed", "5"});
  ASSERT_EQ(result.code, 0) << result.told();
  const Json report = folder.report();
  expect_keys(report,
              {{"scene", Type::string},
               {"seed", Type::number_unsigned},
               {"threads", Type::number_unsigned},
               {"backend", Type::string},
               {"backend_reason", Type::string},
               {"gpu", Type::null},
               {"duration_s", Type::number_float},
               {"frames", Type::number_unsigned},
               {"state_hash", Type::string},
               {"wall_s", Type::number_float},
               {"real_time_factor", Type::number_float},
               {"peak_memory_bytes", Type::number_unsigned},
               {"organs", Type::array},
               {"links", Type::array},
               {"haptics", Type::array},
               {"stages", Type::array},
               {"smoke", Type::object},
               {"gas", Type::object},
               {"cautery", Type::object},
               {"tissue", Type::array},
               {"trainee", Type::object},
               {"skipped", Type::array},
               {"flags", Type::array},
               {"not_finite", Type::array},
               {"warnings", Type::array},
               {"version", Type::string},
               {"command", Type::string},
               {"complete", Type::boolean},
               {"reason", Type::null},
               {"failures", Type::array},
               {"title", Type::string},
               {"renderer", Type::string},
               {"pictures", Type::number_unsigned},
               {"prepare_s", Type::number_float},
               {"machine", Type::object}},
              true);
  ASSERT_EQ(report["organs"].size(), 1u);
  expect_keys(report["organs"][0],
              {{"response", Type::string},
               {"name", Type::string},
               {"nodes", Type::number_unsigned},
               {"surface_nodes", Type::number_unsigned},
               {"triangles", Type::number_unsigned},
               {"prepare_s", Type::number_float},
               {"cache_hit", Type::boolean},
               {"memory_bytes", Type::number_unsigned},
               {"columns_prepared", Type::number_unsigned},
               {"columns_on_demand", Type::number_unsigned},
               {"on_demand_s", Type::number_float},
               {"preparation", Type::object},
               {"displacement_storage", Type::string},
               {"storage_error", Type::number_float},
               {"saved_bytes", Type::number_float},
               {"greatest_displacement_m", Type::number_float},
               {"greatest_displacement_time_s", Type::number_float}},
              true);
  expect_keys(report["organs"][0]["preparation"],
              {{"unknowns", Type::number_unsigned},
               {"stiffness_nonzeros", Type::number_unsigned},
               {"quadrature_points", Type::number_unsigned},
               {"gradient_correction", Type::number_float},
               {"fixed_area_m2", Type::number_float},
               {"factor_bytes", Type::number_unsigned},
               {"assemble_s", Type::number_float},
               {"factor_s", Type::number_float},
               {"compliance_s", Type::number_float},
               {"smallest_compliance_eigenvalue", Type::number_float}},
              true);
  EXPECT_TRUE(report["haptics"].empty()) << "nothing is held";
  ASSERT_FALSE(report["stages"].empty());
  for (const Json& stage : report["stages"]) {
    expect_keys(stage,
                {{"name", Type::string},
                 {"median_us", Type::number_float},
                 {"p99_us", Type::number_float},
                 {"max_us", Type::number_float},
                 {"total_s", Type::number_float}},
                true);
    EXPECT_LE(stage["median_us"], stage["p99_us"]) << stage;
    EXPECT_LE(stage["p99_us"], stage["max_us"]) << stage;
  }
  expect_keys(report["smoke"],
              {{"particles_max", Type::number_unsigned},
               {"volumes", Type::number_unsigned},
               {"writing_s", Type::number_float},
               {"emitted_kg", Type::number_float},
               {"airborne_kg", Type::number_float},
               {"background_kg", Type::number_float},
               {"evacuated_kg", Type::number_float},
               {"leaked_kg", Type::number_float},
               {"deposited_kg", Type::number_float},
               {"time_in_smoke", Type::number_float},
               {"view_least", Type::number_float},
               {"view_at_end", Type::number_float}},
              true);
  expect_keys(report["gas"],
              {{"pressure_mmHg", Type::number_float},
               {"pressure_least_mmHg", Type::number_float},
               {"pressure_greatest_mmHg", Type::number_float},
               {"volume_L", Type::number_float},
               {"insufflated_L", Type::number_float},
               {"swollen_L", Type::number_float},
               {"air_L", Type::number_float},
               {"evacuated_L", Type::number_float},
               {"leaked_L", Type::number_float}},
              true);
  expect_keys(report["cautery"],
              {{"energy_generated_J", Type::number_float},
               {"energy_delivered_J", Type::number_float},
               {"by_sparks_J", Type::number_float},
               {"body_J", Type::number_float},
               {"sparks_metal_J", Type::number_float},
               {"sparks_gas_J", Type::number_float},
               {"metabolic_J", Type::number_float},
               {"stored_J", Type::number_float},
               {"latent_J", Type::number_float},
               {"perfused_J", Type::number_float},
               {"lost_J", Type::number_float},
               {"residual", Type::number_float},
               {"time_with_current_s", Type::number_float},
               {"impedance", Type::object},
               {"limited_by_current", Type::number_float},
               {"limited_by_voltage", Type::number_float},
               {"seals", Type::array}},
              true);
  expect_keys(report["cautery"]["impedance"],
              {{"least_Ohm", Type::number_float},
               {"mean_Ohm", Type::number_float},
               {"greatest_Ohm", Type::number_float}},
              true);
  EXPECT_GT(report["cautery"]["energy_delivered_J"], 0.1);
  EXPECT_LT(std::abs(report["cautery"]["residual"].get<double>()), 0.01);
  ASSERT_EQ(report["tissue"].size(), 1u);
  expect_keys(report["tissue"][0],
              {{"organ", Type::string},
               {"stiffening", Type::null},  // too short a burn for an update
               {"vaporised_kg", Type::number_float},
               {"smoke_kg", Type::number_float},
               {"volume_above_60C_m3", Type::number_float},
               {"volume_coagulated_m3", Type::number_float},
               {"volume_dead_m3", Type::number_float},
               {"dead_depth_m", Type::number_float},
               {"greatest_temperature_K", Type::number_float}},
              true);
  expect_keys(report["trainee"],
              {{"energy_delivered_J", Type::number_float},
               {"current_without_contact_s", Type::number_float},
               {"greatest_temperature_K", Type::number_float},
               {"spared_organs_burnt", Type::array},
               {"organs_perforated", Type::array},
               {"ducts_open", Type::array},
               {"beds_torn", Type::array},
               {"organs", Type::array},
               {"tips", Type::array},
               {"time_in_smoke_s", Type::number_float}},
              true);
  EXPECT_EQ(report["trainee"]["tips"].size(), 2u);
  EXPECT_GT(report["trainee"]["current_without_contact_s"], 0.0) << "it comes down energised";
  for (const Json& part : report["skipped"])
    expect_keys(part, {{"what", Type::string}, {"why", Type::string}}, true);

  EXPECT_EQ(report["organs"][0]["preparation"]["unknowns"],
            3 * report["organs"][0]["nodes"].get<int>());
  EXPECT_NE(result.told().find("ball: "), std::string::npos) << result.told();

  EXPECT_EQ(report["scene"], folder.scene().string());
  EXPECT_EQ(report["seed"], 5);
  EXPECT_EQ(report["threads"], 2);
  EXPECT_EQ(report["backend"], "cpu");
  EXPECT_EQ(report["backend_reason"], "asked for");
  EXPECT_EQ(report["frames"], 12);
  EXPECT_NEAR(report["duration_s"].get<double>(), 0.2, 1e-9);
  EXPECT_EQ(report["complete"], true);
  EXPECT_GT(report["smoke"]["volumes"], 0);  // files written
  EXPECT_GT(report["smoke"]["particles_max"], 0);
  const Json& smoke = report["smoke"];
  double found = 0.0;
  for (const char* where :
       {"airborne_kg", "background_kg", "evacuated_kg", "leaked_kg", "deposited_kg"})
    found += smoke[where].get<double>();
  EXPECT_GT(smoke["emitted_kg"], 0.0);
  EXPECT_NEAR(found, smoke["emitted_kg"].get<double>(), 1e-9 * found);
  EXPECT_GT(report["organs"][0]["nodes"], report["organs"][0]["surface_nodes"]);
  EXPECT_GT(report["peak_memory_bytes"], 10'000'000);
}

TEST(RunReport, TellsWhatAHeldToolFelt) {
  Json scene = tiny_scene();
  scene["duration_s"] = 1.5;
  scene["instruments"][0]["haptic"] = {{"grip", "firm"}};
  scene["instruments"][0]["path"] = {{{"time_s", 0.0}, {"tip_mm", {3, 0, 21}}},
                                     {{"time_s", 0.6}, {"tip_mm", {3, 0, 21}}},
                                     {{"time_s", 1.0}, {"tip_mm", {3, 0, 14.5}}}};
  const SceneFolder folder(scene);
  const ProgramResult result = folder.run({"--no-render"});
  ASSERT_EQ(result.code, 0) << result.told();
  const Json report = folder.report();
  ASSERT_EQ(report["haptics"].size(), 1u);
  const Json& tool = report["haptics"][0];
  expect_keys(tool,
              {{"tool", Type::string},
               {"device", Type::string},
               {"ticks", Type::number_unsigned},
               {"greatest_force_N", Type::number_float},
               {"energy_J", Type::number_float},
               {"passivity_violations", Type::number_unsigned},
               {"frames_at_rest", Type::number_unsigned},
               {"frame_difference", Type::number_float},
               {"hives", Type::object},
               {"beyond_linear", Type::object},
               {"events", Type::array}},
              true);
  expect_keys(tool["beyond_linear"],
              {{"newton_steps", Type::number_unsigned},
               {"tangent_answers", Type::number_unsigned},
               {"deadline_misses", Type::number_unsigned},
               {"linear_answers", Type::number_unsigned}},
              true);
  expect_keys(tool["hives"],
              {{"built", Type::number_unsigned},
               {"refused", Type::number_unsigned},
               {"ticks_without", Type::number_unsigned}},
              true);
  EXPECT_EQ(tool["tool"], "hook");
  EXPECT_EQ(tool["device"], "simulated");
  EXPECT_NEAR(tool["ticks"].get<double>(), 1500.0, 34.0);
  EXPECT_GT(tool["greatest_force_N"].get<double>(), 0.0);
  EXPECT_GT(tool["hives"]["built"].get<int>(), 0);
  EXPECT_FALSE(tool["events"].empty());
}

TEST(StateHash, DoesntDependOnThreads) {
  const SceneFolder folder;
  const std::string one = hash_of(folder, {"--no-cache", "--threads", "1"});
  EXPECT_EQ(one.size(), 32u);
  EXPECT_EQ(hash_of(folder, {"--no-cache", "--threads", "2"}), one);
  EXPECT_EQ(hash_of(folder, {"--no-cache", "--threads", "3"}), one);
}

TEST(StateHash, FollowsTheSeedWhereThereIsSmoke) {
  const SceneFolder folder;
  const std::string hash = hash_of(folder, {"--seed", "1"});
  EXPECT_EQ(hash_of(folder, {"--seed", "1"}), hash);
  EXPECT_NE(hash_of(folder, {"--seed", "2"}), hash);
}

TEST(StateHash, FollowsTheScene) {
  const SceneFolder folder;
  const std::string hash = hash_of(folder, {});
  EXPECT_NE(hash_of(folder, {"--set", "instruments/hook/path/2/tip_mm=[5, 0, 13.9]"}), hash);
  EXPECT_NE(hash_of(folder, {"--duration", "0.1"}), hash);
}

TEST(RunOptions, OverridesReachTheRun) {
  const SceneFolder folder;
  ASSERT_EQ(folder
                .run({"--no-render", "--duration", "0.1", "--seed", "9", "--set",
                      "organs/ball/geometry/edge_mm=4"})
                .code,
            0);
  const Json report = folder.report();
  EXPECT_EQ(report["frames"], 6);
  EXPECT_EQ(report["seed"], 9);
  EXPECT_LT(report["organs"][0]["triangles"], 700);
}

TEST(RunOptions, TheReportedCommandRepeatsTheRun) {
  const SceneFolder folder;
  const std::string hash = hash_of(folder, {"--seed", "4", "--set", "title=two words"});
  const std::string command = folder.report()["command"];
  std::filesystem::remove_all(folder.out());
  ASSERT_EQ(
      run_command({"sh", "-c", "VISCERA_CACHE=" + folder.cache().string() + " " + command}).code, 0)
      << command;
  EXPECT_EQ(folder.report()["state_hash"], hash);
  EXPECT_EQ(folder.report()["title"], "two words");
}

// Its response isn't positive on such a body: a user who asks for the published method gets it,
// told what it is worth.
TEST(PaperFormulation, RunsAndWarnsThatToolsMayGainEnergy) {
  if (!strong_forms_built_in()) GTEST_SKIP() << kNoStrongForms;
  const SceneFolder folder;
  for (const bool cached : {false, true}) {
    const ProgramResult result =
        folder.run({"--no-render", "--set", "organs/ball/formulation=paper"});
    ASSERT_EQ(result.code, 0) << result.told();
    const Json report = folder.report();
    EXPECT_EQ(report["complete"], true);
    EXPECT_EQ(report["frames"], 12);
    EXPECT_EQ(report["organs"][0]["cache_hit"], cached);
    EXPECT_LT(report["organs"][0]["preparation"]["smallest_compliance_eigenvalue"], -1e-6);
    const std::string warnings = report["warnings"].dump();
    for (const char* part : {"doesn't converge", "smallest eigenvalue", "energy", "haptic"})
      EXPECT_NE(warnings.find(part), std::string::npos) << part << " not in " << warnings;
    const std::string forces = file_text(folder.out() / "forces.csv");
    EXPECT_EQ(forces.find("nan"), std::string::npos);
    EXPECT_EQ(forces.find("inf"), std::string::npos);
  }
}

}  // namespace
}  // namespace viscera::test
