// forces.csv: a row a frame.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/io/forces_csv.h"
#include "engine/run/observer.h"
#include "engine/scene/scene.h"

namespace viscera {

class ForceCurves : public Observer {
 public:
  explicit ForceCurves(const SceneDescription& scene);

  Result<void> open(const std::filesystem::path& folder) override;
  Result<void> begin() override;
  void add_frame(const World& world) override;
  Result<void> status() const override { return table_->status(); }
  Result<void> close(const World& world) override;
  /// The rows themselves: what a killed run has left of its file isn't asked.
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

 private:
  std::vector<std::string> names_;
  std::filesystem::path file_;
  std::optional<ForcesCsv> table_;
};

}  // namespace viscera
