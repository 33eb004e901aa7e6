#include "engine/gpu/egl_context.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <thread>

#include "engine/gpu/buffer.h"
#include "engine/gpu/pass_timer.h"
#include "engine/gpu/texture.h"

namespace viscera {
namespace {

TEST(EglContextTest, ContextIsOpenGl45AndCounted) {
  const int before = egl_contexts_created();
  const auto context = EglContext::create();
  EXPECT_EQ(egl_contexts_created(), before + 1);
  if (!context) GTEST_SKIP() << context.error().text();
  EXPECT_FALSE((*context)->device().empty());
  GLint major = 0, minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  EXPECT_GE(10 * major + minor, 45);
}

TEST(EglContextTest, SecondContextOutlivesTheFirst) {
  auto first = EglContext::create();
  if (!first) GTEST_SKIP() << first.error().text();
  const auto second = EglContext::create();
  ASSERT_TRUE(second) << second.error().text();
  first->reset();
  (*second)->make_current();
  EXPECT_NE(glGetString(GL_RENDERER), nullptr);
}

TEST(EglContextTest, ALostContextStaysLostAndAnotherOneIsWell) {
  const auto first = EglContext::create();
  if (!first) GTEST_SKIP() << first.error().text();
  EXPECT_FALSE((*first)->lost());
  (*first)->declare_lost();
  EXPECT_TRUE((*first)->lost());
  const auto second = EglContext::create();
  ASSERT_TRUE(second) << second.error().text();
  EXPECT_FALSE((*second)->lost());
  EXPECT_TRUE((*first)->lost());
}

TEST(EglContextTest, FramebufferKeepsWhatWasDrawnAndTimerMeasuresIt) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  const Texture colour(GL_RGBA8, 4, 4);
  const Framebuffer target({&colour}, nullptr);
  ASSERT_TRUE(target.complete());
  PassTimer timer;
  timer.start();
  target.bind();
  const float value[4] = {1.0f, 0.0f, 0.2f, 1.0f};
  glClearBufferfv(GL_COLOR, 0, value);
  timer.mark("clear");
  std::array<unsigned char, 64> read{};
  glReadPixels(0, 0, 4, 4, GL_RGBA, GL_UNSIGNED_BYTE, read.data());
  EXPECT_EQ(read[0], 255);
  EXPECT_EQ(read[1], 0);
  EXPECT_EQ(read[2], 51);
  const std::vector<PassTime> passes = timer.finish();
  ASSERT_EQ(passes.size(), 1u);
  EXPECT_EQ(passes[0].name, "clear");
  EXPECT_GE(passes[0].seconds, 0.0);
  EXPECT_LT(passes[0].seconds, 10.0);
}

TEST(PassTimer, WhatTheProcessorDoesBetweenPassesIsNoPasss) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  constexpr double kOwnWork = 0.05;  // [s]
  PassTimer timer;
  timer.start();
  timer.mark("before");
  glFinish();
  std::this_thread::sleep_for(std::chrono::duration<double>(kOwnWork));
  timer.skip();
  glFinish();
  std::this_thread::sleep_for(std::chrono::duration<double>(kOwnWork));
  timer.mark("with its work");
  const std::vector<PassTime> passes = timer.finish();
  ASSERT_EQ(passes.size(), 2u);
  EXPECT_EQ(passes[0].name, "before");
  EXPECT_EQ(passes[1].name, "with its work");
  EXPECT_GE(passes[1].seconds, 0.9 * kOwnWork);
}

TEST(EglContextTest, BufferHoldsTheLastUploadAfterGrowingAndShrinking) {
  const auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().text();
  Buffer buffer;
  const std::array<float, 2> small = {1.0f, 2.0f};
  const std::array<float, 3> large = {3.0f, 4.0f, 5.0f};
  buffer.upload(std::span<const float>(small));
  buffer.upload(std::span<const float>(large));
  buffer.upload(std::span<const float>(small));
  EXPECT_EQ(buffer.size(), sizeof small);
  std::array<float, 2> read{};
  glGetNamedBufferSubData(buffer.id(), 0, sizeof read, read.data());
  EXPECT_EQ(read, small);
}

}  // namespace
}  // namespace viscera
