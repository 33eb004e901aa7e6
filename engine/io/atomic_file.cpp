#include "engine/io/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

namespace viscera {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kBuffer = 1 << 16;

std::string reason(int error_number) {
  return std::generic_category().message(error_number);
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// Takes what it has written off the front of `bytes`. errno, or 0.
int write_all(int descriptor, std::string_view& bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

/// How many bytes of a file its whole lines have.
std::size_t bytes_of_whole_lines(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::size_t read = 0, whole = 0;
  std::vector<char> part(kBuffer);
  while (in.read(part.data(), static_cast<std::streamsize>(part.size())), in.gcount() > 0) {
    const std::string_view text(part.data(), static_cast<std::size_t>(in.gcount()));
    if (const std::size_t end = text.rfind('\n'); end != std::string_view::npos)
      whole = read + end + 1;
    read += text.size();
  }
  return whole;
}

/// A file that nobody else has, nor has laid a link in the place of.
int open_new(const PendingFile& pending) {
  const int exclusive = pending.in_place() ? 0 : O_CREAT | O_EXCL;
  return ::open(pending.temporary().c_str(), O_WRONLY | O_CLOEXEC | exclusive, 0666);
}

/// fsync by name: the library that wrote the file has closed its own descriptor. errno, or 0.
int sync_path(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int error = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  // Some file systems can't sync folders; that isn't a failure of the file.
  return error == EINVAL || error == EROFS ? 0 : error;
}

}  // namespace

Error write_error(const fs::path& file, int error_number) {
  std::string text = file.string() + ": can't be written: ";
  std::error_code ignored;
  if (error_number == ENOENT && !fs::exists(folder_of(file), ignored)) {
    text += "the folder " + folder_of(file).string() + " doesn't exist";
  } else {
    text += reason(error_number);
  }
  return Error(text);
}

PendingFile::PendingFile(fs::path file) : file_(std::move(file)) {
  std::error_code ignored;
  const fs::file_status status = fs::status(file_, ignored);
  if (fs::is_character_file(status) || fs::is_fifo(status) || fs::is_block_file(status)) {
    temporary_ = file_;
    return;
  }
  static std::atomic<unsigned> counter = 0;
  do {  // another process of this number may have left one behind
    temporary_ = file_;
    temporary_ += "." + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".tmp";
  } while (fs::exists(fs::symlink_status(temporary_, ignored)));
}

PendingFile::~PendingFile() {
  remove();
}

PendingFile::PendingFile(PendingFile&& other) noexcept
    : file_(std::move(other.file_)), temporary_(std::exchange(other.temporary_, {})) {}

PendingFile& PendingFile::operator=(PendingFile&& other) noexcept {
  if (this != &other) {
    remove();
    file_ = std::move(other.file_);
    temporary_ = std::exchange(other.temporary_, {});
  }
  return *this;
}

void PendingFile::remove() {
  std::error_code ignored;
  if (!temporary_.empty() && !in_place()) fs::remove(temporary_, ignored);
  temporary_.clear();
}

Result<void> PendingFile::commit(Durable durable) {
  if (in_place()) {
    temporary_.clear();
    return {};
  }
  int error = durable == Durable::kYes ? sync_path(temporary_) : 0;
  if (error == 0 && ::rename(temporary_.c_str(), file_.c_str()) != 0) error = errno;
  if (error != 0) {
    remove();
    return std::unexpected(write_error(file_, error));
  }
  temporary_.clear();
  if (durable == Durable::kYes) error = sync_path(folder_of(file_));
  if (error != 0) return std::unexpected(write_error(file_, error));
  return {};
}

AtomicFile::AtomicFile(PendingFile pending, int descriptor)
    : pending_(std::move(pending)), descriptor_(descriptor) {
  buffer_.reserve(kBuffer);
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : pending_(std::move(other.pending_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      error_(other.error_),
      buffer_(std::move(other.buffer_)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<AtomicFile> AtomicFile::create(const fs::path& file) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) return std::unexpected(write_error(file, EISDIR));
  PendingFile pending(file);
  const int descriptor = open_new(pending);
  if (descriptor < 0) return std::unexpected(write_error(file, errno));
  return AtomicFile(std::move(pending), descriptor);
}

void AtomicFile::write(const void* data, std::size_t size) {
  if (error_ != 0) return;
  std::string_view bytes(static_cast<const char*>(data), size);
  if (buffer_.size() + size > kBuffer) flush();
  if (error_ == 0 && size >= kBuffer) error_ = write_all(descriptor_, bytes);
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void AtomicFile::flush() {
  if (error_ != 0) return;
  std::string_view bytes(buffer_.data(), buffer_.size());
  error_ = write_all(descriptor_, bytes);
  buffer_.erase(buffer_.begin(), buffer_.end() - static_cast<std::ptrdiff_t>(bytes.size()));
}

Result<std::string> AtomicFile::content() {
  flush();
  if (error_ != 0) return std::unexpected(write_error(pending_.file(), error_));
  std::ifstream in(pending_.temporary(), std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in) return failure(pending_.temporary().string() + ": can't be read back");
  return text;
}

Result<void> AtomicFile::status() const {
  if (error_ != 0) return std::unexpected(write_error(pending_.file(), error_));
  return {};
}

Result<void> AtomicFile::commit(Durable durable) {
  flush();
  const bool closed = ::close(std::exchange(descriptor_, -1)) == 0;
  if (error_ == 0 && !closed) error_ = errno;
  if (error_ != 0) return std::unexpected(write_error(pending_.file(), error_));
  return pending_.commit(durable);
}

Result<void> AtomicFile::commit_lines(Durable durable) {
  error_ = 0;
  flush();
  if (error_ == 0 || pending_.in_place()) return commit(durable);
  const int error = error_;
  const auto whole = static_cast<off_t>(bytes_of_whole_lines(pending_.temporary()));
  const bool cut = whole > 0 && ::ftruncate(descriptor_, whole) == 0;
  ::close(std::exchange(descriptor_, -1));
  if (!cut) return std::unexpected(write_error(pending_.file(), error));
  if (auto kept = pending_.commit(durable); !kept) return kept;
  return failure(write_error(pending_.file(), error).text() + "; its lines up to there are kept");
}

Result<void> write_file(const fs::path& file, std::string_view content, Durable durable) {
  auto out = AtomicFile::create(file);
  if (!out) return std::unexpected(out.error());
  out->write(content);
  return out->commit(durable);
}

Result<void> check_out_folder(const fs::path& folder) {
  const std::string where = "--out " + folder.string() + ": ";
  if (folder.empty()) return failure("--out: expected the name of a folder, found nothing");
  std::error_code error;
  fs::create_directories(folder, error);
  std::error_code ignored;
  if (fs::exists(folder, ignored) && !fs::is_directory(folder, ignored)) {
    return failure(where + "expected a folder that files can be written to, found a file");
  }
  if (error) return failure(where + "the folder can't be created: " + error.message());
  const PendingFile probe(folder / "probe");
  const int descriptor = open_new(probe);
  if (descriptor < 0) return failure(where + "files can't be written to it: " + reason(errno));
  std::string_view word = "viscera";
  const int failed = write_all(descriptor, word);
  ::close(descriptor);
  if (failed != 0) return failure(where + "files can't be written to it: " + reason(failed));
  return {};
}

}  // namespace viscera
