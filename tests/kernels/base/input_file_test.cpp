#include "kernels/base/input_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

class InputFileTest : public testing::Test {
 protected:
  fs::path written(const std::string& name, const std::string& text) const {
    std::ofstream(folder / name) << text;
    return folder / name;
  }
  static std::string refusal(const fs::path& file, std::uintmax_t most = 100) {
    const auto read = read_input(file, "a surface", most);
    return read ? "" : read.error().text();
  }
  static bool has(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  }

  const test::TemporaryFolder temporary;
  const fs::path folder = temporary.path();
};

TEST_F(InputFileTest, GivesTheBytesOfARegularFile) {
  const std::string bytes("a\0b\n\xff", 5);
  EXPECT_EQ(read_input(written("a.obj", bytes), "a surface", 5).value(), bytes);
  EXPECT_EQ(read_input(written("none.obj", ""), "a surface", 0).value(), "");
}

TEST_F(InputFileTest, FollowsALinkToARegularFile) {
  fs::create_symlink(written("a.obj", "v"), folder / "link.obj");
  EXPECT_EQ(read_input(folder / "link.obj", "a surface", 5).value(), "v");
}

TEST_F(InputFileTest, RefusesWhatIsNoRegularFileWithoutWaiting) {
  ASSERT_EQ(::mkfifo((folder / "pipe.obj").c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", folder / "zero.obj");
  fs::create_symlink(folder / "pipe.obj", folder / "link.obj");
  for (const char* name : {"pipe.obj", "zero.obj", "link.obj"})
    EXPECT_TRUE(has(refusal(folder / name),
                    "found something other than a regular file, expected a surface"))
        << name;
  EXPECT_TRUE(has(refusal(folder), "found a folder, expected a surface"));
}

TEST_F(InputFileTest, RefusesAbsentFilesAndBadNames) {
  EXPECT_TRUE(has(refusal(folder / "absent.obj"), "absent.obj: found no such file"));
  EXPECT_TRUE(has(refusal(written("a.obj", "v") / "below"), "found no such file"));
  EXPECT_TRUE(has(refusal(folder / std::string("a.obj\0.stl", 10)), "found a NUL"));
  EXPECT_TRUE(has(refusal(""), "found no name"));
  fs::create_symlink(folder / "b.obj", folder / "c.obj");
  fs::create_symlink(folder / "c.obj", folder / "b.obj");
  EXPECT_TRUE(has(refusal(folder / "b.obj"), "cannot be read"));
}

TEST_F(InputFileTest, RefusesMoreThanItsLimit) {
  EXPECT_EQ(refusal(written("a.obj", "12345"), 5), "");
  EXPECT_TRUE(has(refusal(folder / "a.obj", 4), "found 5 bytes, expected at most 4"));
}

TEST_F(InputFileTest, NoticesThatAFileBecameShorter) {
  auto file = InputFile::open(written("a.obj", "12345"), "a surface", 100);
  ASSERT_TRUE(file);
  fs::resize_file(folder / "a.obj", 2);
  const auto rest = file->rest();
  ASSERT_FALSE(rest);
  EXPECT_TRUE(has(rest.error().text(), "found its end after 2 bytes, expected 5"));
}

TEST_F(InputFileTest, AReadThatFailsIsSaidAndNotTriedForEver) {
  // This process's memory: a regular file, and nothing lies at its beginning.
  auto file = InputFile::open("/proc/self/mem", "a surface", 100);
  ASSERT_TRUE(file) << file.error().text();
  char two[2];
  const auto got = file->read(two, 2);
  ASSERT_FALSE(got);
  EXPECT_TRUE(has(got.error().text(), "/proc/self/mem: cannot be read"));
}

TEST_F(InputFileTest, AFileMayHaveTheDescriptorOfAStandardInputThatIsClosed) {
  const fs::path name = written("a.obj", "12345");
  const int standard = ::dup(0);
  ::close(0);
  {
    auto file = InputFile::open(name, "a surface", 100);
    EXPECT_TRUE(file);
    if (file) {
      EXPECT_EQ(file->rest().value(), "12345");
    }
  }
  EXPECT_EQ(::fcntl(0, F_GETFD), -1) << "it was closed again";
  if (standard >= 0) {
    ::dup2(standard, 0);
    ::close(standard);
  }
}

TEST_F(InputFileTest, AFileThatComesInPiecesIsReadWhole) {
  // The kernel gives such files a page or so at a time.
  auto file = InputFile::open("/proc/self/smaps", "a surface", 100);
  ASSERT_TRUE(file) << file.error().text();
  constexpr std::size_t kSize = 16'384;
  std::string bytes(2 * kSize, '\0');
  EXPECT_EQ(file->read(bytes.data() + kSize, kSize).value(), kSize);
  EXPECT_EQ(bytes.find_first_not_of('\0'), kSize);
  EXPECT_EQ(bytes.find('\0', kSize), std::string::npos);
}

TEST_F(InputFileTest, ReadsInPiecesAndThenTheRest) {
  auto file = InputFile::open(written("a.obj", "12345"), "a surface", 100);
  ASSERT_TRUE(file);
  char two[2];
  EXPECT_EQ(file->read(two, 2).value(), 2u);
  EXPECT_EQ(std::string(two, 2), "12");
  InputFile moved = *std::move(file);
  EXPECT_EQ(moved.rest().value(), "345");
  EXPECT_EQ(moved.read(two, 2).value(), 0u);
}

TEST_F(InputFileTest, NamesInsideAFolderStayThere) {
  fs::create_directory(folder / "inner");
  written("secret.bin", "s");
  EXPECT_EQ(path_inside(folder, "inner/../secret.bin").value(), folder / "secret.bin");
  EXPECT_EQ(path_inside(folder / "inner", "not_yet.bin").value(), folder / "inner/not_yet.bin");
  fs::create_symlink(folder / "secret.bin", folder / "inner/link.bin");
  fs::create_symlink(folder, folder / "inner/up");
  for (const std::string name :
       {"../secret.bin", "link.bin", "up/secret.bin", "/etc/hostname", "", "x/../../secret.bin"})
    EXPECT_FALSE(path_inside(folder / "inner", name)) << name;
  EXPECT_TRUE(has(path_inside(folder, std::string("a\0b", 3)).error().text(), "a NUL"));
}

}  // namespace
}  // namespace viscera
