#include "engine/run/state_hash.h"

#include "kernels/base/archive.h"

namespace viscera {

void StateHash::add_frame(const World& world) {
  hasher_.value(world.tick());
  for (const Entity tool : world.model().instruments()) {
    write(hasher_, world.find<InstrumentState>(tool)->tip);
    write(hasher_, world.find<InstrumentContact>(tool)->force);
  }
}

std::string StateHash::finish(const World& world) {
  hasher_.text(world.state_hash());
  return hasher_.hex();
}

}  // namespace viscera
