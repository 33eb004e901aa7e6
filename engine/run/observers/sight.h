// How long smoke hides the tips from the lens, and how much it takes from the whole view.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/run/observer.h"

namespace viscera {

class Sight : public Observer {
 public:
  Sight() : Observer("sight", Looks::kAlways, RunStage::kSplatSmoke) {}

  Result<void> add_picture(FrameViews& views) override;
  /// Adds the time in smoke to "smoke" and "trainee", and the view's transmittance to "smoke".
  void describe(const World& world, RunReport& report) const override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

  /// Share of the looks at which less than half of the light came through.
  std::optional<double> time_in_smoke() const;

 private:
  struct State {
    std::uint64_t looks = 0, hidden = 0;
    std::optional<double> least, last;  // of the view's transmittance
    static constexpr auto fields() {
      return std::tuple(field("looks", &State::looks), field("hidden", &State::hidden),
                        field("least", &State::least), field("last", &State::last));
    }
  };
  State state_;
};

}  // namespace viscera
