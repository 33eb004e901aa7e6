// Poses out of a stream of OpenIGTLink bytes that nobody vouches for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "haptics/servo_event.h"
#include "kernels/base/types.h"

namespace viscera {

/// Cuts the stream into messages and lets the library check and unpack what is a TRANSFORM
/// (protocol versions 1 and 2); other types are skipped. Nothing that a header claims is believed
/// before it is compared with what its type allows, and memory doesn't grow with the claims.
class IgtlReader {
 public:
  static constexpr std::uint64_t kLongestSkipped = 1 << 20;  ///< bytes of another type's message
  static constexpr int kMostBadInARow = 10;                  ///< wrong checksums, then cut off

  using OnPose = std::function<void(const Pose&)>;  ///< [m]; the wire has millimetres
  using OnEvent = std::function<void(ServoEventKind, double value)>;
  IgtlReader(OnPose on_pose, OnEvent on_event);

  /// Takes the next bytes. False when the stream can't be followed any more: cut it off.
  bool feed(std::span<const unsigned char> bytes);
  /// Forgets a stream that has ended.
  void reset();

  /// Bytes that the message in the making still needs; zero between messages.
  std::uint64_t missing() const {
    return skip_ > 0 ? skip_ : buffer_.empty() ? 0 : want_ - buffer_.size();
  }
  std::uint64_t messages() const { return messages_; }  ///< whole ones, of any type

 private:
  bool take_header();
  bool take_transform();

  OnPose on_pose_;
  OnEvent on_event_;
  std::vector<unsigned char> buffer_;  // the message in the making
  std::size_t want_;                   // bytes until something can be done
  std::uint64_t skip_ = 0;             // bytes of a body that nobody wants
  std::uint64_t messages_ = 0, bad_crc_ = 0, no_pose_ = 0;
  int bad_in_a_row_ = 0;
};

/// One SENSOR message with the force [N], as the library packs it; `out` keeps its memory.
void pack_force(const Vec3& force, const char* name, std::vector<unsigned char>& out);

}  // namespace viscera
