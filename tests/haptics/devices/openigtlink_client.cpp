// A program of its own that drives a tool over OpenIGTLink through the library alone: it dips below
// z = 0 and listens to the forces that come back. It ends above, after a dip, once it has felt more
// than NEWTONS and heard more than FORCES; with 1 where it hasn't within a minute, with 2 where it
// can't begin.
//   openigtlink_client PORT NEWTONS FORCES STEPS
// A dip has so many STEPS, and the hand takes one for each force that it hears: a busy machine
// slows it down, where a hand on the clock would jump from one late pose to the next.
#include <igtlClientSocket.h>
#include <igtlMessageHeader.h>
#include <igtlSensorMessage.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <string>
#include <thread>

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kLongest{60};
/// Forces that come together move the hand by no more steps than these.
constexpr int kMostSteps = 4;

struct Received {
  std::atomic<int> forces{0};
  std::atomic<double> greatest{0.0};
  int bad = 0;
  double sideways = 0.0, least = 0.0;
  std::string name;
  bool newton = false;
};

void receive(igtl::ClientSocket& socket, const std::atomic<bool>& stop, Received& out) {
  while (!stop) {
    const auto header = igtl::MessageHeader::New();
    header->InitPack();
    const int got = socket.Receive(header->GetPackPointer(), header->GetPackSize());
    if (got < 0) continue;  // nothing for now
    if (got != header->GetPackSize()) return;
    header->Unpack();
    if (std::strcmp(header->GetDeviceType(), "SENSOR") != 0) {
      socket.Skip(header->GetBodySizeToRead());
      continue;
    }
    const auto sensor = igtl::SensorMessage::New();
    sensor->SetMessageHeader(header);
    sensor->AllocatePack();
    socket.Receive(sensor->GetPackBodyPointer(), sensor->GetPackBodySize());
    if (!(sensor->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) || sensor->GetLength() != 3) {
      ++out.bad;
      continue;
    }
    out.name = sensor->GetDeviceName();
    const auto unit = igtl::Unit::New();
    const auto newton = igtl::Unit::New();
    sensor->GetUnit(unit);
    newton->Init();
    newton->Append(igtl::Unit::SI_DERIVED_NEWTON, 1);
    out.newton = unit->Pack() == newton->Pack();
    out.greatest = std::fmax(out.greatest.load(), sensor->GetValue(2));
    ++out.forces;
    out.least = std::fmin(out.least, sensor->GetValue(2));
    out.sideways = std::fmax(out.sideways, std::hypot(sensor->GetValue(0), sensor->GetValue(1)));
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 5) {
    std::fprintf(stderr, "expected PORT NEWTONS FORCES STEPS\n");
    return 2;
  }
  const auto socket = igtl::ClientSocket::New();
  if (socket->ConnectToServer("127.0.0.1", std::atoi(arguments[1])) != 0) {
    std::fprintf(stderr, "can't connect to port %s\n", arguments[1]);
    return 2;
  }
  socket->SetReceiveTimeout(50);
  const double newtons = std::atof(arguments[2]);
  const int forces = std::atoi(arguments[3]), steps = std::atoi(arguments[4]);

  std::atomic<bool> stop{false};
  Received received;
  std::thread listening([&] { receive(*socket, stop, received); });
  int sent = 0, heard = 0, step = 0;
  bool felt = false;
  const auto end = Clock::now() + kLongest;
  while (!felt && Clock::now() < end) {
    igtl::Matrix4x4 matrix;
    igtl::IdentityMatrix(matrix);
    // From 10 mm above to 10 mm below, in millimetres.
    matrix[2][3] = static_cast<float>(10.0 * std::cos(2.0 * std::numbers::pi * step / steps));
    const auto message = igtl::TransformMessage::New();
    message->SetDeviceName("Stylus");
    message->SetMatrix(matrix);
    message->Pack();
    if (socket->Send(message->GetPackPointer(), message->GetPackSize()) == 0) break;
    ++sent;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const int before = heard;
    heard = received.forces;
    step += std::min(heard - before, kMostSteps);
    if (step < steps) continue;
    step = 0;
    felt = received.greatest > newtons && heard > forces;
  }
  stop = true;
  listening.join();
  socket->CloseSocket();
  std::printf(
      "sent %d\nforces %d\nbad %d\ngreatest %.6f\nleast %.6f\nsideways %.6f\nname %s\nnewton %d\n",
      sent, received.forces.load(), received.bad, received.greatest.load(), received.least,
      received.sideways, received.name.c_str(), received.newton ? 1 : 0);
  return felt ? 0 : 1;
}
