// What the code cites stands in REFERENCES.md, what stands there as a method is cited, and the
// documents are finished.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {
namespace fs = std::filesystem;
namespace {

/// A name in brackets: letters, then a year (or the number of a paper without one).
const std::regex kCitation(R"(\[([A-Z][A-Za-z]+[0-9]{4,})\])");

/// Cited names and the first file that cites each.
using Citations = std::map<std::string, std::string>;

void add_citations(const fs::path& file, Citations& found) {
  const std::string text = file_text(file);
  for (std::sregex_iterator at(text.begin(), text.end(), kCitation), end; at != end; ++at)
    found.try_emplace((*at)[1], file.string());
}

Citations cited_by_code() {
  Citations found;
  constexpr std::array kExtensions = {".h", ".cpp", ".frag", ".vert", ".comp", ".glsl"};
  for (const char* folder : {"kernels", "haptics", "engine", "tools", "tests"}) {
    for (const char* extension : kExtensions) {
      for (const fs::path& file : files_of(project_file(folder), extension))
        add_citations(file, found);
    }
  }
  for (const char* values : {"assets/smoke.json", "assets/tissues.json"})
    add_citations(project_file(values), found);
  return found;
}

/// All that the project tells people, but for the list of references.
std::vector<fs::path> documents() {
  std::vector<fs::path> files = files_of(project_file("docs"), ".md");
  for (const char* name : {"README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md",
                           "haptics/README.md", "kernels/baselines/README.md"})
    files.push_back(project_file(name));
  return files;
}

/// What the first group of the pattern finds in a text.
std::set<std::string> found_in(const std::string& text, const std::regex& pattern) {
  std::set<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), pattern), end; at != end; ++at)
    found.insert((*at)[1]);
  return found;
}

/// Names of the entries under each second-level heading.
std::map<std::string, std::set<std::string>> entries_by_heading() {
  static const std::regex entry(R"(- \*\*\[([^\]]+)\]\*\*.*)");
  std::map<std::string, std::set<std::string>> entries;
  std::istringstream lines(file_text(project_file("REFERENCES.md")));
  std::string heading;
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (line.starts_with("## ")) {
      heading = line.substr(3);
    } else if (std::regex_match(line, match, entry)) {
      EXPECT_TRUE(entries[heading].insert(match[1]).second) << match[1] << " stands there twice";
    }
  }
  return entries;
}

TEST(References, WhatIsCitedStandsThere) {
  std::set<std::string> all;
  for (const auto& [heading, names] : entries_by_heading()) all.insert(names.begin(), names.end());
  const Citations cited = cited_by_code();
  EXPECT_TRUE(cited.contains("De2006"));
  for (const auto& [name, file] : cited)
    EXPECT_TRUE(all.contains(name)) << "[" << name << "], cited in " << file;
}

TEST(References, MethodsAndTissueValuesThatStandThereAreCited) {
  const auto entries = entries_by_heading();
  const Citations cited = cited_by_code();
  for (const char* heading : {"Methods", "Tissue values"}) {
    ASSERT_TRUE(entries.contains(heading)) << heading;
    for (const std::string& name : entries.at(heading))
      EXPECT_TRUE(cited.contains(name)) << "[" << name << "] under " << heading;
  }
}

TEST(Documents, HoldNoPlaceholder) {
  const std::regex placeholder("@[A-Z]+@");
  std::vector<fs::path> all = documents();
  all.push_back(project_file("REFERENCES.md"));
  all.push_back(project_file("NOTICE"));
  for (const fs::path& document : all) {
    const std::string text = file_text(document);
    ASSERT_FALSE(text.empty()) << document;
    std::smatch match;
    EXPECT_FALSE(std::regex_search(text, match, placeholder)) << document << ": " << match.str();
  }
}

TEST(Documents, LinksAndPicturesLeadToFilesThatAreThere) {
  const std::regex target(R"(\]\(([^)#]+)[^)]*\))");
  std::size_t links = 0;
  for (const fs::path& document : documents()) {
    for (const std::string& link : found_in(file_text(document), target)) {
      if (link.starts_with("http")) continue;
      ++links;
      EXPECT_TRUE(fs::exists(document.parent_path() / link)) << document << " links to " << link;
    }
  }
  EXPECT_GT(links, 20u);
}

TEST(Documents, SourcesThatTheyNameAreThere) {
  const std::regex source(
      R"(((?:kernels|haptics|engine|tools|tests)/[a-z0-9_/]+\.(?:h|cpp|comp|txt|list|md)))");
  std::size_t sources = 0;
  for (const fs::path& document : documents()) {
    for (const std::string& name : found_in(file_text(document), source)) {
      if (name.find("example") != std::string::npos) continue;
      ++sources;
      EXPECT_TRUE(fs::exists(project_file(name))) << document << " names " << name;
    }
  }
  EXPECT_GT(sources, 20u);
}

}  // namespace
}  // namespace viscera::test
