#include "engine/io/memory_limit.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>

namespace viscera {
namespace fs = std::filesystem;
namespace {

/// A control group's figure; none where the file is absent or says "max".
std::optional<std::uint64_t> figure_in(const fs::path& file) {
  std::ifstream in(file);
  std::uint64_t bytes = 0;
  if (in >> bytes) return bytes;
  return std::nullopt;
}

/// The least limit from that group up to the root of its hierarchy.
std::optional<std::uint64_t> least_above(const fs::path& hierarchy, fs::path group,
                                         const char* name) {
  std::optional<std::uint64_t> least;
  while (true) {
    const auto bytes = figure_in(hierarchy / group.relative_path() / name);
    if (bytes && (!least || *bytes < *least)) least = bytes;
    if (!group.has_relative_path()) return least;
    group = group.parent_path();
  }
}

/// Of the control group, of either version.
std::optional<std::uint64_t> group_limit(const fs::path& root) {
  std::optional<std::uint64_t> least;
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {  // NUMBER:CONTROLLERS:PATH
    std::istringstream fields(line);
    std::string number, controllers, path;
    if (!std::getline(fields, number, ':') || !std::getline(fields, controllers, ':') ||
        !std::getline(fields, path))
      continue;
    const fs::path system = root / "sys/fs/cgroup";
    std::optional<std::uint64_t> bytes;
    if (controllers.empty())
      bytes = least_above(system, path, "memory.max");
    else if (("," + controllers + ",").find(",memory,") != std::string::npos)
      bytes = least_above(system / "memory", path, "memory.limit_in_bytes");
    if (bytes && (!least || *bytes < *least)) least = bytes;
  }
  return least;
}

}  // namespace

std::uint64_t machine_memory() {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

MemoryLimit memory_limit(const fs::path& root) {
  MemoryLimit limit{machine_memory(), "this machine's memory"};
  const auto lower = [&](std::uint64_t bytes, const char* source) {
    if (bytes < limit.bytes) limit = {bytes, source};
  };
  if (const auto bytes = group_limit(root)) lower(*bytes, "the memory of its control group");
  for (const auto& [resource, source] :
       {std::pair(RLIMIT_AS, "ulimit -v"), std::pair(RLIMIT_DATA, "ulimit -d")}) {
    rlimit allowed = {};
    if (::getrlimit(resource, &allowed) == 0 && allowed.rlim_cur != RLIM_INFINITY)
      lower(allowed.rlim_cur, source);
  }
  return limit;
}

Result<void> MemoryBudget::check(std::uint64_t bytes, const std::string& subject,
                                 const std::string& change) const {
  if (bytes <= left()) return {};
  const auto gigabytes = [](std::uint64_t n) { return 1e-9 * static_cast<double>(n); };
  const std::string beside =
      kept_ > 0 ? fmt::format(" beside {:.1f} GB of what comes before", gigabytes(kept_)) : "";
  return failure(fmt::format(
      "found {} that need {:.1f} GB{}, expected at most {:.1f} GB, {:.0f} % "
      "of {}: {}",
      subject, gigabytes(bytes), beside, gigabytes(most()), 100.0 * kShare, limit_.source, change));
}

}  // namespace viscera
