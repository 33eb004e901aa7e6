#include "haptics/devices/network_device.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <vector>

#include "haptics/devices/igtl_reader.h"
#include "haptics/devices/simulated_device.h"

// The library's messages, our own sockets: its server listens on every address of the machine, and
// its send() ends the process with SIGPIPE when a client goes.

namespace viscera {

using Clock = std::chrono::steady_clock;

namespace {

constexpr auto kForceInterval = std::chrono::microseconds(950);  // 1,000 a second, with some slack
constexpr double kLongestSilence = 5.0;                          // [s] of a client
constexpr double kLongestPause = 1.0;                            // [s] inside a message
// Devices send a few thousand messages a second.
constexpr std::uint64_t kMostMessages = 20'000, kMostBytes = 16 << 20;  // a second

double seconds_since(Clock::time_point then) {
  return std::chrono::duration<double>(Clock::now() - then).count();
}

}  // namespace

NetworkDeviceSettings::NetworkDeviceSettings() : limits(phantom_premium_1_0a()) {
  limits.work_space = Box(Vec3::Constant(-0.5), Vec3::Constant(0.5));
  limits.resolution = 1e-6;  // single-precision millimetres
  limits.stale_after = 0.1;
}

/// One client: its socket, what it is in the middle of, and what it sent in this second.
class NetworkDevice::Connection {
 public:
  Connection(NetworkDevice& device, int socket)
      : device_(device),
        socket_(socket),
        reader_([this](const Pose& pose) { take(pose); },
                [this](ServoEventKind kind, double value) { tell(kind, value); }) {
    const int on = 1;
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    tell(ServoEventKind::kClientConnected, 0.0);
  }
  ~Connection() {
    ::close(socket_);
    tell(ServoEventKind::kClientLeft, static_cast<double>(reader_.messages()));
    state_.connected = false;
    device_.publish(state_);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  int socket() const { return socket_; }

  /// Reads what is there; false when the client has gone or must go.
  bool receive() {
    unsigned char bytes[65536];
    const ssize_t got = ::recv(socket_, bytes, sizeof bytes, MSG_DONTWAIT);
    if (got == 0) return false;
    if (got < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    heard_ = Clock::now();
    return reader_.feed({bytes, static_cast<std::size_t>(got)}) &&
           calm(static_cast<std::uint64_t>(got));
  }

  /// False when it has been silent for too long.
  bool in_time() {
    const std::uint64_t missing = reader_.missing();
    if (seconds_since(heard_) < (missing > 0 ? kLongestPause : kLongestSilence)) return true;
    tell(ServoEventKind::kMessageStalled, static_cast<double>(missing));
    return false;
  }

  /// Sends the newest force where the socket takes it. A client that doesn't read misses forces;
  /// it doesn't get them late.
  bool send_force() {
    if (sent_ == out_.size()) {
      if (Clock::now() - last_sent_ < kForceInterval || !device_.forces_.update()) return true;
      pack_force(device_.forces_.front(), device_.settings_.force_name.c_str(), out_);
      sent_ = 0;
      last_sent_ = Clock::now();
    }
    const ssize_t put =
        ::send(socket_, out_.data() + sent_, out_.size() - sent_, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (put < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    sent_ += static_cast<std::size_t>(put);
    return true;
  }

 private:
  void take(const Pose& pose) {
    state_.pose = pose;
    state_.connected = true;
    state_.sample = ++device_.samples_;
    device_.publish(state_);
  }
  void tell(ServoEventKind kind, double value) { device_.events_.push({0, kind, value}); }

  bool calm(std::uint64_t bytes) {
    bytes_ += bytes;
    const std::uint64_t messages = reader_.messages() - messages_before_;
    const double spent = std::max(seconds_since(second_), 1e-3);
    if (messages > kMostMessages || bytes_ > kMostBytes) {
      tell(ServoEventKind::kFlood, static_cast<double>(messages) / spent);
      return false;
    }
    if (spent >= 1.0) {
      second_ = Clock::now();
      bytes_ = 0;
      messages_before_ = reader_.messages();
    }
    return true;
  }

  NetworkDevice& device_;
  int socket_;
  IgtlReader reader_;
  DeviceState state_;
  Clock::time_point heard_ = Clock::now(), second_ = heard_, last_sent_{};
  std::uint64_t bytes_ = 0, messages_before_ = 0;
  std::vector<unsigned char> out_;
  std::size_t sent_ = 0;
};

Result<std::unique_ptr<NetworkDevice>> NetworkDevice::open(const NetworkDeviceSettings& settings) {
  const auto failed = [&](const std::string& why) {
    return failure(fmt::format("network device: can't listen on {}:{}: {}", settings.address,
                               settings.port, why));
  };
  sockaddr_in address{};
  address.sin_family = AF_INET;
  if (settings.port < 0 || settings.port > 65535) return failed("expected a port from 0 to 65535");
  address.sin_port = htons(static_cast<std::uint16_t>(settings.port));
  if (inet_pton(AF_INET, settings.address.c_str(), &address.sin_addr) != 1)
    return failed("expected an IPv4 address");
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener < 0) return failed(std::strerror(errno));
  const int on = 1;
  setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  if (::bind(listener, any, size) != 0 || ::listen(listener, 4) != 0 ||
      ::getsockname(listener, any, &size) != 0) {
    const int error = errno;
    ::close(listener);
    return failed(std::strerror(error));
  }
  return std::unique_ptr<NetworkDevice>(
      new NetworkDevice(settings, listener, ntohs(address.sin_port)));
}

NetworkDevice::NetworkDevice(const NetworkDeviceSettings& settings, int listener, int port)
    : settings_(settings),
      name_(fmt::format("network ({}:{})", settings.address, port)),
      listener_(listener),
      port_(port) {
  DeviceState nobody;
  nobody.connected = false;
  publish(nobody);
  thread_ = std::thread([this] { serve(); });
}

NetworkDevice::~NetworkDevice() {
  stop_ = true;
  thread_.join();
  ::close(listener_);
}

void NetworkDevice::publish(const DeviceState& state) {
  states_.back() = state;
  states_.publish();
}

void NetworkDevice::serve() {
  std::unique_ptr<Connection> client;
  while (!stop_.load(std::memory_order_relaxed)) {
    // Awake each millisecond for forces; without a client now and then for the end.
    pollfd waiting{client ? client->socket() : listener_, POLLIN, 0};
    ::poll(&waiting, 1, client ? 1 : 20);
    if (!client) {
      const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (socket >= 0) client = std::make_unique<Connection>(*this, socket);
      continue;
    }
    if (!client->receive() || !client->in_time() || !client->send_force()) client.reset();
  }
}

DeviceState NetworkDevice::read(std::uint64_t) noexcept {
  states_.update();
  return states_.front();
}

void NetworkDevice::write(const Vec3& force) noexcept {
  forces_.back() = force;
  forces_.publish();
}

}  // namespace viscera
