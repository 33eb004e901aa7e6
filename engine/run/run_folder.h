// The folder that a run writes to: whose it is, what of an older run is in it, and that no other
// run writes to it meanwhile.
#pragma once

#include <array>
#include <filesystem>
#include <utility>

#include "kernels/base/result.h"

namespace viscera {

/// Where a run keeps what it needs to be taken up again.
inline constexpr const char* kCheckpointName = "checkpoint.bin";

/// Held by one run at a time, from take() until the object or the process ends, however it ends.
/// Keeps room on the disk, without which a run that has filled it could end nothing properly.
class RunFolder {
 public:
  /// Makes the folder where need be. Refuses, with nothing in it changed, one that can't be written
  /// to, one that holds files of a run's names which no run of ours has written, and one that
  /// another run holds.
  static Result<RunFolder> take(const std::filesystem::path& out);
  ~RunFolder();
  RunFolder(RunFolder&& other) noexcept;
  RunFolder& operator=(RunFolder&&) = delete;

  const std::filesystem::path& path() const { return path_; }

  /// A run begins here: files of an older one go all together, so that no frame of one mixes with
  /// the other's. What says that the older one was whole, or could go on, goes first.
  void clear();
  /// A run goes on here, with the files that are there but those that a kill has cut off.
  void keep();

  /// What the room is kept for: the ends of all other files, and the report after them.
  enum class Room { kFiles, kReport };
  /// Takes the room. Fails where there isn't as much.
  Result<void> reserve();
  /// Gives it to whoever writes next.
  void release(Room room);

  /// Everything that was written to the folder's file system is on the disk. Fails where the disk
  /// didn't take it.
  Result<void> sync() const;

 private:
  RunFolder(std::filesystem::path path, int lock, bool marked)
      : path_(std::move(path)), lock_(lock), ours_(marked) {}

  std::filesystem::path path_;
  int lock_;                             ///< descriptor of the marker; negative: moved from
  bool ours_;                            ///< the marker stays
  std::array<int, 2> rooms_ = {-1, -1};  ///< descriptors of files without a name, by Room
};

}  // namespace viscera
