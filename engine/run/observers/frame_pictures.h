// frames/NNNN.png: every picture by itself.
#pragma once

#include "engine/run/observer.h"

namespace viscera {

std::filesystem::path frame_file(const std::filesystem::path& run_folder, std::uint64_t number);

class FramePictures : public Observer {
 public:
  FramePictures() : Observer("frames", Looks::kWanted, RunStage::kEncode) {}

  Result<void> open(const std::filesystem::path& folder) override;
  Result<void> add_picture(FrameViews& views) override;
  void describe(const World& world, RunReport& report) const override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

 private:
  std::filesystem::path folder_;
  std::uint64_t pictures_ = 0;
};

}  // namespace viscera
