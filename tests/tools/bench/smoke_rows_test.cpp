#include "tools/bench/smoke_rows.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace viscera {
namespace {

TEST(SmokeRows, SizesAreReadAsTheyAreWritten) {
  EXPECT_EQ(number_of_particles("10k"), 10'000u);
  EXPECT_EQ(number_of_particles("1.5M"), 1'500'000u);
  EXPECT_EQ(number_of_particles("1234"), 1234u);
  for (const char* text : {"", "k", "10K", "10 k", "-5", "1.2345k", "nan", "1e30", "10kk"})
    EXPECT_FALSE(number_of_particles(text)) << text;
  for (const std::size_t size : {1234u, 1000u, 12'500u, 1'000'000u, 1'500'000u, 1'234'000u})
    EXPECT_EQ(number_of_particles(particles_text(size)), size) << particles_text(size);
  EXPECT_EQ(particles_text(1'000'000), "1M");
}

TEST(SmokeRows, PassesWithoutCountedBytesHaveNoShare) {
  SmokeRow row;
  row.pass = "gas";
  EXPECT_TRUE(to_json(row)["bandwidth_share"].is_null());
  row.bandwidth_share = 0.25;
  EXPECT_EQ(to_json(row)["bandwidth_share"], 0.25);
  EXPECT_EQ(least_bytes("gas", 1e6, 1e5, 1e5), 0.0);
  EXPECT_GT(least_bytes("bin", 1e6, 1e5, 1e5), least_bytes("bin", 1e5, 1e5, 1e5));
}

}  // namespace
}  // namespace viscera
