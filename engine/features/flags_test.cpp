// The flags of all features together.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "engine/features/features.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

TEST(Flags, HaveNamesOfTheirOwnAndAText) {
  std::set<std::string_view> names;
  for (const Feature& feature : all_features())
    for (const FrameFlag& flag : feature.flags) {
      EXPECT_TRUE(names.insert(flag.name).second) << flag.name << " is in two features";
      EXPECT_TRUE(std::regex_match(std::string(flag.name), std::regex("[a-z]+(_[a-z]+)*")))
          << flag.name;
      EXPECT_FALSE(flag.text.empty()) << flag.name;
    }
  EXPECT_FALSE(names.empty());
}

TEST(Flags, ThatAFeatureDeclaresItLists) {
  const std::vector<FrameFlag> listed = flags_of(all_features());
  std::size_t declared = 0;
  for (const auto& file :
       std::filesystem::recursive_directory_iterator(test::project_file("engine/features"))) {
    if (!file.path().filename().string().ends_with("_flags.h")) continue;
    std::ifstream in(file.path());
    std::stringstream text;
    text << in.rdbuf();
    const std::string all = text.str();
    const std::regex flag(R"(FrameFlag k\w+\{\s*"(\w+)\")");
    for (std::sregex_iterator at(all.begin(), all.end(), flag), end; at != end; ++at) {
      ++declared;
      const std::string name = (*at)[1];
      EXPECT_NE(std::ranges::find(listed, name, &FrameFlag::name), listed.end())
          << file.path() << ": " << name;
    }
  }
  EXPECT_EQ(declared + 1, listed.size())
      << "a flag is declared elsewhere: the sentinel's alone belongs to no feature";
}

}  // namespace
}  // namespace viscera
