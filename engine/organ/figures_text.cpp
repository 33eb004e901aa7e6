#include "engine/organ/figures_text.h"

#include <cstdio>

namespace viscera {

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string millimetres(double metres) {
  return short_number(1e3 * metres) + " mm";
}

std::string place_text(const Vec3& x) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.1f, %.1f, %.1f mm)", 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
  return text;
}

}  // namespace viscera
