#include "engine/run/run_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/io/atomic_file.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

/// Marks a folder as a run's, whose files a later run may replace; the run that writes to it holds
/// a lock on this file. The kernel lets go of that when a process ends, by SIGKILL too.
constexpr const char* kMarker = ".viscera-run";

/// Enough for an encoder's last frames, buffered rows, the profile and the page of a long run; and
/// for a report of hundreds of organs.
constexpr off_t kRoomForFiles = 4 << 20, kRoomForReport = 1 << 18;

/// Numbered files of an older run in a folder and the folders right under it.
std::vector<fs::path> numbered_files(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error), end;
  for (; !error && entry != end; entry.increment(error)) {
    if (entry.depth() >= 1) entry.disable_recursion_pending();
    const std::string stem = entry->path().stem().string();
    if (entry->path().extension() == extension &&
        stem.find_first_not_of("0123456789") == std::string::npos)
      files.push_back(entry->path());
  }
  return files;
}

bool is_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// NAME.PROCESS-COUNT.tmp: a PendingFile that its process hasn't lived to finish.
bool is_abandoned(const fs::path& file) {
  if (file.extension() != ".tmp") return false;
  const std::string middle = file.stem().extension().string();
  const std::size_t dash = middle.find('-');
  return dash != std::string::npos && is_number(std::string_view(middle).substr(1, dash - 1)) &&
         is_number(std::string_view(middle).substr(dash + 1));
}

/// Who holds the folder is alone in it: nobody is at work on these any more.
void remove_abandoned(const fs::path& out) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(out, error), end; !error && entry != end;
       entry.increment(error))
    if (is_abandoned(entry->path())) files.push_back(entry->path());
  for (const char* folder : {"frames", "smoke", "vtk", "passes"}) {
    fs::recursive_directory_iterator entry(out / folder, error), end;
    for (; !error && entry != end; entry.increment(error))
      if (is_abandoned(entry->path())) files.push_back(entry->path());
  }
  std::error_code ignored;
  for (const fs::path& file : files) fs::remove(file, ignored);
}

/// What a run writes and a later run into the same folder replaces. In the order in which they go:
/// without the report the rest doesn't look whole, without the checkpoint nobody goes on with it.
std::vector<fs::path> older_files(const fs::path& out) {
  std::vector<fs::path> files;
  for (const char* name : {"report.json", kCheckpointName, "review.html", "vtk/organs.pvd",
                           "film.mp4", "forces.csv", "lesion.csv", "lesion.svg", "profile.json"}) {
    std::error_code error;
    if (fs::is_regular_file(out / name, error)) files.push_back(out / name);
  }
  for (const auto& [folder, extension] :
       {std::pair("frames", ".png"), {"smoke", ".vdb"}, {"vtk", ".vtu"}, {"passes", ".exr"}}) {
    const std::vector<fs::path> some = numbered_files(out / folder, extension);
    files.insert(files.end(), some.begin(), some.end());
  }
  return files;
}

/// A file that has no name any more and goes with its descriptor. Takes as much as a file of this
/// process may hold. errno, or 0.
int take_room(const fs::path& out, off_t bytes, int& descriptor) {
  const PendingFile name(out / "room");
  descriptor = ::open(name.temporary().c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0) return errno;
  ::unlink(name.temporary().c_str());
  rlimit limit = {};
  if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur < static_cast<rlim_t>(bytes))
    bytes = static_cast<off_t>(limit.rlim_cur);
  const int error = bytes > 0 ? ::posix_fallocate(descriptor, 0, bytes) : 0;
  return error == EOPNOTSUPP || error == EINVAL ? 0 : error;  // devices and some file systems
}

std::string megabytes(double bytes) {
  return fmt::format("{:.1f} MB", 1e-6 * bytes);
}

/// Locks the marker, which is made where it's absent. A run that ends before it begins takes its
/// marker away: whoever has opened that one meanwhile finds that it isn't the folder's any more.
Result<int> lock_marker(const fs::path& out) {
  const fs::path marker = out / kMarker;
  while (true) {
    const int lock = ::open(marker.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock < 0) return std::unexpected(write_error(marker, errno));
    if (::flock(lock, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      ::close(lock);
      if (error == EINTR) continue;
      if (error != EWOULDBLOCK) return std::unexpected(write_error(marker, error));
      return failure(fmt::format(
          "--out {}: found another run that is writing to it, expected a folder of its own for "
          "each run, or that one to have ended",
          out.string()));
    }
    struct stat held = {}, there = {};
    if (::fstat(lock, &held) == 0 && ::stat(marker.c_str(), &there) == 0 &&
        held.st_ino == there.st_ino && held.st_dev == there.st_dev)
      return lock;
    ::close(lock);
  }
}

}  // namespace

Result<RunFolder> RunFolder::take(const fs::path& out) {
  if (auto writable = check_out_folder(out); !writable) return std::unexpected(writable.error());
  std::error_code error;
  const bool marked = fs::exists(out / kMarker, error);
  if (!marked)
    if (const std::vector<fs::path> others = older_files(out); !others.empty())
      return failure(
          fmt::format("--out {}: found {}, which no run of this program has written, expected "
                      "an empty folder or one of an older run",
                      out.string(), others.front().string()));
  auto lock = lock_marker(out);
  if (!lock) return std::unexpected(lock.error());
  return RunFolder(out, *lock, marked);
}

RunFolder::RunFolder(RunFolder&& other) noexcept
    : path_(std::move(other.path_)),
      lock_(std::exchange(other.lock_, -1)),
      ours_(other.ours_),
      rooms_(std::exchange(other.rooms_, {-1, -1})) {}

RunFolder::~RunFolder() {
  release(Room::kFiles);
  release(Room::kReport);
  if (lock_ < 0) return;
  std::error_code ignored;
  if (!ours_) fs::remove(path_ / kMarker, ignored);
  ::close(lock_);
}

void RunFolder::clear() {
  ours_ = true;
  std::error_code ignored;
  for (const fs::path& file : older_files(path_)) fs::remove(file, ignored);
  remove_abandoned(path_);
}

void RunFolder::keep() {
  ours_ = true;
  remove_abandoned(path_);
}

Result<void> RunFolder::reserve() {
  int error = take_room(path_, kRoomForFiles, rooms_[static_cast<std::size_t>(Room::kFiles)]);
  if (error == 0)
    error = take_room(path_, kRoomForReport, rooms_[static_cast<std::size_t>(Room::kReport)]);
  if (error == 0) return {};
  release(Room::kFiles);
  release(Room::kReport);
  if (error != ENOSPC && error != EDQUOT)
    return std::unexpected(write_error(path_ / "room", error));
  struct statvfs disk = {};
  ::statvfs(path_.c_str(), &disk);
  return failure(fmt::format(
      "--out {}: found room for {}, expected at least {}, which a run needs to end properly when "
      "its disk is full",
      path_.string(),
      megabytes(static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize)),
      megabytes(static_cast<double>(kRoomForFiles + kRoomForReport))));
}

void RunFolder::release(Room room) {
  int& descriptor = rooms_[static_cast<std::size_t>(room)];
  if (descriptor >= 0) ::close(std::exchange(descriptor, -1));
}

Result<void> RunFolder::sync() const {
  // One call for all files: a call each waits for the disk as many times.
  if (::syncfs(lock_) != 0) return std::unexpected(write_error(path_, errno));
  return {};
}

}  // namespace viscera
