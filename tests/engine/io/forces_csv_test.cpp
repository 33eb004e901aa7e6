#include "engine/io/forces_csv.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::entries;
using test::file_text;
using test::TemporaryFolder;

TEST(ForcesCsv, HasAHeaderWithUnitsAndARowATick) {
  const TemporaryFolder folder;
  const std::vector<std::string> names = {"hook", "grasper"};
  auto csv = ForcesCsv::create(folder / "forces.csv", names);
  ASSERT_TRUE(csv);
  const std::vector<TipSample> samples = {{.position = {0.5, -0.25, 0}, .force = {1, 2, -3}}, {}};
  csv->add(0.001, samples);
  ASSERT_TRUE(csv->finish());
  EXPECT_EQ(file_text(folder / "forces.csv"),
            "time_s,hook_x_m,hook_y_m,hook_z_m,hook_fx_N,hook_fy_N,hook_fz_N,"
            "grasper_x_m,grasper_y_m,grasper_z_m,grasper_fx_N,grasper_fy_N,grasper_fz_N\n"
            "0.001,0.5,-0.25,0,1,2,-3,0,0,0,0,0,0\n");
}

TEST(ForcesCsv, ReadsBackToTheSameDoubles) {
  const TemporaryFolder folder;
  const std::vector<std::string> names = {"hook"};
  auto csv = ForcesCsv::create(folder / "forces.csv", names);
  ASSERT_TRUE(csv);
  const Vec3 position(1.0 / 3.0, -1e-300, 0.1), force(std::sqrt(2.0), 1e22, -0.0);
  csv->add(1.0 / 60.0, std::vector<TipSample>{{position, force}});
  ASSERT_TRUE(csv->finish());
  std::istringstream in(file_text(folder / "forces.csv"));
  std::string header, row;
  std::getline(in, header);
  std::getline(in, row);
  std::vector<double> numbers;
  std::istringstream fields(row);
  for (std::string number; std::getline(fields, number, ',');) numbers.push_back(std::stod(number));
  EXPECT_EQ(numbers, (std::vector<double>{1.0 / 60.0, position.x(), position.y(), position.z(),
                                          force.x(), force.y(), force.z()}));
}

TEST(ForcesCsv, QuotesANameWithAComma) {
  const TemporaryFolder folder;
  const std::vector<std::string> names = {"a,\"b\""};
  auto csv = ForcesCsv::create(folder / "forces.csv", names);
  ASSERT_TRUE(csv);
  ASSERT_TRUE(csv->finish());
  EXPECT_TRUE(file_text(folder / "forces.csv").starts_with("time_s,\"a,\"\"b\"\"_x_m\","));
}

TEST(ForcesCsv, LeavesNothingWhenTheRunIsStopped) {
  const TemporaryFolder folder;
  {
    auto csv = ForcesCsv::create(folder / "forces.csv", std::vector<std::string>{"hook"});
    ASSERT_TRUE(csv);
    csv->add(0.0, std::vector<TipSample>(1));
  }
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(ForcesCsv, ReportsAFullDiskAtTheEnd) {
  const TemporaryFolder folder;
  fs::create_symlink("/dev/full", folder / "forces.csv");
  auto csv = ForcesCsv::create(folder / "forces.csv", std::vector<std::string>{"hook"});
  ASSERT_TRUE(csv);
  for (int tick = 0; tick < 10'000; ++tick) csv->add(1e-3 * tick, std::vector<TipSample>(1));
  const auto finished = csv->finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().text().find("forces.csv: can't be written: No space left on device"),
            std::string::npos);
}

TEST(ForcesCsv, GoesOnAfterItsRowsSoFarToTheSameFile) {
  const TemporaryFolder folder;
  const std::vector<std::string> names = {"probe"};
  auto whole = ForcesCsv::create(folder / "whole.csv", names);
  auto begun = ForcesCsv::create(folder / "forces.csv", names);
  ASSERT_TRUE(whole && begun);
  const auto add = [](ForcesCsv& table, int row) {
    const TipSample sample{Vec3(row, 0.1, 1.0 / 3.0), Vec3(0, 0, 0.25 * row)};
    table.add(row / 60.0, {&sample, 1});
  };
  for (int row = 0; row < 500; ++row) {
    add(*whole, row);
    if (row < 300) add(*begun, row);
  }
  const auto text = begun->text();
  ASSERT_TRUE(text) << text.error().text();
  add(*begun, 1000);  // lost with the process
  auto resumed = ForcesCsv::go_on(folder / "forces.csv", *text);
  ASSERT_TRUE(resumed);
  for (int row = 300; row < 500; ++row) add(*resumed, row);
  ASSERT_TRUE(resumed->finish());
  ASSERT_TRUE(whole->finish());
  EXPECT_EQ(file_text(folder / "forces.csv"), file_text(folder / "whole.csv"));
}

}  // namespace
}  // namespace viscera
