// passes/NNNN.exr: the ground truth of every picture.
#pragma once

#include <set>
#include <string>

#include "engine/features/smoke/smoke_keys.h"
#include "engine/run/observer.h"
#include "engine/run/observers/pass_writer.h"

namespace viscera {

class PassSeries : public StatelessObserver {
 public:
  PassSeries(const SceneDescription& scene, std::set<Pass> passes)
      : StatelessObserver("passes", Looks::kWanted, RunStage::kEncode),
        scene_(scene.name),
        with_smoke_(!smoke_of(scene).empty()),
        writer_(std::move(passes)) {}

  Result<void> open(const std::filesystem::path& folder) override;
  Result<void> add_picture(FrameViews& views) override;
  Result<void> status() const override { return writer_.status(); }
  Result<void> close(const World& world) override;
  Result<void> save_state(ByteWriter& writer) override;

 private:
  std::string scene_;
  bool with_smoke_;
  std::filesystem::path folder_;
  PassWriter writer_;
};

}  // namespace viscera
