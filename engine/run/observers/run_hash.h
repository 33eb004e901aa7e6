// The report's state_hash.
#pragma once

#include <string>

#include "engine/run/observer.h"
#include "engine/run/state_hash.h"

namespace viscera {

class RunHash : public Observer {
 public:
  RunHash() : Observer("hash") {}

  void add_frame(const World& world) override { hash_.add_frame(world); }
  Result<void> close(const World& world) override;
  void describe(const World& world, RunReport& report) const override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

 private:
  StateHash hash_;
  std::string finished_;
};

}  // namespace viscera
