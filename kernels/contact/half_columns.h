// The displacement part of a compliance in half precision: half the memory and half the traffic for
// C_un, which only moves the drawn surface. Forces come from C_nn, which stays single.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/contact/contact_cells.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// IEEE half-precision numbers under one scale, column-major as SurfaceCompliance::columns.
struct HalfColumns {
  std::size_t rows = 0;
  float scale = 1.0f;  ///< an entry is scale * its half-precision number [m/N]
  std::vector<std::uint16_t> entries;
  double error = 0.0;  ///< greatest |entry - original| over the greatest |original|; at most 2^-11
};

/// The nearest half-precision number to each entry, to even at ties; the greatest entry is put at
/// half the range, so that only entries 2^-29 of it and less lose digits. Parallel.
HalfColumns half_precision(const SurfaceCompliance& compliance);

/// The touchable places among themselves, renumbered, in single precision: all that PatchContact
/// reads, and all of the single-precision matrix that need be kept beside HalfColumns.
SurfaceCompliance force_part(const SurfaceCompliance& compliance);

/// place_displacements (deformation.h) from half-precision columns; sums in single precision. The
/// same digits on every machine, with or without instructions for half precision.
void place_displacements(const HalfColumns& columns, const ContactResponse& response,
                         std::vector<float>& displacements);

/// The nearest half-precision number, and back. Portable; what the fast paths must agree with.
std::uint16_t to_half(float value);
float from_half(std::uint16_t half);

}  // namespace viscera
