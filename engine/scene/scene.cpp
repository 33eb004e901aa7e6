#include "engine/scene/scene.h"

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

}  // namespace viscera
