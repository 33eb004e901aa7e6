// How golden figures are read from a run's folder and compared.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/support/paths.h"
#include "tools/golden/golden.h"

namespace viscera::test {
namespace {

const GoldenScene kOld{"scene", 1.0, {{"force, N", {2.0, 0.01}}, {"heat, J", {-4.0, 0.02}}}};

TEST(GoldenFigures, AreTakenFromForcesReportAndLesion) {
  const TemporaryFolder folder;
  std::ofstream(folder / "forces.csv")
      << "time_s,hook_x_m,hook_y_m,hook_z_m,hook_fx_N,hook_fy_N,hook_fz_N\n"
      << "0,0,0,0,0,0,0\n"
      << "0.1,0,0,-0.001,0,0,2\n"
      << "0.2,0.001,0,-0.001,-3,0,4\n"
      << "0.3,0,0,-0.001,-3,0,4\n";
  std::ofstream(folder / "lesion.csv") << "time_s,depth_m,width_m\n0,0,0\n1,0.002,0.005\n";
  std::ofstream(folder / "report.json") << R"({ "complete": true,
    "organs": [{"name": "liver", "greatest_displacement_m": 0.004}], "haptics": [], "links": [],
    "tissue": [{"organ": "liver", "greatest_temperature_K": 400, "volume_coagulated_m3": 0}],
    "cautery": {"energy_delivered_J": 30}, "smoke": {"emitted_kg": 1e-6, "evacuated_kg": 0}})";
  const auto figures = figures_of_run(folder.path());
  ASSERT_TRUE(figures) << figures.error().text();
  const std::map<std::string, double> expected = {
      {"hook: greatest force, N", 5.0},
      {"hook: mean force, N", (0.0 + 2.0 + 5.0 + 5.0) / 4.0},
      // Down against a mean of 1 N, aside against one of 1.5 N; what came back doesn't count.
      {"hook: work put in, J", 1e-3 + 1.5e-3},
      {"liver: greatest displacement, m", 0.004},
      {"liver: greatest temperature, K", 400.0},
      {"delivered to tissue, J", 30.0},
      {"smoke emitted, kg", 1e-6},
      {"lesion: depth, m", 0.002},
      {"lesion: width, m", 0.005}};
  ASSERT_EQ(figures->size(), expected.size());
  for (const auto& [name, value] : expected) {
    ASSERT_TRUE(figures->contains(name)) << name;
    EXPECT_NEAR(figures->at(name), value, 1e-12) << name;
  }
}

TEST(GoldenFigures, AFolderWithoutAReportIsRefused) {
  const TemporaryFolder folder;
  const auto figures = figures_of_run(folder.path());
  ASSERT_FALSE(figures);
  EXPECT_NE(figures.error().text().find("found no report"), std::string::npos);
}

/// The least that a whole run's report says.
nlohmann::ordered_json least_report() {
  nlohmann::ordered_json report = {{"complete", true}};
  for (const char* list : {"organs", "haptics", "links", "tissue"})
    report[list] = nlohmann::ordered_json::array();
  return report;
}

/// What is said of a folder with these files; empty where it has figures.
std::string refusal(const std::string& report, const std::string& forces = "",
                    const std::string& lesion = "") {
  const TemporaryFolder folder;
  std::ofstream(folder / "report.json") << report;
  if (!forces.empty()) std::ofstream(folder / "forces.csv") << forces;
  if (!lesion.empty()) std::ofstream(folder / "lesion.csv") << lesion;
  const auto figures = figures_of_run(folder.path());
  return figures ? "" : figures.error().text();
}

void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(text.find(word), std::string::npos) << word << " isn't in: " << text;
}

TEST(GoldenFigures, OfARunThatEndedEarlyThereAreNone) {
  auto report = least_report();
  ASSERT_EQ(refusal(report.dump()), "");
  report["complete"] = false;
  report["reason"] = "smoke at 0.3 s: No space left on device";
  expect_words(refusal(report.dump()),
               {"report.json: found a run that ended early: smoke at 0.3 s"});
  report.erase("complete");
  expect_words(refusal(report.dump()), {"found a run that ended early"});
}

TEST(GoldenFigures, OfReportsThatLackWhatTheyHaveThereAreNone) {
  for (const char* list : {"organs", "haptics", "links", "tissue"}) {
    auto report = least_report();
    report.erase(list);
    expect_words(refusal(report.dump()), {"report.json: found no list", list});
    report[list] = 3;
    expect_words(refusal(report.dump()), {"report.json: found no list", list});
    for (const char* entry : {"{}", "7", R"({"name": 1, "organ": 1, "tool": 1})"}) {
      report[list] = nlohmann::ordered_json::array({nlohmann::ordered_json::parse(entry)});
      expect_words(refusal(report.dump()), {list, "found an entry without"});
    }
  }
  auto report = least_report();
  report["cautery"] = nullptr;
  report["smoke"] = "none";
  EXPECT_EQ(refusal(report.dump()), "") << "nothing burns";
}

TEST(GoldenFigures, TablesWithoutAColumnAreRefused) {
  const std::string report = least_report().dump();
  expect_words(
      refusal(report, "time_s,hook_x_m,hook_y_m,hook_z_m,hook_fx_N,hook_fy_N\n0,0,0,0,0,0\n"),
      {"forces.csv: found hook without all its columns"});
  expect_words(refusal(report, "", "time_s,depth_m\n0,0\n"),
               {"lesion.csv: found no column", "width_m"});
}

TEST(GoldenChanges, OfTheSameFiguresThereAreNone) {
  EXPECT_TRUE(golden_changes(kOld, {{"force, N", 2.0}, {"heat, J", -4.0}}).empty());
}

TEST(GoldenChanges, SayByHowMuchAndWhetherThatIsAllowed) {
  const auto within = golden_changes(kOld, {{"force, N", 2.01}, {"heat, J", -4.0}});
  ASSERT_EQ(within.size(), 1u);
  EXPECT_FALSE(within[0].beyond);
  EXPECT_NE(within[0].line.find("2.01"), std::string::npos);
  EXPECT_NE(within[0].line.find("+0.5 %"), std::string::npos) << within[0].line;
  for (const double heat : {-4.2, -3.8, 4.0, std::nan("")}) {
    const auto beyond = golden_changes(kOld, {{"force, N", 2.0}, {"heat, J", heat}});
    ASSERT_EQ(beyond.size(), 1u) << heat;
    EXPECT_TRUE(beyond[0].beyond) << heat;
  }
}

TEST(GoldenChanges, FiguresThatComeOrGoAreBeyond) {
  const auto changes = golden_changes(kOld, {{"force, N", 2.0}, {"work, J", 1.0}});
  ASSERT_EQ(changes.size(), 2u);
  for (const GoldenChange& change : changes) EXPECT_TRUE(change.beyond) << change.line;
}

TEST(GoldenFile, IsReadAsItWasWrittenAndKeepsItsTolerances) {
  const TemporaryFolder folder;
  const GoldenScene fresh = with_figures(kOld, {{"force, N", 3.25}, {"hot, K", 300.0}});
  std::ofstream(folder / "golden.json") << golden_text({fresh});
  const auto read = read_golden(folder / "golden.json");
  ASSERT_TRUE(read) << read.error().text();
  ASSERT_EQ(read->size(), 1u);
  EXPECT_EQ(read->front().name, "scene");
  EXPECT_EQ(read->front().duration_s, 1.0);
  ASSERT_EQ(read->front().figures.size(), 2u);
  EXPECT_EQ(read->front().figures.at("force, N").value, 3.25);
  EXPECT_EQ(read->front().figures.at("force, N").tolerance, 0.01);
  EXPECT_EQ(read->front().figures.at("hot, K").tolerance, 0.005);
}

TEST(GoldenFile, ThatIsNoneIsRefusedWithThePlace) {
  const TemporaryFolder folder;
  const auto said = [&](const std::string& text) {
    std::ofstream(folder / "golden.json") << text;
    const auto read = read_golden(folder / "golden.json");
    return read ? "" : read.error().text();
  };
  ASSERT_EQ(said(golden_text({kOld})), "");
  for (const char* text : {"[1", "[]", "{}", R"({"scenes": {}})"})
    expect_words(said(text), {"golden.json: found no golden figures"});
  const auto whole = nlohmann::ordered_json::parse(golden_text({kOld, kOld}));
  for (const char* key : {"scene", "duration_s", "figures"}) {
    auto broken = whole;
    broken["scenes"][1].erase(key);
    expect_words(said(broken.dump()), {"golden.json: scenes/1: found no golden scene"});
    broken["scenes"][1][key] = nlohmann::ordered_json::array({1});
    expect_words(said(broken.dump()), {"golden.json: scenes/1: found no golden scene"});
  }
  for (const char* key : {"value", "tolerance"}) {
    auto broken = whole;
    broken["scenes"][1]["figures"]["heat, J"][key] = "much";
    expect_words(said(broken.dump()), {"golden.json: scenes/1: found no golden scene"});
  }
}

}  // namespace
}  // namespace viscera::test
