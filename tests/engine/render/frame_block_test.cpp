// The renderer's block as the driver lays it out.
#include <gtest/gtest.h>

#include "engine/gpu/egl_context.h"
#include "engine/render/shader_layout.h"
#include "engine/render/shaders.h"
#include "tests/engine/gpu/block_layout.h"

namespace viscera {
namespace {

StructLayout frame_layout() {
  using Struct = FrameBlock;
#define MEMBER(name) VISCERA_MEMBER(Struct, name)
  return {sizeof(Struct),
          {MEMBER(view), MEMBER(projection), MEMBER(eye), MEMBER(light), MEMBER(lens),
           MEMBER(picture), MEMBER(shown)}};
#undef MEMBER
}

TEST(FrameBlock, LiesInEveryPassAsInCpp) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  for (const char* pass : {"develop.frag", "meter.frag", "show.frag", "small.frag"}) {
    SCOPED_TRACE(pass);
    const Result<Program> program = load_program("full_screen.vert", pass);
    ASSERT_TRUE(program) << program.error().text();
    std::vector<std::string> seen;
    EXPECT_EQ(compare_blocks(*program, {{"Frame", frame_layout()}}, &seen),
              std::vector<std::string>());
    EXPECT_EQ(seen, std::vector<std::string>{"Frame"});
  }
  for (const char* pass : {"smoke_light.comp", "smoke_march.comp"}) {
    SCOPED_TRACE(pass);
    const Result<Program> program = load_compute(pass, {"VOLUMES 1"}, {"smoke_medium.glsl"});
    ASSERT_TRUE(program) << program.error().text();
    EXPECT_EQ(compare_blocks(*program, {{"Frame", frame_layout()}}), std::vector<std::string>());
  }
}

}  // namespace
}  // namespace viscera
