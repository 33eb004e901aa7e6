// Keeps the cache of prepared organs below a size: what was used last stays.
#pragma once

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <string>

namespace viscera {

/// $VISCERA_CACHE_GB, else 5.
struct CacheQuota {
  std::uintmax_t bytes = 5'000'000'000;
  std::string warning;  ///< what was found in place of a number, and what is done about it
};
CacheQuota cache_quota();

/// Notes that an entry was used now. `file`: one of its files.
void mark_used(const std::filesystem::path& file);

/// Forgets entries until those that are left fit, the least recently used first. The files of one
/// key are one entry and go together. An entry that somebody used within the last minute stays
/// whatever the quota: another process may be reading it. Goes along with any number of processes
/// that do the same. Removes temporary files whose process is gone, or that are older than a day.
/// Other files in the folder aren't touched. `now`: in seconds, as the file system counts.
void forget_least_used(const std::filesystem::path& folder, std::uintmax_t quota,
                       std::time_t now = std::time(nullptr));

}  // namespace viscera
