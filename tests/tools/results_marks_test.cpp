// docs/results.md marks what was not reached, and nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/paths.h"

namespace viscera::test {
namespace {

std::string without_stars(const std::string& cell) {
  std::string plain = cell;
  std::erase(plain, '*');
  return plain;
}

struct Quantity {
  double value = 0.0;  ///< [s, B or %]
  char kind = 's';     ///< time, bytes or percent
};

/// "0.8 to 1.2 s" is 1.2 s; nothing where a cell doesn't begin with a figure and its unit.
std::optional<Quantity> quantity(const std::string& cell) {
  static const std::map<std::string, Quantity> kUnits = {{"s", {1.0, 's'}},   {"ms", {1e-3, 's'}},
                                                         {"µs", {1e-6, 's'}}, {"MB", {1e6, 'B'}},
                                                         {"GB", {1e9, 'B'}},  {"%", {1.0, '%'}}};
  static const std::regex kForm(
      R"((\d[\d.]*)(?: (?:to|and) (\d[\d.]*))? (s|ms|µs|GB|MB|%)(?!\w).*)");
  std::smatch parts;
  const std::string plain = without_stars(cell);
  if (!std::regex_match(plain, parts, kForm)) return std::nullopt;
  Quantity found = kUnits.at(parts[3]);
  const double first = std::stod(parts[1]);
  found.value *= parts[2].matched ? std::max(first, std::stod(parts[2])) : first;
  return found;
}

std::vector<std::string> cells_of(const std::string& row) {
  std::vector<std::string> cells;
  std::istringstream parts(row.substr(1));
  for (std::string cell; std::getline(parts, cell, '|');) {
    const auto begin = cell.find_first_not_of(' ');
    cells.push_back(begin == std::string::npos
                        ? ""
                        : cell.substr(begin, cell.find_last_not_of(' ') - begin + 1));
  }
  return cells;
}

/// Rows whose figures are stated plainly; those "x real time" or "hidden" are for people to judge.
std::size_t check_marks(const std::string& text, std::vector<std::string>& wrong) {
  std::size_t compared = 0;
  std::vector<std::string> headings;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with('|')) {
      headings.clear();
      continue;
    }
    const auto cells = cells_of(line);
    if (headings.empty()) {
      headings = cells;
      continue;
    }
    if (headings.back() != "to reach" || cells.size() != headings.size()) continue;
    const auto target = quantity(cells.back());
    for (std::size_t c = 1; target && c + 1 < cells.size(); ++c) {
      const auto measured = quantity(cells[c]);
      if (!measured || measured->kind != target->kind) continue;
      ++compared;
      const bool marked = cells[c].find("**") != std::string::npos;
      if ((measured->value > target->value) != marked) wrong.push_back(cells[0] + ": " + cells[c]);
    }
  }
  return compared;
}

TEST(Results, AreBoldWhereTheyMissTheirFigureAndNowhereElse) {
  std::vector<std::string> wrong;
  EXPECT_GT(check_marks(file_text(project_file("docs/results.md")), wrong), 30u);
  for (const std::string& one : wrong) ADD_FAILURE() << one;
}

TEST(Results, AMarkThatIsMissingOrTooManyIsFound) {
  std::vector<std::string> wrong;
  EXPECT_EQ(
      check_marks("| | measured | to reach |\n| --- | --- | --- |\n| a | 0.8 to 1.2 s | 1 s |\n"
                  "| b | **3 GB** | 4 GB |\n| c | **220 µs** | 0.04 ms |\n| d | 2 % | 3 % |\n",
                  wrong),
      4u);
  EXPECT_EQ(wrong, (std::vector<std::string>{"a: 0.8 to 1.2 s", "b: **3 GB**"}));
}

}  // namespace
}  // namespace viscera::test
