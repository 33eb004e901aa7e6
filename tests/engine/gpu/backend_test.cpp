#include "engine/gpu/backend.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

TEST(Backend, NamesAreReadBackAndOthersAreNone) {
  for (const Backend backend : {Backend::kAuto, Backend::kCpu, Backend::kGpu})
    EXPECT_EQ(backend_of(name_of(backend)), backend);
  EXPECT_EQ(backend_of("cpu"), Backend::kCpu);
  for (const char* other : {"", "GPU", "cuda", "auto "})
    EXPECT_EQ(backend_of(other), std::nullopt) << other;
}

TEST(Backend, AutoTakesTheGpuOnlyWhereTheDriverIsHardware) {
  const auto hardware = decide_backend(Backend::kAuto, Driver::kHardware, "Some GPU");
  ASSERT_TRUE(hardware);
  EXPECT_EQ(hardware->backend, Backend::kGpu);
  EXPECT_NE(hardware->reason.find("Some GPU"), std::string::npos);
  const auto software = decide_backend(Backend::kAuto, Driver::kSoftware, "llvmpipe");
  ASSERT_TRUE(software);
  EXPECT_EQ(software->backend, Backend::kCpu);
  EXPECT_EQ(software->reason, "auto: llvmpipe is a software driver");
  const auto none = decide_backend(Backend::kAuto, Driver::kNone, "no EGL");
  ASSERT_TRUE(none);
  EXPECT_EQ(none->backend, Backend::kCpu);
  for (const auto& decision : {hardware, software, none}) EXPECT_EQ(decision->warning, "");
}

TEST(Backend, TheCpuIsTakenWhateverTheDriver) {
  for (const Driver driver : {Driver::kNone, Driver::kSoftware, Driver::kHardware}) {
    const auto decision = decide_backend(Backend::kCpu, driver, "device");
    ASSERT_TRUE(decision);
    EXPECT_EQ(decision->backend, Backend::kCpu);
    EXPECT_EQ(decision->warning, "");
  }
}

TEST(Backend, TheGpuIsTakenWithAWarningWhereItIsSoftwareAndRefusedWithoutADriver) {
  const auto hardware = decide_backend(Backend::kGpu, Driver::kHardware, "Some GPU");
  ASSERT_TRUE(hardware);
  EXPECT_EQ(hardware->backend, Backend::kGpu);
  EXPECT_EQ(hardware->warning, "");
  const auto software = decide_backend(Backend::kGpu, Driver::kSoftware, "llvmpipe");
  ASSERT_TRUE(software);
  EXPECT_EQ(software->backend, Backend::kGpu);
  EXPECT_NE(software->warning.find("llvmpipe is a software driver"), std::string::npos);
  const auto none = decide_backend(Backend::kGpu, Driver::kNone, "no EGL device");
  ASSERT_FALSE(none);
  for (const char* part : {"--backend gpu", "found", "expected", "OpenGL 4.5", "no EGL device"})
    EXPECT_NE(none.error().text().find(part), std::string::npos) << none.error().text();
}

TEST(ComputeDevice, ARunOnTheCpuMakesNoContext) {
  const int before = egl_contexts_created();
  for (const bool pictures : {false, true}) {
    const auto device = open_compute_device(Backend::kCpu, pictures);
    ASSERT_TRUE(device);
    EXPECT_EQ(device->context, nullptr);
  }
  EXPECT_EQ(egl_contexts_created(), before);
}

TEST(ComputeDevice, AutoWithoutPicturesMakesAContextOnlyWhereThereIsHardware) {
  const int before = egl_contexts_created();
  const auto device = open_compute_device(Backend::kAuto, false);
  ASSERT_TRUE(device);
  EXPECT_EQ(egl_contexts_created(), before + (egl_lists_hardware() ? 1 : 0));
  EXPECT_EQ(device->context != nullptr, device->decision.backend == Backend::kGpu);
}

TEST(ComputeDevice, PicturesAndComputeShareOneContext) {
  const auto device = open_compute_device(Backend::kAuto, true);
  ASSERT_TRUE(device);
  if (device->context == nullptr) GTEST_SKIP() << "no OpenGL driver";
  EXPECT_EQ(device->decision.backend, device->context->software() ? Backend::kCpu : Backend::kGpu);
}

}  // namespace
}  // namespace viscera
