// Inputs as files, for parsers that are given names.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "tests/support/paths.h"

namespace viscera::fuzz {

using test::file_text;
using test::project_file;

/// Writes the bytes to a file of this name in a folder of this process's own, in the place of the
/// one before; the folder goes with the process.
std::filesystem::path scratch(const std::string& name, std::string_view bytes);

}  // namespace viscera::fuzz
