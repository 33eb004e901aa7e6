#include "engine/scene/region.h"

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

Region Region::grown(double margin) const {
  Region larger = *this;
  switch (shape) {
    case Shape::kHalfSpace:
      larger.a += margin * b;
      break;
    case Shape::kSphere:
      larger.radius += margin;
      break;
    case Shape::kBox:
      larger.a.array() -= margin;
      larger.b.array() += margin;
      break;
  }
  return larger;
}

}  // namespace viscera
