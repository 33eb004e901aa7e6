#include "kernels/formulations/formulations.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/baselines.h"

namespace viscera {
namespace {

TEST(Formulations, AreFoundByTheirNames) {
  const std::vector<std::string> names = formulation_names();
  for (const std::string& name : names) {
    ASSERT_NE(find_formulation(name), nullptr) << name;
    EXPECT_EQ(find_formulation(name)->name(), name);
  }
  for (const char* own : {"galerkin", "galerkin_quadratic"})
    EXPECT_EQ(std::count(names.begin(), names.end(), own), 1) << own;
}

TEST(Formulations, PublishedOnesAreEitherThereOrLeftOut) {
  const std::vector<std::string> left_out = left_out_formulations();
  for (const char* published : {"gfdm", "paper"}) {
    EXPECT_EQ(find_formulation(published) != nullptr, test::strong_forms_built_in()) << published;
    EXPECT_EQ(std::count(left_out.begin(), left_out.end(), published) == 0,
              test::strong_forms_built_in());
  }
}

TEST(Formulations, OfAnUnknownNameTheKnownOnesAreListed) {
  const std::string text = unknown_formulation("springs");
  EXPECT_TRUE(text.starts_with("found \"springs\", expected one of galerkin, galerkin_quadratic"))
      << text;
  EXPECT_EQ(text.find("MUMPS"), std::string::npos) << text;
}

TEST(Formulations, OneThatIsLeftOutSaysWhatWasExpected) {
  EXPECT_NE(why_left_out("gfdm").find("VISCERA_BASELINES=ON"), std::string::npos);
  if (test::strong_forms_built_in()) return;
  const std::string text = unknown_formulation("gfdm");
  EXPECT_NE(text.find("found \"gfdm\""), std::string::npos) << text;
  EXPECT_NE(text.find(why_left_out("gfdm")), std::string::npos) << text;
}

}  // namespace
}  // namespace viscera
