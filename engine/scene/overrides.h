// `--set key/path=value`: changes of a scene file from the command line.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine/scene/json_file.h"

namespace viscera {

/// Sets the value at `path`: keys, indices of lists, or names of a list's objects
/// ("organs/liver/tissue"), joined by '/'. Objects on the way that the file leaves out are made.
/// `value` is JSON, or else taken as text. Returns the path with indices ("organs/0/tissue").
Result<std::string> apply_override(Json& root, const std::string& path, const std::string& value);

}  // namespace viscera
