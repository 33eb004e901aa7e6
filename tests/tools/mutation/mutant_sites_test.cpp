// Where mutants may be planted, and what a planted source says.
#include "tools/mutation/mutant_sites.h"

#include <gtest/gtest.h>

#include <set>

namespace viscera {
namespace {

std::vector<std::string> tokens_of(const std::string& source) {
  std::vector<std::string> tokens;
  for (const MutantSite& site : mutant_sites(source)) tokens.push_back(site.token);
  return tokens;
}

using Tokens = std::vector<std::string>;

TEST(MutantSites, AreOperatorsOfTwoSidesDecimalsAndExtremes) {
  EXPECT_EQ(tokens_of("x = a + b * c - d / e;"), (Tokens{"+", "*", "-", "/"}));
  EXPECT_EQ(tokens_of("if (a < b && c >= d || e != f) x += 1;"), (Tokens{"<", ">=", "!=", "+="}));
  EXPECT_EQ(tokens_of("y = std::max(0.0, std::min(1e-3, 2.5f));"),
            (Tokens{"std::max", "0.0", "std::min", "1e-3", "2.5f"}));
}

TEST(MutantSites, ArentSignsTemplatesPointersOrWholeNumbers) {
  EXPECT_EQ(tokens_of("const float* p = -x; std::vector<int> v(3); v[i++] = 0x1.0p-53;"), Tokens{});
}

TEST(MutantSites, ArentInCommentsStringsOrThePreprocessor) {
  EXPECT_EQ(tokens_of("// a + b\n/* 1.0\n 2.0 */ f(\"a - b 0.5\", ' '); R\"(1.5 + 2)\";\n"
                      "#define X 0.5 + 1\ny = \"\\\"\" + z;"),
            Tokens{"+"});
}

TEST(MutantSites, KnowTheirLine) {
  const auto sites = mutant_sites("a;\n// b\nx = c + d;\n");
  ASSERT_EQ(sites.size(), 1u);
  EXPECT_EQ(sites[0].line, 3);
  EXPECT_EQ(sites[0].kind, MutantKind::kSign);
}

const std::vector<std::string> kSources = {"a = b + c;\nd = e * f - 1.5;\n",
                                           "x = y < z;\nw -= 2.0;\n"};

TEST(PickedMutants, AreTheSameForASeedAndAtMostOneALine) {
  const auto first = pick_mutants(kSources, 3, 100), again = pick_mutants(kSources, 3, 100);
  ASSERT_EQ(first.size(), 4u);
  std::set<std::pair<std::size_t, int>> lines;
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].number, static_cast<int>(i));
    EXPECT_EQ(first[i].site.begin, again[i].site.begin);
    EXPECT_TRUE(lines.emplace(first[i].file, first[i].site.line).second);
  }
  const auto fewer = pick_mutants(kSources, 3, 2);
  ASSERT_EQ(fewer.size(), 2u);
  for (std::size_t i = 0; i < fewer.size(); ++i) {
    EXPECT_EQ(fewer[i].file, first[i].file);
    EXPECT_EQ(fewer[i].site.begin, first[i].site.begin);
  }
}

std::string planted(const std::string& source) {
  std::string text = plant_mutants(source, pick_mutants({source}, 1, 100));
  return text.substr(text.find("#line 1\n") + 8);
}

TEST(PlantedMutants, ReplaceTheirTokenAlone) {
  EXPECT_EQ(planted("a = b + c;"), "a = b + viscera_mutant::sign(0) * c;");
  EXPECT_EQ(planted("a = b / c;"), "a = b * viscera_mutant::factor(0) / c;");
  EXPECT_EQ(planted("a = 0.5;"), "a = viscera_mutant::number(0, 0.5);");
  EXPECT_EQ(planted("a = std::min(b, c);"), "a = viscera_mutant::least(0)(b, c);");
  EXPECT_EQ(planted("a = b <= c;"),
            "a = b <viscera_mutant::compare<viscera_mutant::Relation::kLessEqual>(0)> c;");
}

TEST(PlantedMutants, ConstantsOfTheCompilerBecomeConstantsOfTheProgram) {
  EXPECT_EQ(planted("constexpr double kA = 0.5;\nconstexpr int kB = 2;\n"),
            "const double kA = viscera_mutant::number(0, 0.5);\nconstexpr int kB = 2;\n");
}

}  // namespace
}  // namespace viscera
