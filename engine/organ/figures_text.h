// Figures in words, for notes and warnings about an organ's surface.
#pragma once

#include <string>

#include "kernels/base/types.h"

namespace viscera {

/// Three significant digits.
std::string short_number(double value);
/// "2.5 mm" of metres.
std::string millimetres(double metres);
/// "(12.0, -3.5, 40.2 mm)" of metres.
std::string place_text(const Vec3& x);

}  // namespace viscera
