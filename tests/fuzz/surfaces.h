// What the targets of surfaces share.
#pragma once

#include <string>
#include <string_view>

namespace viscera::fuzz {

/// Reads a surface from a file of this name: in this process, or by the child.
bool is_surface(const std::string& name, std::string_view input);
bool is_surface_by_child(const std::string& name, std::string_view input);

}  // namespace viscera::fuzz
