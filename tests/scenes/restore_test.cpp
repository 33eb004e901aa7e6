// The main scene, taken back at random moments: nothing that the next step needs hides outside the
// state, whatever threads are at work.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <random>

#include "engine/features/features.h"
#include "engine/simulator/simulation.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

constexpr std::uint64_t kFrames = 600, kOn = 3;
constexpr std::size_t kMoments = 60;

struct Moment {
  std::uint64_t due = 0;  ///< frame at which the hash is compared
  std::string hash;       ///< that the other simulation came to
};

TEST(MainScene, GoesOnFromSixtyRandomMomentsToTheSameHash) {
  const auto model = Model::load(project_file("scenes/laparoscopic_cautery.json"),
                                 {.assets = project_file("assets")});
  ASSERT_TRUE(model) << model.error().text();
  auto whole = Simulation::create(*model), other = Simulation::create(*model);
  ASSERT_TRUE(whole && other);

  std::vector<std::uint64_t> frames(kFrames - kOn);
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i] = i;
  std::shuffle(frames.begin(), frames.end(), std::mt19937(20061115));
  frames.resize(kMoments);
  std::sort(frames.begin(), frames.end());

  std::deque<Moment> moments;
  std::vector<double> taking, restoring;
  std::size_t compared = 0, bytes = 0, next = 0;
  while (whole->frame() < kFrames) {
    if (next < frames.size() && frames[next] == whole->frame()) {
      ++next;
      using Clock = std::chrono::steady_clock;
      const auto start = Clock::now();
      const auto snapshot = whole->snapshot();
      const auto taken = Clock::now();
      ASSERT_TRUE(snapshot) << snapshot.error().text();
      const auto restored = other->restore(*snapshot);
      const auto end = Clock::now();
      ASSERT_TRUE(restored) << restored.error().text();
      taking.push_back(std::chrono::duration<double>(taken - start).count());
      restoring.push_back(std::chrono::duration<double>(end - taken).count());
      bytes = std::max(bytes, snapshot->bytes());
      EXPECT_EQ(other->hash(), whole->hash()) << "just restored, frame " << whole->frame();
      for (std::uint64_t k = 0; k < kOn; ++k) other->step();
      moments.push_back({whole->frame() + kOn, other->hash()});
    }
    whole->step();
    while (!moments.empty() && moments.front().due == whole->frame()) {
      EXPECT_EQ(moments.front().hash, whole->hash()) << "from frame " << whole->frame() - kOn;
      moments.pop_front();
      ++compared;
    }
  }
  EXPECT_EQ(compared, kMoments);
  std::sort(taking.begin(), taking.end());
  std::sort(restoring.begin(), restoring.end());
  std::printf("snapshot: median %.1f ms, at most %.1f MB; restore: median %.1f ms\n",
              1e3 * taking[kMoments / 2], 1e-6 * static_cast<double>(bytes),
              1e3 * restoring[kMoments / 2]);
}

}  // namespace
}  // namespace viscera::test
