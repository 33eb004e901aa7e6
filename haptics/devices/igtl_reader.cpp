#include "haptics/devices/igtl_reader.h"

#include <igtlMessageHeader.h>
#include <igtlSensorMessage.h>
#include <igtlTransformMessage.h>
#include <igtlUnit.h>
#include <igtl_header.h>
#include <igtl_transform.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

namespace viscera {
namespace {

constexpr std::size_t kHeader = IGTL_HEADER_SIZE, kTransform = IGTL_TRANSFORM_SIZE;
constexpr double kMillimetre = 1e-3;

/// A type's or device's name: printable, then zeros.
bool is_name(const char* text, std::size_t size) {
  const char* end = std::find(text, text + size, '\0');
  return end != text && std::all_of(text, end, [](char c) { return c >= ' ' && c <= '~'; });
}

/// Nothing where the matrix isn't finite or turns its frame into something skew or mirrored.
bool to_pose(const igtl::Matrix4x4& matrix, Pose& pose) {
  Mat3 rotation;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rotation(i, j) = matrix[i][j];
    pose.position[i] = kMillimetre * matrix[i][3];
  }
  if (!rotation.allFinite() || !pose.position.allFinite()) return false;
  constexpr double kRigid = 1e-3;  // single precision, and senders that round
  if (!(rotation.transpose() * rotation).isIdentity(kRigid)) return false;
  if (rotation.determinant() < 0.0) return false;
  pose.orientation = Quaternion(rotation).normalized();
  return true;
}

}  // namespace

IgtlReader::IgtlReader(OnPose on_pose, OnEvent on_event)
    : on_pose_(std::move(on_pose)), on_event_(std::move(on_event)), want_(kHeader) {
  buffer_.reserve(kHeader + kTransform);
}

void IgtlReader::reset() {
  buffer_.clear();
  want_ = kHeader;
  skip_ = messages_ = bad_crc_ = no_pose_ = 0;
  bad_in_a_row_ = 0;
}

bool IgtlReader::feed(std::span<const unsigned char> bytes) {
  while (!bytes.empty()) {
    if (skip_ > 0) {
      const std::size_t part = std::min<std::uint64_t>(skip_, bytes.size());
      skip_ -= part;
      if (skip_ == 0) ++messages_;
      bytes = bytes.subspan(part);
      continue;
    }
    const std::size_t part = std::min(want_ - buffer_.size(), bytes.size());
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(part));
    bytes = bytes.subspan(part);
    if (buffer_.size() < want_) return true;
    if (want_ == kHeader ? !take_header() : !take_transform()) return false;
  }
  return true;
}

bool IgtlReader::take_header() {
  igtl_header header;
  std::memcpy(&header, buffer_.data(), kHeader);
  igtl_header_convert_byte_order(&header);
  const double size = static_cast<double>(header.body_size);
  if (header.version < 1 || header.version > 3 || !is_name(header.name, sizeof header.name)) {
    on_event_(ServoEventKind::kMessageMalformed, size);
    return false;
  }
  if (header.body_size > kLongestSkipped) {
    on_event_(ServoEventKind::kMessageTooLong, size);
    return false;
  }
  if (std::string_view(header.name, strnlen(header.name, sizeof header.name)) == "TRANSFORM") {
    if (header.body_size != kTransform) {
      on_event_(ServoEventKind::kMessageMalformed, size);
      return false;
    }
    want_ = kHeader + kTransform;
    return true;
  }
  buffer_.clear();
  skip_ = header.body_size;
  if (skip_ == 0) ++messages_;
  return true;
}

bool IgtlReader::take_transform() {
  const auto header = igtl::MessageHeader::New();
  header->InitPack();
  std::memcpy(header->GetPackPointer(), buffer_.data(), kHeader);
  header->Unpack();
  const auto message = igtl::TransformMessage::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  std::memcpy(message->GetPackBodyPointer(), buffer_.data() + kHeader, kTransform);
  buffer_.clear();
  want_ = kHeader;
  ++messages_;

  if (!(message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY)) {
    // One by one they would fill the log: the first, second, fourth, ...
    if (std::has_single_bit(++bad_crc_))
      on_event_(ServoEventKind::kMessageBadCrc, static_cast<double>(bad_crc_));
    if (++bad_in_a_row_ < kMostBadInARow) return true;
    on_event_(ServoEventKind::kMessageMalformed, static_cast<double>(kTransform));
    return false;
  }
  bad_in_a_row_ = 0;
  igtl::Matrix4x4 matrix;
  message->GetMatrix(matrix);
  Pose pose;
  if (to_pose(matrix, pose)) {
    on_pose_(pose);
  } else if (std::has_single_bit(++no_pose_)) {
    on_event_(ServoEventKind::kMessageNotAPose, static_cast<double>(no_pose_));
  }
  return true;
}

void pack_force(const Vec3& force, const char* name, std::vector<unsigned char>& out) {
  const auto unit = igtl::Unit::New();
  unit->Init();
  unit->Append(igtl::Unit::SI_DERIVED_NEWTON, 1);
  const auto message = igtl::SensorMessage::New();
  message->SetDeviceName(name);
  message->SetUnit(unit);
  message->SetLength(3);
  for (unsigned int i = 0; i < 3; ++i) message->SetValue(i, force[static_cast<int>(i)]);
  const auto now = igtl::TimeStamp::New();
  now->GetTime();
  auto stamp = now;
  message->SetTimeStamp(stamp);
  message->Pack();
  const auto* bytes = static_cast<const unsigned char*>(message->GetPackPointer());
  out.assign(bytes, bytes + message->GetPackSize());
}

}  // namespace viscera
