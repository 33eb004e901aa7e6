// The reference for people says of every key what the table of keys says.
#include "engine/scene/scene_reference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "engine/features/features.h"
#include "engine/scene/scene_keys.h"

namespace viscera::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// The lines between the heading of `path` and the next heading.
std::vector<std::string> section_of(const std::string& text, const std::string& path) {
  std::vector<std::string> lines;
  std::istringstream all(text);
  bool inside = false;
  for (std::string line; std::getline(all, line);) {
    if (line.starts_with("#")) inside = line.ends_with(" `" + path + "`");
    if (inside) lines.push_back(line);
  }
  return lines;
}

std::string row_of(const std::vector<std::string>& section, const std::string& key) {
  for (const std::string& line : section)
    if (line.starts_with("| `" + key + "` | ")) return line;
  return "";
}

/// A feature that adds this to organs.
FeatureKeys of_organs(KeySpec key) {
  FeatureKeys feature;
  feature.organ.keys = {std::move(key)};
  return feature;
}

TEST(SceneReference, EveryObjectHasASectionWithARowForEachOfItsKeys) {
  const std::string text = scene_reference(feature_keys());
  int keys = 0;
  const std::function<void(const ObjectSpec&, const std::string&)> visit =
      [&](const ObjectSpec& spec, const std::string& path) {
        const std::vector<std::string> section = section_of(text, path);
        EXPECT_FALSE(section.empty()) << path;
        for (const KeySpec& key : spec.keys) {
          ++keys;
          EXPECT_THAT(row_of(section, key.name), HasSubstr(expected_value(key)))
              << path << "/" << key.name;
          std::string below = path + "/" + key.name;
          if (key.type == KeyType::kList) below += key.unique == "name" ? "/NAME" : "/N";
          if (key.type == KeyType::kMap) below += "/NAME";
          if (key.object) visit(*key.object, below);
        }
      };
  const ObjectSpec scene = scene_keys(feature_keys());
  for (const KeySpec& key : scene.keys) {
    if (!key.object) continue;
    const std::string suffix = key.type != KeyType::kList ? ""
                               : key.unique == "name"     ? "/NAME"
                                                          : "/N";
    visit(*key.object, key.name + suffix);
  }
  EXPECT_GT(keys, 60);
}

TEST(SceneReference, TellsWhatIsNeededWhatIsOptionalAndWhere) {
  const std::string text = scene_reference(feature_keys());
  const std::vector<std::string> organ = section_of(text, "organs/NAME");
  EXPECT_THAT(row_of(organ, "tissue"), HasSubstr("| needed |"));
  EXPECT_THAT(row_of(organ, "formulation"), HasSubstr("| `\"galerkin\"` |"));
  EXPECT_THAT(row_of(organ, "resolution"), HasSubstr("| the defaults of its keys |"));
  EXPECT_THAT(row_of(organ, "youngs_modulus_kPa"), HasSubstr("| none |"));
  const std::vector<std::string> geometry = section_of(text, "organs/NAME/geometry");
  EXPECT_THAT(row_of(geometry, "radius_mm"),
              HasSubstr("Only where recipe is \"sphere\" or \"hemisphere\"."));
  EXPECT_THAT(row_of(geometry, "radius_mm"), HasSubstr("| needed there |"));
  EXPECT_THAT(text, HasSubstr("Exactly one of `recipe` and `file`."));
}

TEST(SceneReference, KeysOfAFeatureStandInTheTableOfWhatTheyBelongTo) {
  const ObjectSpec beat{"A beat.", {number("strain", "At its greatest.").between(0, 0.2)}, {}, {}};
  const std::string without = scene_reference({});
  EXPECT_TRUE(section_of(without, "organs/NAME/beats").empty());
  EXPECT_THAT(without, Not(HasSubstr("How it beats.")));
  const std::string with = scene_reference({of_organs(object("beats", "How it beats.", beat))});
  EXPECT_THAT(row_of(section_of(with, "organs/NAME"), "beats"), HasSubstr("How it beats."));
  EXPECT_THAT(row_of(section_of(with, "organs/NAME/beats"), "strain"),
              HasSubstr("a number from 0 to 0.2"));
}

TEST(SceneReference, LinksLeadToSectionsThatAreThere) {
  const std::string text = scene_reference(feature_keys());
  int links = 0;
  for (std::size_t at = text.find("](#"); at != std::string::npos; at = text.find("](#", at + 1)) {
    const std::string name = text.substr(at + 3, text.find(')', at) - at - 3);
    EXPECT_THAT(text, HasSubstr("<a id=\"" + name + "\"></a>"));
    ++links;
  }
  EXPECT_GT(links, 10);
}

TEST(SceneReference, WordsWithABarStayInTheirCell) {
  const std::string text = scene_reference({of_organs(boolean("odd", "One | the other."))});
  EXPECT_THAT(row_of(section_of(text, "organs/NAME"), "odd"), HasSubstr("One \\| the other."));
}

}  // namespace
}  // namespace viscera::test
