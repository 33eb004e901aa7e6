#include "tests/haptics/devices/igtl_messages.h"

#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>

namespace viscera::test {
namespace {

Bytes packed(igtl::MessageBase& message) {
  message.Pack();
  const auto* bytes = static_cast<const unsigned char*>(message.GetPackPointer());
  return {bytes, bytes + message.GetPackSize()};
}

}  // namespace

Bytes transform_bytes(const Mat3& rotation, const Vec3& position) {
  igtl::Matrix4x4 matrix;
  igtl::IdentityMatrix(matrix);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) matrix[i][j] = static_cast<float>(rotation(i, j));
    matrix[i][3] = static_cast<float>(1e3 * position[i]);
  }
  const auto message = igtl::TransformMessage::New();
  message->SetDeviceName("Stylus");
  message->SetMatrix(matrix);
  return packed(*message);
}

Bytes transform_bytes(const Pose& pose) {
  return transform_bytes(pose.orientation.toRotationMatrix(), pose.position);
}

Bytes string_bytes(const std::string& text) {
  const auto message = igtl::StringMessage::New();
  message->SetDeviceName("Words");
  message->SetString(text.c_str());
  return packed(*message);
}

void append(Bytes& to, const Bytes& more) {
  to.insert(to.end(), more.begin(), more.end());
}

}  // namespace viscera::test
