// What a process may no longer do once it has looked at bytes of somebody else's.
#pragma once

#include <cstdint>
#include <filesystem>

namespace viscera {

/// From now on this process allocates at most `memory` [bytes], works for at most `seconds`, writes
/// no file and, where the kernel has Landlock and seccomp, reads files of `folder` alone, opens no
/// connection and starts nothing. It ends with its parent. What a kernel lacks is left out.
void confine(std::uintmax_t memory, double seconds, const std::filesystem::path& folder);

}  // namespace viscera
