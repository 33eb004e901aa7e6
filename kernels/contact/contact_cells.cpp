#include "kernels/contact/contact_cells.h"

#include <cmath>

namespace viscera {

bool is_sound(const ContactCell& cell) {
  return cell.position.allFinite() && cell.normal.allFinite() && cell.direction.allFinite() &&
         cell.displacement.allFinite() && cell.free.allFinite() && std::isfinite(cell.depth) &&
         std::isfinite(cell.area) && cell.area > 0.0 && cell.friction >= 0.0 &&
         std::isfinite(cell.friction) && std::isfinite(cell.bell) && cell.bell >= 0.0f;
}

ContactResponse merged(const ContactResponse& one, const ContactResponse& other) {
  ContactResponse sum;
  for (std::size_t i = 0, j = 0; i < one.touched.size() || j < other.touched.size();) {
    const bool first =
        j == other.touched.size() || (i < one.touched.size() && one.touched[i] <= other.touched[j]);
    const ContactResponse& from = first ? one : other;
    const std::size_t at = first ? i++ : j++;
    if (!sum.touched.empty() && sum.touched.back() == from.touched[at]) {
      sum.loads.back() += from.loads[at];
    } else {
      sum.touched.push_back(from.touched[at]);
      sum.loads.push_back(from.loads[at]);
    }
  }
  return sum;
}

}  // namespace viscera
