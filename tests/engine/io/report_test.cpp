#include "engine/io/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "tests/engine/io/file_size_limit.h"
#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

using nlohmann::json;

TEST(Report, HasTheKeysThatWerePromised) {
  RunReport report;
  report.organs.resize(1);
  report.stages.resize(1);
  report.skipped.resize(1);
  const json all = json::parse(to_json(report));
  for (const char* key :
       {"scene",      "seed",   "threads",          "backend",           "duration_s", "frames",
        "state_hash", "wall_s", "real_time_factor", "peak_memory_bytes", "organs",     "stages",
        "skipped",    "flags",  "warnings",         "renderer",          "machine",    "version",
        "command",    "gpu",    "backend_reason"}) {
    EXPECT_TRUE(all.contains(key)) << key;
  }
  const auto keys = [](const json& object) {
    std::set<std::string> names;
    for (const auto& [name, value] : object.items()) names.insert(name);
    return names;
  };
  EXPECT_EQ(keys(all["organs"][0]),
            (std::set<std::string>{"name", "response", "nodes", "surface_nodes", "triangles",
                                   "prepare_s", "cache_hit", "memory_bytes", "preparation",
                                   "columns_prepared", "columns_on_demand", "on_demand_s",
                                   "displacement_storage", "storage_error", "saved_bytes"}));
  EXPECT_EQ(keys(all["stages"][0]),
            (std::set<std::string>{"name", "median_us", "p99_us", "max_us", "total_s"}));
  EXPECT_EQ(keys(all["skipped"][0]), (std::set<std::string>{"what", "why"}));
  EXPECT_EQ(keys(all["machine"]), (std::set<std::string>{"cpu", "cores", "memory_bytes"}));
}

TEST(Report, HoldsSectionsBetweenItsStagesAndWhatWasSkipped) {
  RunReport report;
  report.sections = {report_section("beats", {{"count", 3}})};
  const auto all = nlohmann::ordered_json::parse(to_json(report));
  EXPECT_EQ(all["beats"]["count"], 3);
  std::vector<std::string> keys;
  for (const auto& [key, value] : all.items()) keys.push_back(key);
  const auto at = [&](const char* key) { return std::ranges::find(keys, key) - keys.begin(); };
  EXPECT_EQ(at("beats"), at("stages") + 1);
  EXPECT_EQ(at("skipped"), at("beats") + 1);
}

TEST(Report, JoinsWhatSeveralTellUnderOneKey) {
  RunReport report;
  report.organs.resize(2);
  report.organs[0].name = "liver";
  report.organs[1].name = "stomach";
  report.sections = {
      report_section("organs",
                     {{{"name", "stomach"}, {"moved", 2}}, {{"name", "liver"}, {"moved", 1}}}),
      report_section("smoke", {{"volumes", 0}, {"seen", nullptr}}),
      report_section("heat", nullptr),
      report_section("smoke", {{"volumes", 7}}),
  };
  const json all = json::parse(to_json(report));
  ASSERT_EQ(all["organs"].size(), 2u);
  EXPECT_EQ(all["organs"][0]["moved"], 1);
  EXPECT_EQ(all["organs"][1]["moved"], 2);
  EXPECT_EQ(all["smoke"], json::parse(R"({"volumes": 7, "seen": null})"));
  EXPECT_TRUE(all["heat"].is_null());
}

TEST(Report, TellsOfTheGpuWhereItWasUsed) {
  RunReport report;
  EXPECT_TRUE(json::parse(to_json(report))["gpu"].is_null());
  report.gpu = GpuReport{.device = "llvmpipe",
                         .start_s = 0.5,
                         .organs = 2,
                         .smoke_volumes = 3,
                         .heat_organs = 1,
                         .bytes = 1000,
                         .passes = {stage_report("product", quantiles({1e-3, 2e-3, 3e-3}))}};
  const json gpu = json::parse(to_json(report))["gpu"];
  EXPECT_EQ(gpu["device"], "llvmpipe");
  EXPECT_EQ(gpu["start_s"], 0.5);
  EXPECT_EQ(gpu["organs"], 2);
  EXPECT_EQ(gpu["smoke_volumes"], 3);
  EXPECT_EQ(gpu["heat_organs"], 1);
  EXPECT_EQ(gpu["bytes"], 1000);
  ASSERT_EQ(gpu["passes"].size(), 1u);
  EXPECT_EQ(gpu["passes"][0]["name"], "product");
  EXPECT_NEAR(gpu["passes"][0]["median_us"].get<double>(), 2000.0, 1e-6);
  EXPECT_NEAR(gpu["passes"][0]["total_s"].get<double>(), 6e-3, 1e-12);
}

TEST(Report, TellsWhatPreparationFoundOutAndWhatHalfPrecisionCosts) {
  RunReport report;
  report.organs.resize(2);
  OrganReport& liver = report.organs[0];
  liver.name = "liver";
  liver.nodes = 4100;
  liver.preparation = PreparationFigures{};
  liver.preparation->unknowns = 12300;
  liver.preparation->stiffness_nonzeros = 2500000;
  liver.preparation->factor_bytes = 61000000;
  liver.preparation->gradient_correction = 0.025;
  liver.preparation->smallest_compliance_eigenvalue = 3e-5;
  liver.half_precision = true;
  liver.storage_error = 2.5e-4;
  liver.saved_bytes = -1500000;
  const json organs = json::parse(to_json(report))["organs"];
  EXPECT_EQ(organs[0]["preparation"]["unknowns"], 12300);
  EXPECT_EQ(organs[0]["preparation"]["gradient_correction"], 0.025);
  EXPECT_EQ(organs[0]["preparation"]["smallest_compliance_eigenvalue"], 3e-5);
  EXPECT_EQ(organs[0]["displacement_storage"], "half");
  EXPECT_EQ(organs[0]["storage_error"], 2.5e-4);
  EXPECT_EQ(organs[0]["saved_bytes"], -1500000);
  EXPECT_TRUE(organs[1]["preparation"].is_null());
  EXPECT_EQ(organs[1]["displacement_storage"], "single");

  const std::string line = preparation_line(liver);
  for (const char* part : {"liver: 4100 nodes, 12300 unknowns", "2.5e+06 nonzeros", "2.5e-02",
                           "factor 61.0 MB", "3.0e-05", "2.5e-04", "-1.5 MB saved"})
    EXPECT_NE(line.find(part), std::string::npos) << part << " in " << line;
  liver.preparation->stiffness_nonzeros = 0;
  const std::string levels = preparation_line(liver);
  for (const char* part : {"12300 unknowns, on two levels", "2.5e-02", "coarse factor 61.0 MB;"})
    EXPECT_NE(levels.find(part), std::string::npos) << part << " in " << levels;
  EXPECT_EQ(levels.find("eigenvalue"), std::string::npos) << levels;
  EXPECT_EQ(preparation_line(report.organs[1]), "");
}

TEST(Report, EmptyListsAreListsAndNumbersThatArentFiniteNull) {
  RunReport report;
  report.real_time_factor = std::numeric_limits<double>::quiet_NaN();
  const json all = json::parse(to_json(report));
  for (const char* key : {"organs", "stages", "skipped", "flags", "warnings"}) {
    EXPECT_TRUE(all[key].is_array()) << key;
  }
  EXPECT_TRUE(all["real_time_factor"].is_null());
}

TEST(Report, KeepsEveryBitOfASeed) {
  RunReport report;
  report.seed = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(json::parse(to_json(report))["seed"].get<std::uint64_t>(), report.seed);
}

TEST(Report, SurvivesANameThatIsntUtf8) {
  RunReport report;
  report.warnings = {"file \xff\xfe.obj"};
  EXPECT_TRUE(json::accept(to_json(report)));
}

TEST(Report, IsWrittenWholeOrRefused) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_report(folder / "report.json", RunReport()));
  EXPECT_TRUE(json::accept(test::file_text(folder / "report.json")));
  EXPECT_FALSE(write_report(folder / "missing/report.json", RunReport()));
}

TEST(Report, AFullDiskIsSaidAndTheOlderReportStaysWhole) {
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink("/dev/full", folder / "full.json");
  const auto full = write_report(folder / "full.json", RunReport());
  ASSERT_FALSE(full);
  EXPECT_NE(full.error().text().find("full.json: can't be written: No space left on device"),
            std::string::npos)
      << full.error().text();

  ASSERT_TRUE(write_report(folder / "report.json", RunReport()));
  const std::string older = test::file_text(folder / "report.json");
  RunReport report;
  report.title = "newer";
  {
    const test::FileSizeLimit limit(100);
    EXPECT_FALSE(write_report(folder / "report.json", report));
  }
  EXPECT_EQ(test::file_text(folder / "report.json"), older);
  EXPECT_EQ(test::entries(folder.path()), 2);
}

TEST(Report, ListsTheStagesThatRan) {
  Trace trace({"contacts", "smoke", "deform"});
  const auto start = Trace::Clock::now();
  trace.add(2, 0, start, start + std::chrono::microseconds(300));
  trace.add(0, 0, start, start + std::chrono::microseconds(20));
  const std::vector<StageReport> stages = stage_reports(trace);
  ASSERT_EQ(stages.size(), 2u);
  EXPECT_EQ(stages[0].name, "contacts");
  EXPECT_EQ(stages[1].name, "deform");
  EXPECT_NEAR(stages[1].median_us, 300.0, 1e-9);
  EXPECT_NEAR(stages[1].total_s, 300e-6, 1e-15);
}

TEST(Machine, IsDescribed) {
  const MachineReport machine = this_machine();
  EXPECT_FALSE(machine.cpu.empty());
  EXPECT_GE(machine.cores, 1);
  EXPECT_GT(machine.memory_bytes, 100'000'000u);
}

TEST(PeakMemory, GrowsWithWhatIsTouched) {
  const std::uint64_t before = peak_memory_bytes();
  EXPECT_GT(before, 1'000'000u);
  constexpr std::size_t kBytes = 200'000'000;
  std::vector<char> block(kBytes, 1);
  EXPECT_GT(peak_memory_bytes(), block[kBytes - 1] + kBytes / 2);
}

TEST(ShellCommand, QuotesOnlyWhatAShellWouldChange) {
  const std::array<std::string, 5> words = {"viscera", "run", "my scenes/a.json", "it's", ""};
  EXPECT_EQ(shell_command(words), "viscera run 'my scenes/a.json' 'it'\\''s' ''");
}

}  // namespace
}  // namespace viscera
