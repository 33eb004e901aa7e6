// A checkpoint's file. A changed one has another checksum, so the right one is put in: behind it
// lies what is to be tried.
#include <cstring>

#include "engine/simulator/checkpoint_file.h"
#include "kernels/base/hash.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

// Where the head has what.
constexpr std::size_t kBodyAt = 16, kChecksumAt = 24, kDigits = 32, kHead = kChecksumAt + kDigits;

CheckpointIdentity identity() {
  return {"1.2.3", "aa11", "a processor", "bb22"};
}

std::string sealed(std::string_view input) {
  std::string all(input);
  if (all.size() < kHead) return all;
  const std::uint64_t body = all.size() - kHead;
  std::memcpy(all.data() + kBodyAt, &body, sizeof body);
  Hasher hasher;
  hasher.bytes(all.data(), kChecksumAt).bytes(all.data() + kHead, body);
  const std::string digits = hasher.hex();
  std::memcpy(all.data() + kChecksumAt, digits.data(), std::min(digits.size(), kDigits));
  return all;
}

bool read_file(std::string_view bytes) {
  const auto checkpoint = read_checkpoint(scratch("checkpoint.bin", bytes), identity());
  if (!checkpoint) return false;
  expect(checkpoint->identity == identity(), "it belongs to this run");
  std::size_t size = 0;
  for (const CheckpointPart& part : checkpoint->parts) size += part.bytes.size();
  expect(size <= bytes.size(), "parts hold what the file has");
  return true;
}

bool read(std::string_view input) {
  // One in four as it is: what the checksum keeps out.
  if (!input.empty() && input.size() % 4 == 0) read_file(input);
  return read_file(sealed(input));
}

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  Checkpoint checkpoint{identity(), {}};
  for (const std::size_t size : {0u, 5u, 300u}) {
    const auto file = scratch("written.bin", "");
    checkpoint.parts.push_back({"part", std::vector<std::byte>(size, std::byte{7})});
    expect(write_checkpoint(file, checkpoint).has_value(), "a checkpoint is written");
    all.push_back(file_text(file));
  }
  return all;
}

}  // namespace

Target checkpoint() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
