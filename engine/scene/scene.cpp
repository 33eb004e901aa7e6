#include "engine/scene/scene.h"

#include <algorithm>

namespace viscera {

bool Region::contains(const Vec3& x) const {
  switch (shape) {
    case Shape::kHalfSpace:
      return (x - a).dot(b) <= 0.0;
    case Shape::kSphere:
      return (x - a).squaredNorm() <= radius * radius;
    case Shape::kBox:
      return (x.array() >= a.array()).all() && (x.array() <= b.array()).all();
  }
  return false;
}

bool carries_current(const InstrumentDescription& tool) {
  return tool.kind == InstrumentKind::kHook &&
         std::any_of(tool.path.begin(), tool.path.end(),
                     [](const InstrumentKey& key) { return key.power > 0.0; });
}

}  // namespace viscera
