// Inputs as files, for parsers that are given names.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace viscera::fuzz {

/// Writes the bytes to a file of this name in a folder of this process's own, in the place of the
/// one before; the folder goes with the process.
std::filesystem::path scratch(const std::string& name, std::string_view bytes);

/// A file or folder of the project, by its path from the top.
std::filesystem::path project_file(const std::string& path);

std::string bytes_of_file(const std::filesystem::path& file);

}  // namespace viscera::fuzz
