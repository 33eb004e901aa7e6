// A checkpoint on disk: named parts of bytes, and what they are of.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/result.h"

namespace viscera {

/// What must be the same where a checkpoint is taken up again. Texts, for people to compare.
struct CheckpointIdentity {
  std::string program;  ///< its version
  std::string scene;    ///< hash of the scene with its overrides
  std::string machine;  ///< of whose kind the numbers are
  std::string layout;   ///< hash of the layout of all parts
  static constexpr auto fields() {
    return std::tuple(field("program", &CheckpointIdentity::program),
                      field("scene", &CheckpointIdentity::scene),
                      field("machine", &CheckpointIdentity::machine),
                      field("layout", &CheckpointIdentity::layout));
  }
  bool operator==(const CheckpointIdentity&) const = default;
};

struct CheckpointPart {
  std::string name;  ///< used once
  std::vector<std::byte> bytes;
};

struct Checkpoint {
  CheckpointIdentity identity;
  std::vector<CheckpointPart> parts;

  /// Null: there is none of that name.
  const CheckpointPart* find(const std::string& name) const;
};

/// Written to a temporary name, brought to the disk and renamed: whenever a process or the power
/// goes, the last whole one is there.
Result<void> write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint);

/// Fails for a file that is absent, no checkpoint, cut off or damaged (a checksum covers all of
/// it), and for one of another identity, with each difference as found and expected.
Result<Checkpoint> read_checkpoint(const std::filesystem::path& file,
                                   const CheckpointIdentity& expected);

/// The kind of machine that this process runs on.
std::string machine_kind();

}  // namespace viscera
