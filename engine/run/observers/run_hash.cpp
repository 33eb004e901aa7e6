#include "engine/run/observers/run_hash.h"

namespace viscera {

Result<void> RunHash::close(const World& world) {
  finished_ = hash_.finish(world);
  return {};
}

void RunHash::describe(const World&, RunReport& report) const {
  report.state_hash = finished_;
}

Result<void> RunHash::save_state(ByteWriter& writer) {
  return save_whole(writer, hash_.save());
}

Result<void> RunHash::load_state(ByteReader& reader) {
  std::vector<std::byte> saved;
  if (auto whole = load_whole(reader, saved); !whole) return whole;
  if (!hash_.restore(saved)) return failure("expected a hash in the making");
  return {};
}

}  // namespace viscera
