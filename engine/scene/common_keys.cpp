#include "engine/scene/common_keys.h"

#include <cmath>

namespace viscera {
namespace {

ObjectCheck corners_in_order() {
  return {{"min_mm", "max_mm"},
          [](const Json& box) -> Finding {
            for (int i = 0; i < 3; ++i) {
              if (component(box["min_mm"], i) < component(box["max_mm"], i)) continue;
              return {{"max_mm", "found " + box["max_mm"].dump() + ", expected each component " +
                                     "above that of min_mm " + box["min_mm"].dump()}};
            }
            return {};
          },
          nullptr};
}

}  // namespace

double component(const Json& vector, int i) {
  return vector[i].get<double>();
}

double distance(const Json& a, const Json& b) {
  return std::hypot(component(a, 0) - component(b, 0), component(a, 1) - component(b, 1),
                    component(a, 2) - component(b, 2));
}

KeySpec position(std::string name, std::string description) {
  return vector(std::move(name), std::move(description)).between(-kFarthest_mm, kFarthest_mm);
}

ObjectCheck has_direction(std::string name) {
  return {{name},
          [name](const Json& values) -> Finding {
            const Json& found = values[name];
            if (distance(found, Json{0, 0, 0}) > 1e-9) return {};
            return {{name, "found " + found.dump() + ", expected a direction"}};
          },
          nullptr};
}

ObjectSpec box(std::string description) {
  return {std::move(description),
          {position("min_mm", "Least corner.").needed(),
           position("max_mm", "Greatest corner.").needed()},
          {},
          {corners_in_order()}};
}

}  // namespace viscera
