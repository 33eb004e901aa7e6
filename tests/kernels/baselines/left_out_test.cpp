// In place of the tests of the strong forms, in a build without them.
#include <gtest/gtest.h>

#include "tests/support/baselines.h"

namespace viscera {
namespace {

TEST(StrongForm, IsTestedWhereItIsBuiltIn) {
  ASSERT_FALSE(test::strong_forms_built_in());
  GTEST_SKIP() << test::kNoStrongForms;
}

}  // namespace
}  // namespace viscera
