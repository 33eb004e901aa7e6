#include "engine/io/confine.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/landlock.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <functional>

#include "kernels/base/sanitized.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

bool kernel_has_landlock() {
  return ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION) > 0;
}

class Confined : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(folder / "mine");
    std::ofstream(folder / "mine/file") << "mine";
    std::ofstream(folder / "secret") << "secret";
  }

  /// Whether `work` succeeds in a confined child; false also where the child is killed.
  bool works(const std::function<bool()>& work, double seconds = 5.0) const {
    const pid_t child = ::fork();
    if (child == 0) {
      confine(std::uintmax_t{512} << 20, seconds, folder / "mine");
      ::_exit(work() ? 0 : 1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }
  static bool opens(const fs::path& file, int flags) {
    const int descriptor = ::open(file.c_str(), flags, 0600);
    return descriptor >= 0;
  }

  const test::TemporaryFolder temporary;
  const fs::path folder = temporary.path();
};

TEST_F(Confined, MayReadItsFolder) {
  EXPECT_TRUE(works([&] { return opens(folder / "mine/file", O_RDONLY); }));
}

TEST_F(Confined, MayNotReadAnotherFolder) {
  if (!kernel_has_landlock()) GTEST_SKIP() << "this kernel has no Landlock";
  EXPECT_FALSE(works([&] { return opens(folder / "secret", O_RDONLY); }));
  EXPECT_FALSE(works([&] { return opens("/etc/passwd", O_RDONLY); }));
}

TEST_F(Confined, MayWriteNothing) {
  EXPECT_FALSE(works([&] {
    const int file = ::open((folder / "mine/new").c_str(), O_WRONLY | O_CREAT, 0600);
    return file >= 0 && ::write(file, "x", 1) == 1;
  }));
}

TEST_F(Confined, MayNeitherConnectNorStartAProcess) {
  if (kSanitized) GTEST_SKIP() << "sanitizers need more system calls";
  EXPECT_FALSE(works([] { return ::socket(AF_INET, SOCK_STREAM, 0) >= 0; }));
  EXPECT_FALSE(works([] { return ::socket(AF_UNIX, SOCK_STREAM, 0) >= 0; }));
  EXPECT_FALSE(works([] { return ::fork() >= 0; }));
  EXPECT_FALSE(works([] {
    char name[] = "/bin/true";
    char* const words[] = {name, nullptr};
    ::execv(name, words);
    return false;
  }));
}

TEST_F(Confined, EndsWhenItsTimeIsOver) {
  EXPECT_FALSE(works(
      [] {
        std::atomic<unsigned long> i = 0;
        while (true) ++i;
        return true;
      },
      1.0));
}

TEST_F(Confined, AllocatesNoMoreThanItsLimit) {
  if (kSanitized) GTEST_SKIP() << "sanitizers keep memory of their own";
  const auto takes = [](std::size_t mebibytes) {
    return [mebibytes] {
      void* block = std::malloc(mebibytes << 20);
      return block != nullptr;
    };
  };
  EXPECT_TRUE(works(takes(64)));
  EXPECT_FALSE(works(takes(1024)));
}

}  // namespace
}  // namespace viscera
