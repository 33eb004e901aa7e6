#include "engine/scene/json_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/paths.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

std::string refusal(const std::string& text) {
  const Result<Json> parsed = parse_json(text, "a.json");
  return parsed ? "accepted" : parsed.error().text();
}

std::string refusal_of_file(const fs::path& file) {
  const Result<Json> read = read_json(file);
  return read ? "accepted" : read.error().text();
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(JsonFile, CommentsAreRead) {
  const Result<Json> parsed = parse_json("// one\n{/* two */ \"a\": [1, 2]}\n", "a.json");
  ASSERT_TRUE(parsed) << parsed.error().text();
  EXPECT_EQ(parsed->dump(), R"({"a":[1,2]})");
}

TEST(JsonFile, NestedValuesKeepTheirPlaces) {
  const std::string text = R"({"b":{"z":[{"k":null},[true,-1,2.5]],"a":"x"},"a":{}})";
  EXPECT_EQ(parse_json(text, "a.json")->dump(), text);
}

TEST(JsonFile, SyntaxErrorsCarryLineAndColumn) {
  EXPECT_EQ(refusal("{\n  \"a\": 1,\n  \"b\" 2\n}"), "a.json:3:7: found \"2\", expected ':'");
  EXPECT_TRUE(has(refusal("{\"a\": treu}"), "a.json:1:")) << refusal("{\"a\": treu}");
  EXPECT_TRUE(has(refusal("{\"a\": treu}"), "found \"treu\", expected valid JSON"));
  EXPECT_TRUE(has(refusal("{} {}"), "expected end of input")) << refusal("{} {}");
}

TEST(JsonFile, NumbersThatAreNotFiniteAreRefused) {
  for (const std::string word : {"NaN", "nan", "Infinity", "-Infinity", "1e999", "-1e999"}) {
    const std::string text = refusal("{\n\"a\": " + word + "}");
    EXPECT_TRUE(has(text, "a.json:2:")) << text;
    EXPECT_TRUE(has(text, "found \"" + word + "\", expected a finite number")) << text;
  }
}

TEST(JsonFile, TruncatedTextIsRefused) {
  const std::string whole = R"({"a": [1, {"b": "text"}], "c": true})";
  for (std::size_t length = 1; length < whole.size(); ++length) {
    const std::string text = refusal(whole.substr(0, length));
    EXPECT_TRUE(has(text, "a.json:1:")) << length << ": " << text;
  }
  EXPECT_TRUE(has(refusal("{\"a\": [1, 2"), "found the end of the file, expected more"));
}

TEST(JsonFile, BinaryDataIsRefused) {
  EXPECT_EQ(refusal(std::string("\x7f"
                                "ELF\x02\0\0\0",
                                8)),
            "a.json: found binary data, expected JSON text");
  EXPECT_TRUE(has(refusal("\x89PNG\r\n\x1a\n"), "a.json:1:1: found"));
  EXPECT_TRUE(has(refusal("{\"a\": \"\xff\xfe\"}"), "a.json:1:")) << "invalid UTF-8";
}

TEST(JsonFile, AKeyThatStandsTwiceIsRefused) {
  EXPECT_EQ(refusal(R"({"a": [{"b": 1}, {"b": 1, "b": 2}]})"),
            "a.json: a/1/b: found the key twice, expected it once");
}

TEST(JsonFile, DeepNestingAndCrowdedObjectsAreRefused) {
  EXPECT_TRUE(has(refusal(std::string(1000000, '[')), "found nesting deeper than 64"));
  std::string crowded = "{";
  for (int i = 0; i <= 1000; ++i) crowded += "\"k" + std::to_string(i) + "\": 1,";
  EXPECT_TRUE(has(refusal(crowded + "\"z\": 1}"), "found more than 1000 keys in one object"));
}

TEST(JsonFile, AMissingFileNamesItsNearestNeighbour) {
  const TemporaryFolder folder;
  std::ofstream(folder / "kidney.json") << "{}";
  const std::string text = refusal_of_file(folder / "kidny.json");
  EXPECT_TRUE(has(text, "kidny.json: found no such file, expected a JSON file")) << text;
  EXPECT_TRUE(has(text, "(did you mean \"kidney.json\"?)")) << text;
}

TEST(JsonFile, FoldersAndEmptyFilesAreRefused) {
  const TemporaryFolder folder;
  EXPECT_TRUE(has(refusal_of_file(folder.path()), ": found a folder, expected a JSON file"));
  std::ofstream(folder / "empty.json") << "";
  EXPECT_TRUE(has(refusal_of_file(folder / "empty.json"), ": found an empty file"));
  std::ofstream(folder / "blank.json") << " \n\n ";
  EXPECT_TRUE(has(refusal_of_file(folder / "blank.json"), ": found an empty file"));
  EXPECT_TRUE(has(refusal_of_file("/dev/zero"), "something other than a regular file"));
}

TEST(JsonFile, AnEnormousFileIsRefusedBeforeItIsRead) {
  const TemporaryFolder folder;
  std::ofstream(folder / "big.json") << "{}";
  fs::resize_file(folder / "big.json",
                  std::uintmax_t{1} << 40);  // sparse: reading would take hours
  EXPECT_TRUE(has(refusal_of_file(folder / "big.json"),
                  "found 1099511627776 bytes, expected at most 16777216"));
}

}  // namespace
}  // namespace viscera::test
