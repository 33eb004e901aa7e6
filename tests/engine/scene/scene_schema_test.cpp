// The published schema and the loader say the same: the text is compared, and then the schema is
// walked along a scene that has every key, and the loader asked about each thing that it states.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>

#include "engine/features/features.h"
#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

// Walks the schema along a valid scene and asks the loader about each statement.
class Walk {
 public:
  Walk() : whole_(whole_scene()), schema_(*parse_json(scene_schema(feature_keys()), "schema")) {}

  void run() { visit_object(schema_, Json::json_pointer()); }
  int questions() const { return questions_; }

 private:
  using Pointer = Json::json_pointer;

  bool accepted(const Json& scene) {
    ++questions_;
    return folder_.mistakes(scene).empty();
  }

  Json with(const Pointer& at, const Json& value) const {
    Json scene = whole_;
    scene[at] = value;
    return scene;
  }

  void visit_object(const Json& schema, const Pointer& at) {
    EXPECT_EQ(schema["additionalProperties"], false) << at.to_string();
    EXPECT_FALSE(accepted(with(at / "no_such_key", 1))) << at.to_string();
    const Json& here = whole_[at];
    for (const auto& [key, value] : here.items())
      EXPECT_TRUE(schema["properties"].contains(key)) << (at / key).to_string();
    for (const auto& [key, about] : schema["properties"].items()) {
      if (!here.contains(key)) continue;
      visit_value(about, at / key);
      Json without = whole_;
      without[at].erase(key);
      if (lists(schema, "required", key)) {
        EXPECT_FALSE(accepted(without)) << (at / key).to_string();
      }
      // The organ's `fixed` may be empty only for scenery, which the schema says by if and then.
      if (about.contains("default") && key != "fixed") {
        EXPECT_TRUE(takes(at / key, about["default"])) << (at / key).to_string();
      }
    }
  }

  static bool lists(const Json& schema, const char* keyword, const std::string& key) {
    if (!schema.contains(keyword)) return false;
    const Json& names = schema[keyword];
    return std::find(names.begin(), names.end(), key) != names.end();
  }

  void visit_value(const Json& about, const Pointer& at) {
    const std::string where = at.to_string();
    const std::string type = about["type"];
    EXPECT_FALSE(accepted(with(at, nullptr))) << where;
    EXPECT_FALSE(accepted(with(at, type == "string" ? Json(1) : Json("a text")))) << where;
    if (type == "number" || type == "integer") visit_number(about, at);
    if (type == "integer") {
      EXPECT_FALSE(accepted(with(at, 2.5))) << where;
    }
    if (about.contains("enum")) {
      for (const Json& choice : about["enum"]) EXPECT_TRUE(takes(at, choice)) << where << choice;
    }
    if (type == "array" && about["items"]["type"] == "number") {
      EXPECT_FALSE(accepted(with(at, {1, 2}))) << where;
      EXPECT_FALSE(accepted(with(at, {1, 2, 3, 4}))) << where;
      visit_number(about["items"], at / 0);
    }
    if (type == "array" && about["items"]["type"] == "object") {
      if (about.contains("minItems")) {
        EXPECT_FALSE(accepted(with(at, Json::array()))) << where;
      }
      for (std::size_t i = 0; i < whole_[at].size(); ++i) visit_object(about["items"], at / i);
    }
    if (type == "object") visit_object(about, at);
  }

  // Whether the value itself isn't refused: one that other keys depend on (shape, kind, deformable)
  // can't be put in alone, but then the mistakes lie in those other keys.
  bool takes(const Pointer& at, const Json& value) {
    ++questions_;
    const std::string path = at.to_string().substr(1);
    for (const std::string& mistake : folder_.mistakes(with(at, value)))
      if (mistake.starts_with(path + ": ")) return false;
    return true;
  }

  bool refused_at(const Pointer& at, double value) {
    ++questions_;
    std::string path = at.to_string().substr(1);
    const std::vector<std::string> mistakes = folder_.mistakes(with(at, value));
    return std::any_of(mistakes.begin(), mistakes.end(), [&path](const std::string& mistake) {
      return path.starts_with(mistake.substr(0, mistake.find(": "))) &&
             mistake.find(" from ") != std::string::npos;
    });
  }

  void visit_number(const Json& about, const Pointer& at) {
    const std::string where = at.to_string();
    if (about.contains("enum") || about.contains("const")) return;
    const double step = about["type"] == "integer" ? 1.0 : 1e-9;
    const auto beyond = [step](double x) { return std::max(step, std::abs(x) * 1e-9); };
    EXPECT_TRUE(about.contains("minimum")) << where;
    EXPECT_TRUE(about.contains("maximum") || about.contains("exclusiveMaximum")) << where;
    const double least = about["minimum"];
    EXPECT_FALSE(refused_at(at, least)) << where;
    EXPECT_TRUE(refused_at(at, least - beyond(least))) << where;
    const bool open = about.contains("exclusiveMaximum");
    const double greatest = open ? about["exclusiveMaximum"] : about["maximum"];
    EXPECT_EQ(refused_at(at, greatest), open) << where;
    EXPECT_TRUE(refused_at(at, greatest + beyond(greatest))) << where;
  }

  SceneFolder folder_;
  Json whole_, schema_;
  int questions_ = 0;
};

TEST(SceneSchema, TheLoaderAgreesWithEachOfItsStatements) {
  Walk walk;
  walk.run();
  EXPECT_GT(walk.questions(), 500);
}

// How many of the schema's properties the whole scene has, anywhere.
void collect(const Json& schema, const Json& value, std::set<std::string>& missing,
             std::set<std::string>& present, const std::string& path) {
  for (const auto& [key, about] : schema["properties"].items()) {
    const std::string here = path + "/" + key;
    if (!value.contains(key)) {
      missing.insert(here);
      continue;
    }
    present.insert(here);
    if (about["type"] == "object") collect(about, value[key], missing, present, here);
    if (about["type"] == "array" && about["items"]["type"] == "object")
      for (const Json& item : value[key]) collect(about["items"], item, missing, present, here);
  }
}

TEST(SceneSchema, TheWalkMeetsEveryKey) {
  std::set<std::string> missing, present;
  collect(*parse_json(scene_schema(feature_keys()), "schema"), whole_scene(), missing, present, "");
  for (const std::string& key : missing) EXPECT_TRUE(present.contains(key)) << key;
}

TEST(SceneSchema, EveryKeyIsDescribed) {
  const std::function<void(const Json&)> visit = [&visit](const Json& schema) {
    for (const auto& [key, about] : schema["properties"].items()) {
      EXPECT_FALSE(about["description"].get<std::string>().empty()) << key;
      if (about["type"] == "object") visit(about);
      if (about["type"] == "array" && about["items"]["type"] == "object") visit(about["items"]);
    }
  };
  visit(*parse_json(scene_schema(feature_keys()), "schema"));
}

}  // namespace
}  // namespace viscera::test
