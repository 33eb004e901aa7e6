// A stream of OpenIGTLink: the input in pieces, as a network cuts it; the first byte says how long
// they are, and whether messages get the checksums that they should have.
#include <igtl_util.h>

#include <cmath>
#include <cstring>

#include "haptics/devices/igtl_reader.h"
#include "tests/fuzz/target.h"
#include "tests/haptics/devices/igtl_messages.h"

namespace viscera::fuzz {
namespace {

constexpr std::size_t kChecksumAt = 50, kTransform = 48;

std::uint64_t big_endian(const unsigned char* bytes) {
  std::uint64_t value = 0;
  for (int b = 0; b < 8; ++b) value = value << 8 | bytes[b];
  return value;
}

void put_checksums(std::vector<unsigned char>& stream) {
  for (std::size_t at = 0; at + test::kHeaderSize + kTransform <= stream.size();) {
    unsigned char* header = stream.data() + at;
    const std::uint64_t size = big_endian(header + test::kBodySizeAt);
    if (size > stream.size() - at - test::kHeaderSize) return;
    std::uint64_t crc = crc64(header + test::kHeaderSize, size, 0);
    for (int b = 7; b >= 0; --b, crc >>= 8)
      header[kChecksumAt + static_cast<std::size_t>(b)] = static_cast<unsigned char>(crc);
    at += test::kHeaderSize + size;
  }
}

bool read(std::string_view input) {
  if (input.empty()) return false;
  const auto how = static_cast<unsigned char>(input.front());
  std::vector<unsigned char> stream(input.begin() + 1, input.end());
  if (how % 2 == 0) put_checksums(stream);
  const std::size_t piece = 1 + how / 2;
  int poses = 0;
  IgtlReader reader(
      [&](const Pose& pose) {
        ++poses;
        expect(pose.position.allFinite(), "a pose is somewhere");
        expect(std::abs(pose.orientation.norm() - 1.0) < 1e-9, "a pose turns");
      },
      [](ServoEventKind, double) {});
  const std::span<const unsigned char> all(stream);
  for (std::size_t at = 0; at < all.size(); at += piece) {
    if (!reader.feed(all.subspan(at, std::min(piece, all.size() - at)))) {
      reader.reset();
      return false;
    }
    expect(reader.missing() <= IgtlReader::kLongestSkipped + 1000, "a message has an end");
  }
  return poses > 0;
}

std::vector<std::string> seeds() {
  test::Bytes one = test::transform_bytes(Pose{Vec3(0.01, 0.02, 0.03), Quaternion::Identity()});
  test::Bytes several = one;
  test::append(several, test::string_bytes("words"));
  test::append(several, one);
  std::vector<std::string> all;
  for (const test::Bytes& bytes : {one, several})
    for (const char how : {0, 1, 40, 41})
      all.push_back(how + std::string(bytes.begin(), bytes.end()));
  return all;
}

}  // namespace

Target igtl() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
