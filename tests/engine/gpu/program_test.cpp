#include "engine/gpu/program.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "engine/gpu/egl_context.h"

namespace viscera {
namespace {

const ShaderFile kVertex = {"plain.vert", "void main() {\n  gl_Position = vec4(0.0);\n}\n"};
const ShaderFile kCommon = {"common.glsl", "float half_of(float x) {\n  return 0.5 * x;\n}\n"};

TEST(ProgramTest, BrokenShaderNamesFileLineAndSourceLine) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  const ShaderFile broken = {"broken.frag",
                             "out vec4 colour;\n\nvoid main() {\n"
                             "  colour = vec4(undeclared_thing);\n}\n"};
  const auto program = Program::create(
      {{GL_VERTEX_SHADER, {kVertex}, {}}, {GL_FRAGMENT_SHADER, {kCommon, broken}, {"SOME 1"}}});
  ASSERT_FALSE(program);
  const std::string text = program.error().text();
  EXPECT_NE(text.find("broken.frag:4: "), std::string::npos) << text;
  EXPECT_NE(text.find("colour = vec4(undeclared_thing);"), std::string::npos) << text;
}

TEST(ProgramTest, MistakesInIncludedFilesAndInSeveralShadersAreAllNamed) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  const ShaderFile bad_common = {"common.glsl", "\nfloat half_of(float x) { return nowhere; }\n"};
  const ShaderFile bad_vertex = {"bad.vert", "void main() { gl_Position = missing; }\n"};
  const ShaderFile good = {"good.frag", "out vec4 colour;\nvoid main() { colour = vec4(1.0); }\n"};
  const auto program = Program::create(
      {{GL_VERTEX_SHADER, {bad_vertex}, {}}, {GL_FRAGMENT_SHADER, {bad_common, good}, {}}});
  ASSERT_FALSE(program);
  const std::string text = program.error().text();
  EXPECT_NE(text.find("bad.vert:1: "), std::string::npos) << text;
  EXPECT_NE(text.find("common.glsl:2: "), std::string::npos) << text;
}

TEST(ProgramTest, StagesThatDontFitAreRefusedWithTheirNames) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  const ShaderFile wanting = {"wanting.frag",
                              "in vec3 never_written;\nout vec4 colour;\n"
                              "void main() { colour = vec4(never_written, 1.0); }\n"};
  const auto program =
      Program::create({{GL_VERTEX_SHADER, {kVertex}, {}}, {GL_FRAGMENT_SHADER, {wanting}, {}}});
  ASSERT_FALSE(program);
  EXPECT_NE(program.error().text().find("plain.vert + wanting.frag: not linked"), std::string::npos)
      << program.error().text();
}

TEST(ProgramTest, GoodShaderCompilesWithItsDefinitions) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  const ShaderFile good = {"good.frag",
                           "out vec4 colour;\nvoid main() { colour = vec4(half_of(LEVEL)); }\n"};
  const auto program = Program::create(
      {{GL_VERTEX_SHADER, {kVertex}, {}}, {GL_FRAGMENT_SHADER, {kCommon, good}, {"LEVEL 0.5"}}});
  EXPECT_TRUE(program) << program.error().text();
}

}  // namespace
}  // namespace viscera
