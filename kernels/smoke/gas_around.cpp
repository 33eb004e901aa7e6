#include "kernels/smoke/gas_around.h"

namespace viscera {
namespace {

template <class Number, class Vector>
StridedVectors<Number> components(std::span<Vector> vectors) {
  StridedVectors<Number> view;
  if (vectors.empty()) return view;
  view.x = &vectors.front().x;
  view.y = &vectors.front().y;
  view.z = &vectors.front().z;
  view.stride = sizeof(Float4) / sizeof(float);
  view.size = vectors.size();
  return view;
}

GasPoints places(const Vec3& origin, std::span<const Float4> positions) {
  return {origin, components<const float>(positions)};
}

}  // namespace

void GasAround::velocity(std::span<const Float4> positions, std::span<Float4> velocities) {
  grid_.place(places(origin_, positions));
  grid_.velocity(components<float>(velocities));
}

void GasAround::couple(std::span<const float> exchanged, std::span<float> theta) {
  grid_.couple(exchanged, theta);
}

void GasAround::add_momentum(std::span<const Float4> impulses) {
  grid_.add_momentum(components<const float>(impulses));
}

}  // namespace viscera
