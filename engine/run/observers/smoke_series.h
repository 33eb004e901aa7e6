// smoke/NNNN.vdb: the smoke at every picture's time.
#pragma once

#include <string>

#include "engine/io/smoke_file.h"
#include "engine/run/observer.h"

namespace viscera {

/// A volume is written from the first smoke in it on; of several each has a folder of its name.
class SmokeSeries : public Observer {
 public:
  explicit SmokeSeries(std::string scene_name)
      : Observer("smoke", Looks::kWanted, RunStage::kWriteVolumes), scene_(std::move(scene_name)) {}

  Result<void> open(const std::filesystem::path& folder) override;
  Result<void> add_picture(FrameViews& views) override;
  Result<void> status() const override { return writer_.status(); }
  Result<void> close(const World& world) override;
  void describe(const World& world, RunReport& report) const override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

 private:
  struct State {
    std::uint64_t written = 0;
    double seconds = 0.0;  ///< spent on files
    static constexpr auto fields() {
      return std::tuple(field("written", &State::written), field("seconds", &State::seconds));
    }
  };
  State so_far() const;

  std::string scene_;
  std::filesystem::path folder_;
  State before_;  ///< of processes before this one
  SmokeWriter writer_;
};

}  // namespace viscera
