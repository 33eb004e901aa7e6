#include "engine/io/memory_limit.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>

#include "tests/support/paths.h"

namespace viscera {
namespace {
namespace fs = std::filesystem;

class MemoryLimitTest : public testing::Test {
 protected:
  void write(const fs::path& file, const std::string& text) {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  const test::TemporaryFolder folder_;
  const fs::path root_ = folder_.path();
};

TEST_F(MemoryLimitTest, WithoutGroupIsTheMachines) {
  const MemoryLimit limit = memory_limit(root_);
  EXPECT_EQ(limit.source, "this machine's memory");
  EXPECT_GT(limit.bytes, 100'000'000u);
}

TEST_F(MemoryLimitTest, IsThatOfItsControlGroup) {
  write("proc/self/cgroup", "0::/jobs/one\n");
  write("sys/fs/cgroup/jobs/one/memory.max", "50000000\n");
  const MemoryLimit limit = memory_limit(root_);
  EXPECT_EQ(limit.bytes, 50'000'000u);
  EXPECT_EQ(limit.source, "the memory of its control group");
}

TEST_F(MemoryLimitTest, IsThatOfAGroupAboveItWhereThatHasLess) {
  write("proc/self/cgroup", "0::/jobs/one\n");
  write("sys/fs/cgroup/jobs/one/memory.max", "max\n");
  write("sys/fs/cgroup/jobs/memory.max", "40000000\n");
  EXPECT_EQ(memory_limit(root_).bytes, 40'000'000u);
}

TEST_F(MemoryLimitTest, IsThatOfAGroupOfTheFirstVersion) {
  write("proc/self/cgroup", "9:name=systemd:/\n4:cpu,memory:/box\n0::/\n");
  write("sys/fs/cgroup/memory/box/memory.limit_in_bytes", "30000000\n");
  write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_EQ(memory_limit(root_).bytes, 30'000'000u);
}

TEST_F(MemoryLimitTest, IsThatOfUlimit) {
  rlimit before = {};
  ASSERT_EQ(::getrlimit(RLIMIT_DATA, &before), 0);
  rlimit lower = before;
  lower.rlim_cur = 900'000'000;
  ASSERT_EQ(::setrlimit(RLIMIT_DATA, &lower), 0);
  const MemoryLimit limit = memory_limit(root_);
  ASSERT_EQ(::setrlimit(RLIMIT_DATA, &before), 0);
  EXPECT_EQ(limit.bytes, 900'000'000u);
  EXPECT_EQ(limit.source, "ulimit -d");
}

TEST(MemoryBudget, RefusesWhatNoLongerFitsWithFigureAndWhatToChange) {
  MemoryBudget budget({5'000'000'000, "this machine's memory"});
  EXPECT_TRUE(budget.check(3'900'000'000, "nodes", "fewer"));
  budget.keep(1'500'000'000);
  const auto refused = budget.check(2'600'000'000, "nodes", "fewer of them");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().text(),
            "found nodes that need 2.6 GB beside 1.5 GB of what comes before, expected at most "
            "4.0 GB, 80 % of this machine's memory: fewer of them");
  EXPECT_TRUE(budget.check(2'500'000'000, "nodes", "fewer"));
}

}  // namespace
}  // namespace viscera
