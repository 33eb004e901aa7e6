// A burn in a piece of liver with all that heat can do: boiling, charring, a cooling surface,
// blood.
#pragma once

#include <cmath>
#include <string>

#include "engine/verification/heat_solutions.h"
#include "kernels/base/hash.h"

namespace viscera {

inline constexpr double kPictureTime = 1.0 / 60.0;

/// An organ that fills the space below z = 0.3 mm.
inline SignedDistance half_space() {
  return [](const Vec3& p) { return p.z() - 0.3e-3; };
}

inline void burn(Bioheat& heat, double power, double seconds) {
  for (int step = 0; step < std::lround(seconds / kPictureTime); ++step) {
    heat_gaussian(heat, Vec3(0.4e-3, 0.1e-3, -0.5e-3), 0.6e-3, power);
    heat.step(kPictureTime);
  }
}

inline void wait(Bioheat& heat, double seconds, double dt = kPictureTime) {
  for (int step = 0; step < std::lround(seconds / dt); ++step) heat.step(dt);
}

/// Every bit of the fields, the book and the last vapour.
inline std::string state_of(const Bioheat& heat) {
  Hasher hasher;
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
    const HeatBrick& brick = heat.bricks().brick(b);
    for (const int index : brick.index) hasher.value(index);
    for (const HeatBrick::Values* field :
         {&brick.water, &brick.charred, &brick.dose, &brick.coagulation, &brick.collagen})
      hasher.array<float>(*field);
    if (brick.warm) hasher.array<float>(brick.warm->excess);
  }
  const HeatBook book = heat.book();
  for (const double entry : {book.delivered, book.latent, book.perfused, book.gas, book.boundary})
    hasher.value(entry);
  for (const Vapour& one : heat.vapour()) hasher.value(one.water);
  return hasher.hex();
}

}  // namespace viscera
