#include "engine/render/strand_buffers.h"

#include <epoxy/gl.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace viscera {
namespace {

constexpr std::uint32_t kRings = 6, kSides = 7;

static_assert(sizeof(StrandHalf) == 13 * sizeof(float));

}  // namespace

StrandBuffers::StrandBuffers() {
  std::vector<std::array<float, 3>> rings;
  for (std::uint32_t ring = 0; ring < kRings; ++ring)
    for (std::uint32_t side = 0; side < kSides; ++side) {
      const double turn = 2.0 * std::numbers::pi * side / kSides;
      rings.push_back({static_cast<float>(ring) / (kRings - 1), static_cast<float>(std::cos(turn)),
                       static_cast<float>(std::sin(turn))});
    }
  std::vector<std::uint32_t> elements;
  for (std::uint32_t ring = 0; ring + 1 < kRings; ++ring)
    for (std::uint32_t side = 0; side < kSides; ++side) {
      const std::uint32_t a = ring * kSides + side, b = ring * kSides + (side + 1) % kSides;
      elements.insert(elements.end(), {a, b, b + kSides, a, b + kSides, a + kSides});
    }
  rings_.upload(std::span<const std::array<float, 3>>(rings));
  elements_.upload(std::span<const std::uint32_t>(elements));
  array_.attribute(0, rings_, 3, sizeof(std::array<float, 3>));
  array_.elements(elements_);
  constexpr std::size_t kStride = sizeof(StrandHalf);
  array_.attribute(1, halves_, 4, kStride, offsetof(StrandHalf, foot));
  array_.attribute(2, halves_, 4, kStride, offsetof(StrandHalf, reach));
  array_.attribute(3, halves_, 3, kStride, offsetof(StrandHalf, bend));
  array_.attribute(4, halves_, 2, kStride, offsetof(StrandHalf, seed));
  for (unsigned location = 1; location < 5; ++location)
    glVertexArrayBindingDivisor(array_.id(), location, 1);
}

void StrandBuffers::update(const BedView& view) {
  halves_.upload(view.halves);
  count_ = view.halves.size();
}

void StrandBuffers::draw() const {
  if (count_ == 0) return;
  glBindVertexArray(array_.id());
  glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(6 * (kRings - 1) * kSides),
                          GL_UNSIGNED_INT, nullptr, static_cast<GLsizei>(count_));
}

}  // namespace viscera
