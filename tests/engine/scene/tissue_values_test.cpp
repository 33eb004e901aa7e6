// docs/theory/values.md lists what of assets/tissues.json was recalled, as the file's marks say.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>

#include "engine/scene/json_file.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

constexpr const char* kBegin = "<!-- tissues -->\n";
constexpr const char* kEnd = "<!-- /tissues -->\n";

/// By mark and key: the tissues with their values.
using Rows = std::map<std::pair<std::string, std::string>, std::string>;

void collect(const Json& values, const std::string& key, const std::string& tissue, Rows& rows) {
  if (values.is_array()) {
    for (const Json& one : values) collect(one, key, tissue, rows);
    return;
  }
  if (!values.is_object()) return;
  if (values.contains("mark")) {
    if (values["mark"] == "V") return;
    const std::string unit =
        values["unit"] == "1" ? "" : fmt::format(" [{}]", values["unit"].get<std::string>());
    std::string& row = rows[{values["mark"], fmt::format("`{}`{}", key, unit)}];
    row += fmt::format("{}{} {}", row.empty() ? "" : ", ", tissue, values["value"].dump());
    return;
  }
  for (const auto& [name, value] : values.items())
    collect(value, key.empty() ? name : key + "." + name, tissue, rows);
}

std::string table_of(const std::string& mark) {
  Rows rows;
  const Result<Json> file = read_json(project_file("assets/tissues.json"));
  if (!file) return file.error().text();
  for (const auto& [tissue, values] : (*file)["tissues"].items()) {
    std::string name = tissue;
    std::replace(name.begin(), name.end(), '_', ' ');
    collect(values, "", name, rows);
  }
  std::string table = "| value | of |\n| --- | --- |\n";
  for (const auto& [key, row] : rows)
    if (key.first == mark) table += fmt::format("| {} | {} |\n", key.second, row);
  return table;
}

std::string tables() {
  return fmt::format("Recalled or assumed (R):\n\n{}\nRead in an abstract (A):\n\n{}",
                     table_of("R"), table_of("A"));
}

TEST(TissueValues, TheDocumentListsAllThatNobodyHasVerified) {
  const std::filesystem::path file = project_file("docs/theory/values.md");
  const std::string text = file_text(file);
  const std::size_t begin = text.find(kBegin), end = text.find(kEnd);
  ASSERT_NE(begin, std::string::npos);
  ASSERT_NE(end, std::string::npos);
  const std::size_t from = begin + std::string(kBegin).size();
  if (std::getenv("VISCERA_UPDATE_SCHEMA") != nullptr) {
    std::ofstream(file) << text.substr(0, from) << tables() << text.substr(end);
    return;
  }
  EXPECT_EQ(text.substr(from, end - from), tables())
      << "run this test with VISCERA_UPDATE_SCHEMA=1";
}

}  // namespace
}  // namespace viscera::test
