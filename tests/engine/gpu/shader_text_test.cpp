#include "engine/gpu/shader_text.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "engine/gpu/egl_context.h"

namespace viscera {
namespace {

const std::vector<ShaderFile> kFiles = {
    {"a.comp", "// A.\n#include \"some/folder/b.glsl\"\n#include \"c.h\"\nvoid main() {}\n"},
    {"b.glsl", "#include \"c.h\"\nfloat twice(float x) { return 2.0 * x; }\n"},
    {"c.h",
     "#pragma once\n#include <array>\n#include \"elsewhere.h\"\n#include \"d.h\"\n"
     "struct C {\n  float c = 0.0f;\n};\n"},
    {"d.h", "#include \"c.h\"\ninline constexpr int kD = 1;\n"},
    {"lost.comp", "#include \"nowhere.glsl\"\nvoid main() {}\n"},
    {"wrong.comp", "#include \"wrong.h\"\nvoid main() {}\n"},
    {"wrong.h", "\nint count();\n"},
    {"broken.comp",
     "#include \"c.h\"\nlayout(local_size_x = 1) in;\n"
     "void main() { C c; c.d = 1.0; }\n"},
    {"taken.comp",
     "struct C { float own; };\n#include \"c.h\"\nlayout(local_size_x = 1) in;\n"
     "void main() {}\n"},
};

ShaderText text_of(const std::vector<ShaderFile>& files) {
  return ShaderText(files, "kernel", "CMakeLists.txt");
}

TEST(ShaderText, EachFileComesOnceAndAfterWhatItIncludes) {
  ShaderText text = text_of(kFiles);
  ASSERT_TRUE(text.add("a.comp"));
  ASSERT_TRUE(text.add("b.glsl"));
  const std::vector<ShaderFile> files = text.take();
  ASSERT_EQ(files.size(), 4u);
  EXPECT_EQ(files[0].name, "d.h");
  EXPECT_EQ(files[0].text, "\nconst int kD = 1;\n");
  EXPECT_EQ(files[1].name, "c.h");
  EXPECT_EQ(files[1].text, "\n\n\n\nstruct C {\n  float c ;\n};\n");
  EXPECT_EQ(files[2].name, "b.glsl");
  EXPECT_EQ(files[2].text, "\nfloat twice(float x) { return 2.0 * x; }\n");
  EXPECT_EQ(files[3].name, "a.comp");
  EXPECT_EQ(files[3].text, "// A.\n\n\nvoid main() {}\n");
}

TEST(ShaderText, IncludeThatIsntInTheProgramIsNamed) {
  const Result<void> added = text_of(kFiles).add("lost.comp");
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().text(),
            "kernel nowhere.glsl: not in the program; expected in CMakeLists.txt");
}

TEST(ShaderText, HeaderThatGlslCantReadIsRefused) {
  const Result<void> added = text_of(kFiles).add("wrong.comp");
  ASSERT_FALSE(added);
  EXPECT_TRUE(added.error().text().starts_with("wrong.h:2: found 'int', expected "))
      << added.error().text();
}

TEST(ShaderText, CompilersComplaintsNameTheLinesThatPeopleSee) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  const auto complaint_of = [](const char* name) {
    ShaderText text = text_of(kFiles);
    EXPECT_TRUE(text.add(name));
    const Result<Program> program = Program::create({{GL_COMPUTE_SHADER, text.take(), {}}});
    return program ? "" : program.error().text();
  };
  EXPECT_NE(complaint_of("broken.comp").find("broken.comp:3: "), std::string::npos)
      << complaint_of("broken.comp");
  // The header's struct comes first.
  EXPECT_NE(complaint_of("taken.comp").find("taken.comp:1: "), std::string::npos)
      << complaint_of("taken.comp");
}

}  // namespace
}  // namespace viscera
