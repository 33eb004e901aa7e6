#include "engine/io/reader_process.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "engine/io/foreign_files.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

class ReaderProcess : public testing::Test {
 protected:
  void SetUp() override { std::ofstream(file) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"; }
  void TearDown() override { ::unsetenv("VISCERA_READER"); }
  Result<TriangleSurface> read(const ReadLimits& limits, std::string_view reader = kSurfaceReader) {
    return read_by_child<TriangleSurface>({reader, file, {"0.001"}, limits});
  }
  static ReadLimits enough() { return ReadLimits::for_file(100); }
  static void expect_words(const Result<TriangleSurface>& read, const char* words) {
    ASSERT_FALSE(read);
    EXPECT_NE(read.error().text().find("one.obj: cannot be read: "), std::string::npos)
        << read.error().text();
    EXPECT_NE(read.error().text().find(words), std::string::npos) << read.error().text();
  }

  const test::TemporaryFolder temporary;
  const fs::path folder = temporary.path(), file = folder / "one.obj";
};

TEST_F(ReaderProcess, HandsBackWhatItRead) {
  const auto surface = read(enough());
  ASSERT_TRUE(surface) << surface.error().text();
  EXPECT_EQ(surface->vertices.size(), 3u);
  EXPECT_DOUBLE_EQ(surface->vertices[1].x() + surface->vertices[2].x() + surface->vertices[0].x(),
                   1e-3);
}

TEST_F(ReaderProcess, RefusesALongerAnswerThanIsAllowed) {
  ReadLimits limits = enough();
  limits.answer = 8;
  expect_words(read(limits), "it holds more than");
}

TEST_F(ReaderProcess, SaysWhichReaderIsNotThere) {
  expect_words(read(enough(), "tarot"), "its reader ended with exit code 2");
}

TEST_F(ReaderProcess, SaysThatTheReaderCrashed) {
  const fs::path program = folder / "crash";
  std::ofstream(program) << "#!/bin/sh\nkill -SEGV $$\n";
  fs::permissions(program, fs::perms::owner_all);
  ::setenv("VISCERA_READER", program.c_str(), 1);
  expect_words(read(enough()), "its reader crashed (signal 11): the file is damaged");
}

TEST_F(ReaderProcess, TakesNoHalfAnswer) {
  const fs::path program = folder / "half";
  std::ofstream(program) << "#!/bin/sh\nprintf 'eriv\\0\\0\\0\\0\\377\\377\\0\\0\\0\\0\\0\\0xx'\n";
  fs::permissions(program, fs::perms::owner_all);
  ::setenv("VISCERA_READER", program.c_str(), 1);
  expect_words(read(enough()), "answer is damaged");
}

TEST_F(ReaderProcess, LeavesNoDescriptorOpen) {
  const auto open_now = [] {
    return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
  };
  ASSERT_TRUE(read(enough()));
  const auto before = open_now();
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(read(enough()));
    EXPECT_FALSE(read(enough(), "tarot"));
  }
  EXPECT_EQ(open_now(), before);
}

}  // namespace
}  // namespace viscera
