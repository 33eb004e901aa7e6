#include "engine/io/response_cache.h"

#include <gtest/gtest.h>
#include <hdf5.h>

#include <cstdlib>
#include <numeric>
#include <optional>

#include "engine/io/atomic_file.h"
#include "kernels/base/random.h"
#include "tests/engine/io/file_size_limit.h"
#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::entries;
using test::file_text;
using test::put_text;
using test::TemporaryFolder;

const std::string kKey = "00112233445566778899aabbccddeeff";

PreparedResponse example() {
  PreparedResponse r;
  const Random random(7, 1);
  constexpr int kNodes = 40;
  for (int i = 0; i < kNodes; ++i) {
    r.cloud.positions.push_back(random.direction(static_cast<std::uint64_t>(i)));
    r.cloud.spacings.push_back(random.uniform(static_cast<std::uint64_t>(1000 + i)));
  }
  r.cloud.surface_count = 30;
  r.compliance.places = 30;
  r.compliance.touchable = {3, 5, 8, 13};
  for (std::uint64_t i = 0; i < 9 * 30 * 4; ++i) {
    r.compliance.columns.push_back(static_cast<float>(random.normal(i)));
  }
  r.figures = {.unknowns = 120,
               .stiffness_nonzeros = 4321,
               .quadrature_points = 99,
               .gradient_correction = 0.03,
               .fixed_area = 1.5e-3,
               .assemble_s = 0.1,
               .factor_s = 0.2,
               .compliance_s = 0.3,
               .factor_bytes = 5'000'000'000,
               .smallest_compliance_eigenvalue = 1e-4};
  r.compliance.symmetric = false;
  r.extra["weights"] = std::vector<float>{0.5f, 0.25f};
  r.extra["rows"] = std::vector<int>{0, 1, 2};
  r.extra["empty"] = std::vector<double>{};
  return r;
}

/// A cache that holds the example, and what one look into it gives.
struct Cached {
  TemporaryFolder folder;
  ResponseCache cache{folder / "cache"};
  fs::path file = cache.file(kKey);
  Cached() { EXPECT_TRUE(cache.save(kKey, example())); }
};

TEST(ResponseCache, GivesBackExactlyWhatWasSaved) {
  const Cached cached;
  const CachedResponse found = cached.cache.load(kKey);
  EXPECT_EQ(found.warning, "");
  ASSERT_TRUE(found.response);
  const PreparedResponse expected = example();
  const PreparedResponse& r = *found.response;
  EXPECT_EQ(r.cloud.positions, expected.cloud.positions);
  EXPECT_EQ(r.cloud.spacings, expected.cloud.spacings);
  EXPECT_EQ(r.cloud.surface_count, expected.cloud.surface_count);
  EXPECT_EQ(r.compliance.places, expected.compliance.places);
  EXPECT_EQ(r.compliance.touchable, expected.compliance.touchable);
  EXPECT_EQ(r.compliance.columns, expected.compliance.columns);
  EXPECT_EQ(r.figures.unknowns, expected.figures.unknowns);
  EXPECT_EQ(r.figures.stiffness_nonzeros, expected.figures.stiffness_nonzeros);
  EXPECT_EQ(r.figures.quadrature_points, expected.figures.quadrature_points);
  EXPECT_EQ(r.figures.gradient_correction, expected.figures.gradient_correction);
  EXPECT_EQ(r.figures.fixed_area, expected.figures.fixed_area);
  EXPECT_EQ(r.figures.assemble_s, expected.figures.assemble_s);
  EXPECT_EQ(r.figures.factor_s, expected.figures.factor_s);
  EXPECT_EQ(r.figures.compliance_s, expected.figures.compliance_s);
  EXPECT_EQ(r.figures.factor_bytes, expected.figures.factor_bytes);
  EXPECT_EQ(r.figures.smallest_compliance_eigenvalue,
            expected.figures.smallest_compliance_eigenvalue);
  EXPECT_EQ(r.compliance.symmetric, expected.compliance.symmetric);
  EXPECT_EQ(r.extra, expected.extra);
  EXPECT_EQ(entries(cached.folder / "cache"), 1);
}

TEST(ResponseCache, IsSilentAboutAnOrganThatItDoesntHave) {
  const TemporaryFolder folder;
  const CachedResponse found = ResponseCache(folder / "cache").load(kKey);
  EXPECT_FALSE(found.response);
  EXPECT_EQ(found.warning, "");
}

TEST(ResponseCache, RebuildsAForeignResponse) {
  const Cached cached;
  const std::string other = "ffffffffffffffffffffffffffffffff";
  fs::copy_file(cached.file, cached.cache.file(other));
  const CachedResponse found = cached.cache.load(other);
  EXPECT_FALSE(found.response);
  EXPECT_NE(found.warning.find("rebuilt because it was made for other inputs (key " + kKey),
            std::string::npos)
      << found.warning;
}

TEST(ResponseCache, RebuildsATruncatedFile) {
  const Cached cached;
  const auto size = fs::file_size(cached.file);
  for (const auto left : {size - 1, size / 2, std::uintmax_t{5000}, std::uintmax_t{60}}) {
    fs::resize_file(cached.file, left);
    const CachedResponse found = cached.cache.load(kKey);
    EXPECT_FALSE(found.response) << left << " of " << size;
    EXPECT_NE(found.warning.find("rebuilt because it is truncated or damaged"), std::string::npos)
        << found.warning;
  }
}

TEST(ResponseCache, RebuildsGarbageAndAnEmptyFile) {
  const Cached cached;
  for (const std::string& text :
       {std::string(), std::string("not a cache\n"), std::string(100'000, '\xff')}) {
    put_text(cached.file, text);
    const CachedResponse found = cached.cache.load(kKey);
    EXPECT_FALSE(found.response);
    EXPECT_NE(found.warning.find("rebuilt because it wasn't written by Viscera"), std::string::npos)
        << found.warning;
  }
  fs::remove(cached.file);
  fs::create_directory(cached.file);
  EXPECT_FALSE(cached.cache.load(kKey).response);
  EXPECT_NE(cached.cache.load(kKey).warning, "");
}

TEST(ResponseCache, RebuildsAnHdf5FileOfAnotherProgram) {
  const Cached cached;
  H5Fclose(H5Fcreate(cached.file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  EXPECT_NE(cached.cache.load(kKey).warning.find("rebuilt because it wasn't written by Viscera"),
            std::string::npos);
}

TEST(ResponseCache, NoticesEveryDamagedByte) {
  const Cached cached;
  const std::string good = file_text(cached.file);
  constexpr std::size_t kUserBlock = 4096, kSealed = 56;
  const Random random(11, 3);
  for (std::uint64_t trial = 0; trial < 200; ++trial) {
    std::string bad = good;
    // All but the unused rest of the user block counts.
    std::size_t at = random.bits(2 * trial) % (bad.size() - kUserBlock + kSealed);
    if (at >= kSealed) at += kUserBlock - kSealed;
    bad[at] = static_cast<char>(bad[at] ^ (1 + random.bits(2 * trial + 1) % 255));
    put_text(cached.file, bad);
    const CachedResponse found = cached.cache.load(kKey);
    EXPECT_FALSE(found.response) << "byte " << at;
    EXPECT_NE(found.warning, "");
  }
}

TEST(ResponseCache, StaysAnHdf5FileThatOtherToolsRead) {
  const Cached cached;
  EXPECT_GT(H5Fis_hdf5(cached.file.c_str()), 0);
}

TEST(ResponseCache, RefusesIndicesBeyondThePlaces) {
  const TemporaryFolder folder;
  const ResponseCache cache(folder.path());
  PreparedResponse wrong = example();
  wrong.compliance.touchable.back() = 30;
  ASSERT_TRUE(cache.save(kKey, wrong));
  const CachedResponse found = cache.load(kKey);
  EXPECT_FALSE(found.response);
  EXPECT_NE(found.warning.find("nodes or places that it doesn't have"), std::string::npos);
}

TEST(ResponseCache, LeavesNoPartOnAFullDisk) {
  const TemporaryFolder folder;
  const ResponseCache cache(folder / "cache");
  {
    const test::FileSizeLimit limit(20'000);
    const auto saved = cache.save(kKey, example());
    ASSERT_FALSE(saved);
    EXPECT_NE(saved.error().text().find("can't be written: File too large"), std::string::npos)
        << saved.error().text();
    EXPECT_EQ(entries(folder / "cache"), 0);
  }
  EXPECT_TRUE(cache.save(kKey, example()));
  EXPECT_TRUE(cache.load(kKey).response);
}

TEST(ResponseCache, SaysThatItsFolderCantBeCreated) {
  const TemporaryFolder folder;
  put_text(folder / "file", "text");
  const auto saved = ResponseCache(folder / "file/cache").save(kKey, example());
  ASSERT_FALSE(saved);
  EXPECT_NE(saved.error().text().find("file/cache: can't be created"), std::string::npos);
  EXPECT_FALSE(ResponseCache("/proc").save(kKey, example()));
}

/// Sets a variable for the scope, or removes it.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* old = std::getenv(name)) old_ = old;
    value ? setenv(name, value, 1) : unsetenv(name);
  }
  ~Variable() { old_ ? setenv(name_, old_->c_str(), 1) : unsetenv(name_); }

 private:
  const char* name_;
  std::optional<std::string> old_;
};

TEST(ResponseCache, StandsWhereTheEnvironmentSays) {
  const Variable own("VISCERA_CACHE", "/own");
  const Variable xdg("XDG_CACHE_HOME", "/xdg");
  const Variable home("HOME", "/home/person");
  EXPECT_EQ(ResponseCache::default_folder(), "/own");
  const Variable no_own("VISCERA_CACHE", nullptr);
  EXPECT_EQ(ResponseCache::default_folder(), "/xdg/viscera");
  const Variable no_xdg("XDG_CACHE_HOME", nullptr);
  EXPECT_EQ(ResponseCache::default_folder(), "/home/person/.cache/viscera");
}

TEST(CacheFile, ChecksNamesTypesAndSizes) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.h5";
  const std::vector<double> numbers = {1.0, 2.0, 3.0};
  CacheContents contents;
  contents.array("numbers", numbers);
  contents.text("recipe", "liver, seed 1");
  contents.text("nothing", "");
  ASSERT_TRUE(write_cache_file(file, 4, kKey, contents));

  auto data = read_cache_file(file, 4, kKey);
  ASSERT_TRUE(data) << data.error().text();
  EXPECT_EQ(data->text("recipe").value(), "liver, seed 1");
  EXPECT_EQ(data->text("nothing").value(), "");
  EXPECT_FALSE(data->text("colour"));
  EXPECT_EQ(data->take<double>("count").error().text(), "the array count is missing");
  EXPECT_EQ(data->take<float>("numbers").error().text(),
            "the array numbers holds another type of number");
  EXPECT_EQ(data->take<double>("numbers").value(), numbers);
  EXPECT_EQ(read_cache_file(file, 5, kKey).error().text(), "its format is 4, expected 5");
}

TEST(CacheFile, RefusesATextThatHdf5CantHold) {
  const TemporaryFolder folder;
  CacheContents contents;
  contents.text("novel", std::string(70'000, 'x'));
  EXPECT_FALSE(write_cache_file(folder / "a.h5", 1, kKey, contents));
  EXPECT_EQ(entries(folder.path()), 0);
}

}  // namespace
}  // namespace viscera
