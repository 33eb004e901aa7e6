#include "kernels/base/hash.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace viscera {
namespace {

// Cache files and reports carry these hashes: they must not change from version to version. The
// hash of nothing is the reference value of XXH3, 128 bits.
TEST(Hasher, HashesStayWhatTheyWere) {
  EXPECT_EQ(Hasher().hex(), "99aa06d3014798d86001c324468d497f");
  EXPECT_EQ(Hasher().text("viscera").hex(), "31a6dea0d585c08adf93de110d06542b");
  EXPECT_EQ(Hasher().value(1.5).value(std::int32_t{-7}).hex(), "b369f7fec5918d59602cc6466206ea02");
}

TEST(Hasher, OrderCounts) {
  EXPECT_NE(Hasher().value(1.0).value(2.0).hex(), Hasher().value(2.0).value(1.0).hex());
  const std::vector<int> up = {1, 2, 3}, down = {3, 2, 1};
  EXPECT_NE(Hasher().array(std::span(up)).hex(), Hasher().array(std::span(down)).hex());
}

TEST(Hasher, BordersOfTextsAndArraysCount) {
  EXPECT_NE(Hasher().text("ab").text("c").hex(), Hasher().text("a").text("bc").hex());
  EXPECT_NE(Hasher().text("").text("a").hex(), Hasher().text("a").text("").hex());
  const std::vector<int> all = {1, 2, 3};
  const std::span<const int> numbers(all);
  EXPECT_NE(Hasher().array(numbers.first(2)).array(numbers.last(1)).hex(),
            Hasher().array(numbers.first(1)).array(numbers.last(2)).hex());
}

TEST(Hasher, BytesInPiecesHashAsInOne) {
  EXPECT_EQ(Hasher().bytes("vis", 3).bytes("cera", 4).hex(), Hasher().bytes("viscera", 7).hex());
}

TEST(Hasher, EveryBitCounts) {
  std::set<std::string> seen;
  for (int bit = 0; bit < 64; ++bit) seen.insert(Hasher().value(std::uint64_t{1} << bit).hex());
  EXPECT_EQ(seen.size(), 64u);
  EXPECT_NE(Hasher().value(0.0).hex(), Hasher().value(-0.0).hex());
}

TEST(Hasher, AskingTwiceChangesNothing) {
  Hasher hasher;
  hasher.text("a");
  const std::string first = hasher.hex();
  EXPECT_EQ(hasher.hex(), first);
  EXPECT_EQ(first.size(), 32u);
}

TEST(Hasher, GoesOnFromItsSavedStateToTheSameHash) {
  for (const std::size_t before : {0u, 1u, 63u, 64u, 256u, 300u, 5000u})
    for (const std::size_t after : {0u, 1u, 40u, 2000u}) {
      const std::string text(before + after, 'v');
      Hasher first;
      first.bytes(text.data(), before);
      Hasher second;
      second.text("another life");
      ASSERT_TRUE(second.restore(first.save()));
      second.bytes(text.data() + before, after);
      EXPECT_EQ(second.hex(), Hasher().bytes(text.data(), text.size()).hex()) << before << after;
    }
}

TEST(Hasher, TakesNothingElseForASavedState) {
  Hasher hasher;
  hasher.text("viscera");
  const std::string before = hasher.hex();
  std::vector<std::byte> saved = Hasher().save();
  saved.pop_back();
  EXPECT_FALSE(hasher.restore(saved));
  saved.assign(saved.size() + 1, std::byte{0xff});
  EXPECT_FALSE(hasher.restore(saved));
  EXPECT_FALSE(hasher.restore({}));
  EXPECT_EQ(hasher.hex(), before);
}

}  // namespace
}  // namespace viscera
