// Small pictures of a surface, for pages about it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

/// Grey values of a square picture, rows from the top; 255 where there is nothing. Orthographic,
/// lit from the viewer; `right` and `up` are unit vectors of the picture.
std::vector<std::uint8_t> shaded_view(const TriangleSurface& surface, const Vec3& right,
                                      const Vec3& up, int pixels);

/// A grey picture as a data URI that pages can show (BMP).
std::string data_uri(const std::vector<std::uint8_t>& grey, int pixels);

}  // namespace viscera
