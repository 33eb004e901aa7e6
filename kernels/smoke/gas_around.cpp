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
  eddies_.resize(positions.size());
  grid_.eddies(eddies_);
  for (std::size_t i = 0; i < positions.size(); ++i) velocities[i].w = eddies_[i];
}

void GasAround::excess(std::span<const Float4> positions, std::span<float> kelvin) {
  grid_.place(places(origin_, positions));
  grid_.excess(kelvin);
}

}  // namespace viscera
