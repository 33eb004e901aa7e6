#include "engine/io/cache_quota.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

namespace viscera {
namespace fs = std::filesystem;
namespace {

constexpr std::time_t kMinute = 60, kDay = 86400;
constexpr double kBytesPerGigabyte = 1e9, kMostGigabytes = 1e6;
constexpr std::size_t kKeyDigits = 32;

/// The key of a file that the cache has written: KEY.h5, KEY.shape, KEY.factor or KEY.step.
std::optional<std::string> key_of(const fs::path& file) {
  const std::string stem = file.stem().string(), extension = file.extension().string();
  if (extension != ".h5" && extension != ".shape" && extension != ".factor" && extension != ".step")
    return {};
  if (stem.size() != kKeyDigits) return {};
  if (stem.find_first_not_of("0123456789abcdef") != std::string::npos) return {};
  return stem;
}

/// The process that writes KEY.EXTENSION.PROCESS-COUNT.tmp.
std::optional<pid_t> writer_of(const fs::path& file) {
  if (file.extension() != ".tmp") return {};
  const fs::path named = file.stem();
  if (!key_of(named.stem())) return {};
  const std::string middle = named.extension().string();
  pid_t process = 0;
  const char* const end = middle.data() + middle.size();
  const auto [rest, error] =
      std::from_chars(middle.data() + std::min<std::size_t>(1, middle.size()), end, process);
  if (error != std::errc() || process <= 0 || rest == end || *rest != '-') return {};
  return process;
}

bool lives(pid_t process) {
  return ::kill(process, 0) == 0 || errno != ESRCH;
}

struct Entry {
  std::vector<fs::path> files;
  std::uintmax_t bytes = 0;
  std::time_t used = 0;  // the last time of its files
};

/// Again as it is now: another process may have used or written it meanwhile.
bool used_since(const Entry& entry) {
  struct stat status = {};
  return std::ranges::any_of(entry.files, [&](const fs::path& file) {
    return ::stat(file.c_str(), &status) == 0 && status.st_mtime > entry.used;
  });
}

}  // namespace

CacheQuota cache_quota() {
  const char* const text = std::getenv("VISCERA_CACHE_GB");
  CacheQuota quota;
  if (!text || !*text) return quota;
  double gigabytes = -1.0;
  const char* const end = text + std::string_view(text).size();
  const auto [rest, error] = std::from_chars(text, end, gigabytes);
  if (error == std::errc() && rest == end && gigabytes >= 0.0 && gigabytes <= kMostGigabytes) {
    quota.bytes = static_cast<std::uintmax_t>(std::llround(kBytesPerGigabyte * gigabytes));
  } else {
    quota.warning = fmt::format(
        "VISCERA_CACHE_GB: found \"{}\", expected gigabytes from 0 to {:g}; {:g} are taken", text,
        kMostGigabytes, static_cast<double>(quota.bytes) / kBytesPerGigabyte);
  }
  return quota;
}

void mark_used(const fs::path& file) {
  ::utimensat(AT_FDCWD, file.c_str(), nullptr, 0);
}

void forget_least_used(const fs::path& folder, std::uintmax_t quota, std::time_t now) {
  std::map<std::string, Entry> by_key;
  std::error_code error;
  std::vector<fs::path> abandoned;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const fs::path& file = at->path();
    struct stat status = {};
    if (::lstat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    if (const auto writer = writer_of(file)) {
      if (!lives(*writer) || now - status.st_mtime > kDay) abandoned.push_back(file);
    } else if (const auto key = key_of(file)) {
      Entry& entry = by_key[*key];
      entry.files.push_back(file);
      entry.bytes += static_cast<std::uintmax_t>(status.st_size);
      entry.used = std::max(entry.used, status.st_mtime);
    }
  }
  std::error_code ignored;
  for (const fs::path& file : abandoned) fs::remove(file, ignored);

  std::uintmax_t bytes = 0;
  std::vector<const Entry*> oldest_first;
  for (const auto& [key, entry] : by_key) {
    bytes += entry.bytes;
    oldest_first.push_back(&entry);
  }
  std::ranges::stable_sort(oldest_first, {}, &Entry::used);
  for (const Entry* entry : oldest_first) {
    if (bytes <= quota || now - entry->used < kMinute) return;
    if (used_since(*entry)) continue;
    for (const fs::path& file : entry->files) fs::remove(file, ignored);
    bytes -= entry->bytes;
  }
}

}  // namespace viscera
