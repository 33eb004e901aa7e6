#include "engine/gpu/twin_header.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

/// What stands between the lines of a namespace, so that the first line is line 3.
std::string glsl_of(const std::string& body) {
  const Result<ShaderFile> made =
      glsl_of_header({"twin.h", "#pragma once\nnamespace viscera {\n" + body + "\n}\n"});
  if (!made) return made.error().text();
  const std::string head = "\n\n", foot = "\n\n";
  EXPECT_TRUE(made->text.starts_with(head) && made->text.ends_with(foot)) << made->text;
  return made->text.substr(head.size(), made->text.size() - head.size() - foot.size());
}

TEST(TwinHeader, MembersKeepTheirNamesAndLoseInitialValues) {
  EXPECT_EQ(glsl_of("/// A pass.\n"
                    "struct alignas(16) Pass {\n"
                    "  Float4 origin;  ///< [m]\n"
                    "  float a = 0.0f, b{1.0f};\n"
                    "  std::uint32_t count = 0;\n"
                    "  Other other;\n"
                    "};"),
            "/// A pass.\n"
            "struct  Pass {\n"
            "  vec4 origin;  ///< [m]\n"
            "  float a , b;\n"
            "  uint count ;\n"
            "  Other other;\n"
            "};");
}

TEST(TwinHeader, ArraysOfEitherKindBecomeGlslsOwn) {
  EXPECT_EQ(glsl_of("struct S {\n  std::array<Float4, 3> corners;\n  std::int32_t beside[6] = {};\n"
                    "  std::array<float, 6> border{};\n};"),
            "struct S {\n  vec4 corners[ 3];\n  int beside[6] ;\n  float border[ 6];\n};");
}

TEST(TwinHeader, EnumeratorsBecomeConstants) {
  EXPECT_EQ(glsl_of("enum class Kind : std::uint32_t { kFirst, kSecond, kTenth = 10, kNext };\n"
                    "struct S { Kind kind = Kind::kFirst; };"),
            " const uint kFirst = 0u; const uint kSecond = kFirst + 1u; "
            "const uint kTenth = uint(10); const uint kNext = kTenth + 1u; \n"
            "struct S { uint kind ; };");
  EXPECT_EQ(glsl_of("enum : std::uint32_t {\n  kLow = 1 << 0,\n  kBoth = kLow | 2\n};"),
            "\n  const uint kLow = uint(1 << 0);\n  const uint kBoth = uint(kLow | 2);\n");
}

TEST(TwinHeader, ConstantsKeepTheirPrecision) {
  EXPECT_EQ(glsl_of("inline constexpr float kThird = 1.0f / 3.0f;\n"
                    "inline constexpr double kLeast = 1e-8;\n"
                    "inline constexpr std::size_t kAll = 8 * (kEdge + 1);\n"
                    "constexpr int kFew = -2;"),
            "const float kThird = 1.0f / 3.0f;\n"
            "const double kLeast = 1e-8lf;\n"
            "const uint kAll = 8 * (kEdge + 1);\n"
            "const int kFew = -2;");
}

TEST(TwinHeader, WhatIsCppsOwnIsLeftOutAndLinesStay) {
  EXPECT_EQ(glsl_of("#include <array>\n"
                    "struct S {\n  float a;\n  bool operator==(const S&) const = default;\n"
                    "  static constexpr auto fields() {\n    return std::tuple{1};\n  }\n};\n"
                    "static_assert(sizeof(S) ==\n              4);\n"
                    "/* a\n comment */"),
            "\nstruct S {\n  float a;\n  \n  \n\n\n};\n\n\n/* a\n comment */");
}

TEST(TwinHeader, WhatGlslCantReadIsRefusedByFileAndLine) {
  EXPECT_EQ(glsl_of("struct S {\n  bool on;\n};"),
            "twin.h:4: found 'bool', expected a type that GLSL has too");
  EXPECT_EQ(glsl_of("struct S {\n  std::vector<float> all;\n};"),
            "twin.h:4: found 'std::vector', expected a type that GLSL has too");
  EXPECT_EQ(glsl_of("struct S {\n  std::size_t count;\n};"),
            "twin.h:4: found 'std::size_t', expected a type that GLSL has too");
  EXPECT_EQ(glsl_of("struct S {\n  float a;\n  float twice() const { return 2 * a; }\n};"),
            "twin.h:5: found '(', expected ';'");
  EXPECT_EQ(glsl_of("\nvoid run();"),
            "twin.h:4: found 'void', expected a struct, an enum, a constexpr or a static_assert");
  EXPECT_EQ(glsl_of("#ifdef NDEBUG\n#endif"),
            "twin.h:3: found '#ifdef NDEBUG', expected a struct, an enum, a constexpr or a "
            "static_assert");
  EXPECT_EQ(glsl_of("inline constexpr float kTiny = 0x1p-30f;"),
            "twin.h:3: found '0x1p-30f', expected a value as GLSL writes it");
  EXPECT_EQ(glsl_of("inline constexpr int kMany = 4'000'000;"),
            "twin.h:3: found '4'000'000', expected a value as GLSL writes it");
  EXPECT_EQ(glsl_of("inline constexpr int kOne = static_cast<int>(1.0);"),
            "twin.h:3: found 'static_cast', expected a value as GLSL writes it");
  EXPECT_EQ(glsl_of("inline constexpr int kNone = ;"), "twin.h:3: found ';', expected a value");
}

TEST(TwinHeader, HeaderThatEndsTooSoonIsRefused) {
  const Result<ShaderFile> made = glsl_of_header({"twin.h", "struct S {\n  float a;\n"});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().text(), "twin.h:3: found the end, expected '}'");
}

}  // namespace
}  // namespace viscera
