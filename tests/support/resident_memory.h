// What memory a process holds, for tests of what was said about it.
#pragma once

#include <malloc.h>

#include <fstream>
#include <string>

namespace viscera::test {

/// Memory of this process, now ("VmRSS") or at its greatest ("VmHWM") [bytes].
inline double resident(const std::string& kind) {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(kind)) return 1024.0 * std::stod(line.substr(kind.size() + 1));
  return 0.0;
}

/// From here the greatest is counted anew; false where the kernel doesn't.
inline bool forget_greatest() {
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
  return resident("VmHWM") < 1.02 * resident("VmRSS");
}

}  // namespace viscera::test
