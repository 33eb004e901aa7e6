#include "engine/simulation/frame_flag.h"

#include <gtest/gtest.h>

#include <string>

namespace viscera {
namespace {

constexpr FrameFlag kSparks{"sparks", "it sparked: less power"};
constexpr FrameFlag kHoles{"holes", "it leaks: mend it"};
constexpr FrameFlag kNoise{"noise", "it roars: wait"};

using Names = std::vector<std::string_view>;

TEST(FlagSet, HoldsEachFlagOnceHoweverOftenItIsRaised) {
  FlagSet flags;
  EXPECT_TRUE(flags.empty());
  flags.raise(kHoles);
  flags.raise(kHoles);
  EXPECT_EQ(flags.names(), Names{"holes"});
  EXPECT_TRUE(flags.has(kHoles));
  EXPECT_TRUE(flags.has("holes"));
  EXPECT_FALSE(flags.has(kSparks));
}

TEST(FlagSet, HasTheListsOrderAndUnknownOnesLast) {
  FlagSet flags;
  flags.raise(kNoise);
  flags.raise(kHoles);
  flags.raise(kSparks);
  flags.order(std::vector<FrameFlag>{kSparks, kHoles});
  EXPECT_EQ(flags.names(), (Names{"sparks", "holes", "noise"}));
}

TEST(FlagSet, OfTwoHasWhatEitherRaised) {
  FlagSet one, other;
  one.raise(kSparks);
  other.raise(kHoles);
  other.raise(kSparks);
  one.raise(other);
  EXPECT_EQ(one.names(), (Names{"sparks", "holes"}));
}

TEST(FlagSet, HasNoLimitOfTheirNumber) {
  std::vector<std::string> names;
  for (int i = 0; i < 100; ++i) names.push_back("flag_" + std::to_string(i));
  FlagSet flags;
  for (const std::string& name : names) flags.raise({name, "it happened"});
  EXPECT_EQ(flags.size(), 100u);
  EXPECT_TRUE(flags.has("flag_99"));
}

}  // namespace
}  // namespace viscera
