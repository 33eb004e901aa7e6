// OpenIGTLink messages as the library packs them, for tests to send or to break.
#pragma once

#include <string>
#include <vector>

#include "kernels/base/types.h"

namespace viscera::test {

using Bytes = std::vector<unsigned char>;

/// A TRANSFORM; the position in metres.
Bytes transform_bytes(const Pose& pose);
/// A TRANSFORM with any nine numbers as its rotation.
Bytes transform_bytes(const Mat3& rotation, const Vec3& position);
/// Another type that a device might send along.
Bytes string_bytes(const std::string& text);
void append(Bytes& to, const Bytes& more);

// Where a header keeps what.
constexpr std::size_t kTypeAt = 2, kBodySizeAt = 42, kHeaderSize = 58;

}  // namespace viscera::test
