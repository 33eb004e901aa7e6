// From bytes to a device's State, for devices behind one interface (device.h).
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "kernels/base/archive.h"

namespace viscera {

/// None: the bytes are too many, too few, or not of such an owner.
template <StateOwner Owner>
std::optional<typename Owner::State> state_in(std::span<const std::byte> bytes,
                                              const Owner& owner) {
  ByteReader reader(bytes);
  std::optional<typename Owner::State> state(std::in_place);
  read(reader, *state);
  if (reader.failed() || !reader.at_end() || !owner.fits(*state)) state.reset();
  return state;
}

}  // namespace viscera
