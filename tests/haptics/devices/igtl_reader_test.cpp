#include "haptics/devices/igtl_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "kernels/base/random.h"
#include "tests/haptics/devices/igtl_messages.h"

namespace viscera::test {
namespace {

/// A reader and all that it said.
struct Listener {
  std::vector<Pose> poses;
  std::vector<ServoEventKind> kinds;
  std::vector<double> values;
  IgtlReader reader{[this](const Pose& pose) { poses.push_back(pose); },
                    [this](ServoEventKind kind, double value) {
                      kinds.push_back(kind);
                      values.push_back(value);
                    }};
};

Pose some_pose(int i) {
  Pose pose;
  pose.position = Vec3(0.001 * i, -0.02, 0.03);
  pose.orientation = Quaternion(Eigen::AngleAxisd(0.1 * i, Vec3(1.0, 2.0, 3.0).normalized()));
  return pose;
}

TEST(IgtlReader, PosesComeOutHoweverTheStreamIsCut) {
  Bytes stream;
  for (int i = 0; i < 20; ++i) {
    append(stream, transform_bytes(some_pose(i)));
    if (i % 3 == 0) append(stream, string_bytes("left out"));
  }
  for (const std::size_t piece : {1, 7, 58, 106, 10'000}) {
    Listener heard;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      const std::size_t size = std::min(piece, stream.size() - at);
      ASSERT_TRUE(heard.reader.feed({stream.data() + at, size}));
    }
    ASSERT_EQ(heard.poses.size(), 20u) << piece;
    EXPECT_TRUE(heard.kinds.empty());
    EXPECT_EQ(heard.reader.messages(), 27u);
    EXPECT_EQ(heard.reader.missing(), 0u);
    for (int i = 0; i < 20; ++i) {
      const Pose& pose = heard.poses[static_cast<std::size_t>(i)];
      EXPECT_LT((pose.position - some_pose(i).position).norm(), 1e-8);
      EXPECT_LT(pose.orientation.angularDistance(some_pose(i).orientation), 1e-3);
    }
  }
}

TEST(IgtlReader, AWrongChecksumCostsThatMessageAlone) {
  Bytes stream = transform_bytes(some_pose(1)), broken = transform_bytes(some_pose(2));
  broken[kHeaderSize + 5] ^= 0x10;
  append(stream, broken);
  append(stream, transform_bytes(some_pose(3)));
  Listener heard;
  EXPECT_TRUE(heard.reader.feed(stream));
  EXPECT_EQ(heard.poses.size(), 2u);
  EXPECT_EQ(heard.kinds, std::vector{ServoEventKind::kMessageBadCrc});
}

TEST(IgtlReader, ASenderWhoseChecksumsAreAllWrongIsCutOff) {
  Bytes broken = transform_bytes(some_pose(2));
  broken[kHeaderSize + 5] ^= 0x10;
  Listener heard;
  int taken = 0;
  while (heard.reader.feed(broken)) ASSERT_LT(++taken, 100);
  EXPECT_EQ(taken + 1, IgtlReader::kMostBadInARow);
  EXPECT_EQ(heard.kinds.back(), ServoEventKind::kMessageMalformed);
  EXPECT_LT(heard.kinds.size(), 7u) << "not one event a message";
}

TEST(IgtlReader, LengthsThatLieAreNotBelieved) {
  const auto with_size = [](std::uint64_t size) {
    Bytes bytes = transform_bytes(some_pose(1));
    for (int i = 0; i < 8; ++i)
      bytes[kBodySizeAt + static_cast<std::size_t>(i)] =
          static_cast<unsigned char>(size >> (56 - 8 * i));
    return bytes;
  };
  for (const std::uint64_t size : {0ull, 1ull, 47ull, 49ull, 4096ull}) {
    Listener heard;
    EXPECT_FALSE(heard.reader.feed(with_size(size))) << size;
    EXPECT_EQ(heard.kinds, std::vector{ServoEventKind::kMessageMalformed});
    EXPECT_EQ(heard.values.front(), static_cast<double>(size));
  }
  for (const std::uint64_t size : {1ull << 31, 1ull << 32, 1ull << 63, ~0ull}) {
    Listener heard;
    EXPECT_FALSE(heard.reader.feed(with_size(size))) << size;
    EXPECT_EQ(heard.kinds, std::vector{ServoEventKind::kMessageTooLong});
  }
}

TEST(IgtlReader, MessagesOfOtherTypesAreSkippedUpToAMebibyteAndUpToVersionThree) {
  const auto header = [](unsigned char version, std::uint64_t size) {
    Bytes bytes = string_bytes("words");
    bytes.resize(kHeaderSize);
    bytes[1] = version;
    for (int i = 0; i < 8; ++i)
      bytes[kBodySizeAt + static_cast<std::size_t>(i)] =
          static_cast<unsigned char>(size >> (56 - 8 * i));
    return bytes;
  };
  for (const unsigned char version : {1, 2, 3}) {
    Listener heard;
    EXPECT_TRUE(heard.reader.feed(header(version, 1 << 20))) << int(version);
    EXPECT_EQ(heard.reader.missing(), std::uint64_t{1 << 20});
    EXPECT_TRUE(heard.kinds.empty());
    EXPECT_TRUE(heard.reader.feed(Bytes(1 << 20)));
    EXPECT_EQ(heard.reader.messages(), 1u);
    EXPECT_TRUE(heard.reader.feed(transform_bytes(some_pose(1))));
    EXPECT_EQ(heard.poses.size(), 1u);
  }
  for (const auto& [version, size, kind] :
       {std::tuple(2, (1 << 20) + 1, ServoEventKind::kMessageTooLong),
        std::tuple(4, 8, ServoEventKind::kMessageMalformed),
        std::tuple(0, 8, ServoEventKind::kMessageMalformed)}) {
    Listener heard;
    EXPECT_FALSE(heard.reader.feed(
        header(static_cast<unsigned char>(version), static_cast<std::uint64_t>(size))));
    EXPECT_EQ(heard.kinds, std::vector{kind});
  }
}

TEST(IgtlReader, WhatIsNoRigidMotionIsLeftOut) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Mat3 mirrored = Mat3::Identity(), skew = Mat3::Identity(), broken = Mat3::Identity();
  mirrored(2, 2) = -1.0;
  skew(0, 1) = 0.2;
  broken(1, 1) = nan;
  Listener heard;
  for (const Mat3& rotation : {mirrored, skew, broken, Mat3(2.0 * Mat3::Identity())})
    EXPECT_TRUE(heard.reader.feed(transform_bytes(rotation, Vec3::Zero())));
  EXPECT_TRUE(heard.reader.feed(transform_bytes(Mat3::Identity(), Vec3(nan, 0.0, 0.0))));
  EXPECT_TRUE(heard.poses.empty());
  EXPECT_EQ(heard.kinds.front(), ServoEventKind::kMessageNotAPose);
  EXPECT_EQ(heard.kinds.size(), 3u) << "at the first, second and fourth";
}

TEST(IgtlReader, AnotherProtocolIsNotFollowed) {
  for (const std::string& text :
       {std::string(
            "GET / HTTP/1.1\r\nHost: localhost\r\nUser-Agent: a browser, by mistake\r\n\r\n"),
        std::string(200, '\0'), std::string(200, '\xff')}) {
    Listener heard;
    EXPECT_FALSE(
        heard.reader.feed({reinterpret_cast<const unsigned char*>(text.data()), text.size()}));
    EXPECT_EQ(heard.kinds.size(), 1u);
  }
}

TEST(IgtlReader, AMessageInTheMakingSaysWhatItMisses) {
  const Bytes bytes = transform_bytes(some_pose(1));
  Listener heard;
  EXPECT_EQ(heard.reader.missing(), 0u);
  heard.reader.feed({bytes.data(), 20});
  EXPECT_EQ(heard.reader.missing(), kHeaderSize - 20);
  heard.reader.feed({bytes.data() + 20, 60});
  EXPECT_EQ(heard.reader.missing(), bytes.size() - 80);
  heard.reader.reset();
  EXPECT_EQ(heard.reader.missing(), 0u);
  EXPECT_TRUE(heard.reader.feed(bytes));
  EXPECT_EQ(heard.poses.size(), 1u);
}

TEST(IgtlReader, NoStreamOfBrokenMessagesDoesHarm) {
  // Valid messages with bytes changed, cut out and put in; each stream until it is cut off.
  for (std::uint64_t round = 0; round < 3000; ++round) {
    const Random random(6, round);
    std::uint64_t draw = 0;
    const auto below = [&](std::size_t most) {
      return static_cast<std::size_t>(random.uniform(draw++) * static_cast<double>(most));
    };
    Bytes stream;
    for (int i = 0; i < 6; ++i)
      append(stream, i % 2 ? string_bytes("hello") : transform_bytes(some_pose(i)));
    for (std::size_t change = 1 + below(4); change > 0; --change) {
      const std::size_t at = below(stream.size());
      const auto place = stream.begin() + static_cast<std::ptrdiff_t>(at);
      switch (below(3)) {
        case 0:
          *place = static_cast<unsigned char>(random.bits(draw++));
          break;
        case 1:
          stream.erase(place, stream.begin() + static_cast<std::ptrdiff_t>(
                                                   std::min(stream.size(), at + 1 + below(60))));
          break;
        default:
          stream.insert(place, 1 + below(60), static_cast<unsigned char>(below(256)));
      }
    }
    Listener heard;
    std::size_t at = 0;
    while (at < stream.size()) {
      const std::size_t size = std::min(stream.size() - at, 1 + below(90));
      if (!heard.reader.feed({stream.data() + at, size})) break;
      at += size;
    }
    EXPECT_LE(heard.poses.size(), 3u);
    for (const Pose& pose : heard.poses) {
      ASSERT_TRUE(pose.position.allFinite());
      // The checksum stands between a changed byte and the tool.
      constexpr std::array kSent = {0, 2, 4};
      const bool known = std::any_of(kSent.begin(), kSent.end(), [&](int i) {
        return (pose.position - some_pose(i).position).norm() < 1e-8;
      });
      EXPECT_TRUE(known) << pose.position.transpose();
    }
  }
}

}  // namespace
}  // namespace viscera::test
