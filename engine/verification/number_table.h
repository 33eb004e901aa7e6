// Tables of numbers as reference answers are kept: comma separated, one line of headings.
#pragma once

#include <filesystem>
#include <vector>

#include "kernels/base/result.h"

namespace viscera {

/// Fails, naming file and line, where a row hasn't so many numbers.
Result<std::vector<std::vector<double>>> read_number_table(const std::filesystem::path& path,
                                                           std::size_t columns);

}  // namespace viscera
