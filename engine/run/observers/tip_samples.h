// Where each instrument's tip is and what it feels: what curves, review and tables show.
#pragma once

#include <vector>

#include "engine/io/forces_csv.h"
#include "engine/simulation/world.h"

namespace viscera {

/// One an instrument, in the scene's order.
inline std::vector<TipSample> tip_samples(const World& world) {
  std::vector<TipSample> samples(world.all<InstrumentState>().size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = {world.all<InstrumentState>()[i].tip, world.all<InstrumentContact>()[i].force};
  return samples;
}

}  // namespace viscera
