// What a PLY file says that it holds, read before assimp reads it: that waits for rows which aren't
// there, and breaks on headers that it half understands.
#pragma once

#include <string_view>

#include "kernels/base/result.h"

namespace viscera {

/// Whether these bytes are a PLY file: a header of known lines, with vertices that have places, and
/// behind it as many rows, with lists as long, as it says. `name` begins the messages, which give
/// the line or the row. Indices aren't looked at.
Result<void> check_ply(std::string_view name, std::string_view bytes);

}  // namespace viscera
