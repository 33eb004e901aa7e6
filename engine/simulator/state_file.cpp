#include "engine/simulator/state_file.h"

#include "engine/simulation/feature.h"

namespace viscera {

Result<void> check_savable(const World& world) {
  for (const Feature& feature : world.model().features())
    if (feature.unsavable)
      if (const std::string why = feature.unsavable(world); !why.empty())
        return failure("state: found " + why + ", expected a simulation that can be rolled back");
  return {};
}

CheckpointIdentity identity_of(const World& world, const std::string& computing) {
  Hasher layout;
  layout.text(world.state_layout());
  return {.program = VISCERA_VERSION,
          .scene = world.model().scene().source,
          .machine = machine_kind() + ", computing on " + computing,
          .layout = layout.hex()};
}

Result<void> save_state_file(const std::filesystem::path& file, const World& world) {
  if (auto savable = check_savable(world); !savable) return savable;
  return write_checkpoint(file, {identity_of(world), {{kWorldPart, world.save_state()}}});
}

Result<void> load_state_file(const std::filesystem::path& file, World& world) {
  const auto checkpoint = read_checkpoint(file, identity_of(world));
  if (!checkpoint) return std::unexpected(checkpoint.error());
  const CheckpointPart* part = checkpoint->find(kWorldPart);
  if (!part) return failure(file.string() + ": found no state of a simulation, expected one");
  return world.load_state(part->bytes);
}

}  // namespace viscera
