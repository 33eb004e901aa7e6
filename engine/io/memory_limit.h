// How much memory a command may take: of the machine, its control group and ulimit the least.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "kernels/base/result.h"

namespace viscera {

struct MemoryLimit {
  std::uint64_t bytes = 0;
  std::string source;  ///< "this machine's memory", "the memory of its control group", "ulimit -v"
};

std::uint64_t machine_memory();

/// Of this process. `root`: where /proc and /sys lie; another one in tests.
MemoryLimit memory_limit(const std::filesystem::path& root = "/");

/// What a command sets aside before it begins, part after part.
class MemoryBudget {
 public:
  /// Of the limit; chosen by eye: the rest is left to what isn't counted and to others.
  static constexpr double kShare = 0.8;

  explicit MemoryBudget(MemoryLimit limit = memory_limit()) : limit_(std::move(limit)) {}

  /// Stays to the command's end.
  void keep(std::uint64_t bytes) { kept_ += bytes; }
  std::uint64_t left() const { return most() > kept_ ? most() - kept_ : 0; }
  /// So much more beside what is kept, for a while or to the end. Fails, with what to change
  /// ("raise finest_spacing_mm"), as "found SUBJECT that need 3.1 GB beside 1.2 GB of what comes
  /// before, expected at most 4.0 GB, 80 % of this machine's memory: CHANGE".
  Result<void> check(std::uint64_t bytes, const std::string& subject,
                     const std::string& change) const;

 private:
  std::uint64_t most() const {
    return static_cast<std::uint64_t>(kShare * static_cast<double>(limit_.bytes));
  }

  MemoryLimit limit_;
  std::uint64_t kept_ = 0;
};

}  // namespace viscera
