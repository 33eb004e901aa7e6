#include "haptics/devices/network_device.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <sstream>

#include "haptics/servo_loop.h"
#include "tests/haptics/allocations.h"
#include "tests/haptics/devices/igtl_messages.h"
#include "tests/haptics/servo_world.h"

namespace viscera::test {
namespace {

using namespace std::chrono_literals;

std::unique_ptr<NetworkDevice> device_on_a_free_port() {
  NetworkDeviceSettings settings;
  settings.port = 0;
  auto device = NetworkDevice::open(settings);
  EXPECT_TRUE(device) << device.error().text();
  return std::move(*device);
}

/// A bare TCP client, which may say anything.
class RawClient {
 public:
  explicit RawClient(int port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~RawClient() { ::close(socket_); }
  /// False once the other end has hung up.
  bool send(const Bytes& bytes) const {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  /// So many bytes; fewer where they don't come for ever so long.
  Bytes receive(std::size_t size) const {
    const timeval patience{20, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    Bytes bytes(size);
    const ssize_t got = ::recv(socket_, bytes.data(), size, MSG_WAITALL);
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return bytes;
  }

 private:
  int socket_;
};

/// Collects events until one is of this kind; false when none has come after a generous while.
bool wait_for(NetworkDevice& device, ServoEventKind kind) {
  for (int i = 0; i < 20'000; ++i) {
    for (ServoEvent event; device.next_event(event);)
      if (event.kind == kind) return true;
    std::this_thread::sleep_for(1ms);
  }
  return false;
}

bool wait_until(const std::function<bool()>& is) {
  for (int i = 0; i < 20'000 && !is(); ++i) std::this_thread::sleep_for(1ms);
  return is();
}

Pose at_height(double z) {
  Pose pose;
  pose.position = Vec3(0.0, 0.0, z);
  return pose;
}

TEST(NetworkDevice, CannotBeSavedAndSaysWhy) {
  const auto device = device_on_a_free_port();
  EXPECT_NE(device->why_not_saved().find("moved from outside"), std::string::npos);
}

TEST(NetworkDevice, AReadingMayStayForATenthOfASecondAndThenItHasFrozen) {
  for (const std::uint64_t ticks : {98u, 102u}) {
    DeviceGuard guard({}, NetworkDeviceSettings().limits, 1e-3);
    ServoEventRing events;
    guard.judge({}, 10, 1e-3, events);
    guard.judge({}, 10 + ticks, 1e-3, events);
    EXPECT_EQ(guard.sound(), ticks < 100) << ticks;
  }
}

TEST(NetworkDevice, AClientInAnotherProcessDrivesAToolAndReceivesForces) {
  // Longer by hand: VISCERA_LINK_FORCES=10000.
  const char* asked = std::getenv("VISCERA_LINK_FORCES");
  const std::string forces = asked ? asked : "100";
  const auto device = device_on_a_free_port();
  VirtualWall wall = wall_at_zero(300.0);
  ServoTick tick(*device, wall, patient());
  ServoLoop loop(tick, gentle());
  loop.start();

  const std::string command = std::string(VISCERA_IGTL_CLIENT) + " " +
                              std::to_string(device->port()) + " 1.0 " + forces + " 2000";
  std::FILE* out = popen(command.c_str(), "r");
  ASSERT_NE(out, nullptr);
  std::string text;
  char part[256];
  while (std::fgets(part, sizeof part, out)) text += part;
  ASSERT_EQ(pclose(out), 0) << text;
  std::map<std::string, std::string> told;
  std::istringstream words(text);
  for (std::string key, value; words >> key >> value;) told[key] = value;

  EXPECT_TRUE(wait_for(*device, ServoEventKind::kClientLeft));
  end(loop);
  EXPECT_EQ(tick.output().force, Vec3::Zero()) << "the client is gone";
  EXPECT_GT(std::stoi(told["forces"]), 100) << text;
  EXPECT_EQ(told["bad"], "0");
  EXPECT_EQ(told["name"], "HapticForce");
  EXPECT_EQ(told["newton"], "1");
  EXPECT_EQ(std::stod(told["sideways"]), 0.0);
  // A wall does not pull, but for the damper that keeps the loop passive.
  EXPECT_GE(std::stod(told["least"]), -0.25 * std::stod(told["greatest"])) << text;
  // 10 mm into 300 N/m behind a coupling of 2000 N/m.
  EXPECT_GT(std::stod(told["greatest"]), 1.0) << text;
  EXPECT_LT(std::stod(told["greatest"]), 3.5) << text;
}

TEST(NetworkDevice, AForceThatIsWrittenReachesTheClientInNewtons) {
  const auto device = device_on_a_free_port();
  const RawClient client(device->port());
  ASSERT_TRUE(wait_for(*device, ServoEventKind::kClientConnected));
  device->write(Vec3(0.0, -2.0, 1.5));
  // A SENSOR's body: length, status, unit, then numbers of eight bytes, the most significant first.
  const Bytes message = client.receive(kHeaderSize + 10 + 3 * 8);
  ASSERT_EQ(message.size(), kHeaderSize + 34);
  EXPECT_EQ(std::string(message.begin() + kTypeAt, message.begin() + kTypeAt + 6), "SENSOR");
  EXPECT_EQ(message[kHeaderSize], 3);
  const auto number = [&](std::size_t i) {
    std::uint64_t bits = 0;
    for (std::size_t k = 0; k < 8; ++k) bits = bits << 8 | message[kHeaderSize + 10 + 8 * i + k];
    return std::bit_cast<double>(bits);
  };
  EXPECT_EQ(number(0), 0.0);
  EXPECT_EQ(number(1), -2.0);
  EXPECT_EQ(number(2), 1.5);
}

TEST(NetworkDevice, TheLoopReadsTheNewestPoseAndWaitsForNothing) {
  const auto device = device_on_a_free_port();
  EXPECT_FALSE(device->read(0).connected);
  const RawClient client(device->port());
  Bytes stream;
  for (int i = 1; i <= 50; ++i) append(stream, transform_bytes(at_height(0.001 * i)));
  ASSERT_TRUE(client.send(stream));
  EXPECT_TRUE(wait_until([&] { return device->read(0).sample == 50; }));
  EXPECT_NEAR(device->read(0).pose.position.z(), 0.05, 1e-8);
  const std::uint64_t before = allocations();
  device->read(1);
  device->write(Vec3(0.0, 0.0, 1.0));
  EXPECT_EQ(allocations(), before);
}

TEST(NetworkDevice, HostileClientsAreCutOffReportedAndTheNextOneIsServed) {
  const auto device = device_on_a_free_port();
  struct Attack {
    const char* name;
    Bytes bytes;
    ServoEventKind kind;
  };
  Bytes lying = transform_bytes(at_height(0.0)), wrong_crc = lying, many_wrong;
  lying[kBodySizeAt] = 0x7f;
  wrong_crc[kHeaderSize + 3] ^= 1;
  for (int i = 0; i < 12; ++i) append(many_wrong, wrong_crc);
  Bytes flood;
  for (int i = 0; i < 30'000; ++i) append(flood, transform_bytes(at_height(0.0)));
  const std::string http =
      "GET / HTTP/1.1\r\nHost: example.org\r\nAccept: everything that there is\r\n\r\n";
  const Attack attacks[] = {
      {"lying length", lying, ServoEventKind::kMessageTooLong},
      {"wrong checksums", many_wrong, ServoEventKind::kMessageBadCrc},
      {"flood", flood, ServoEventKind::kFlood},
      {"another protocol", Bytes(http.begin(), http.end()), ServoEventKind::kMessageMalformed},
  };
  for (const Attack& attack : attacks) {
    const RawClient hostile(device->port());
    hostile.send(attack.bytes);
    EXPECT_TRUE(wait_for(*device, attack.kind)) << attack.name;
    EXPECT_TRUE(wait_for(*device, ServoEventKind::kClientLeft)) << attack.name;
    EXPECT_TRUE(wait_until([&] { return !device->read(0).connected; })) << attack.name;
  }
  const RawClient honest(device->port());
  ASSERT_TRUE(honest.send(transform_bytes(at_height(0.02))));
  EXPECT_TRUE(wait_until([&] {
    return device->read(0).connected && std::abs(device->read(0).pose.position.z() - 0.02) < 1e-8;
  }));
}

TEST(NetworkDevice, AClientThatStopsInsideAMessageIsCutOff) {
  const auto device = device_on_a_free_port();
  const RawClient client(device->port());
  Bytes half = transform_bytes(at_height(0.0));
  half.resize(70);
  ASSERT_TRUE(client.send(half));
  EXPECT_TRUE(wait_for(*device, ServoEventKind::kMessageStalled));
}

TEST(NetworkDevice, UnderAttackTheLoopTicksOnAndNoForceIsFelt) {
  const auto device = device_on_a_free_port();
  VirtualWall wall = wall_at_zero(300.0);
  ServoTick tick(*device, wall, {});
  ServoLoop loop(tick, gentle());
  loop.start();
  Bytes broken = transform_bytes(at_height(-0.01));
  broken[kHeaderSize + 20] ^= 0xff;
  for (int i = 0; i < 5; ++i) {
    const RawClient hostile(device->port());
    while (hostile.send(broken)) {
    }
  }
  const std::uint64_t ticks = loop.statistics().ticks;
  EXPECT_TRUE(wait_until([&] { return loop.statistics().ticks > ticks + 20; }));
  end(loop);
  EXPECT_EQ(loop.statistics().energy_given, 0.0);
}

TEST(NetworkDevice, APortThatIsTakenAndAnAddressThatIsNoneAreRefused) {
  const auto first = device_on_a_free_port();
  NetworkDeviceSettings settings;
  settings.port = first->port();
  const auto second = NetworkDevice::open(settings);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().text().find(std::to_string(first->port())), std::string::npos);
  EXPECT_NE(second.error().text().find("in use"), std::string::npos) << second.error().text();
  settings.port = 70'000;
  EXPECT_FALSE(NetworkDevice::open(settings));
  settings.port = 0;
  settings.address = "nowhere";
  EXPECT_FALSE(NetworkDevice::open(settings));
}

}  // namespace
}  // namespace viscera::test
