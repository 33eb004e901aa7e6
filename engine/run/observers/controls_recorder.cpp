#include "engine/run/observers/controls_recorder.h"

#include "engine/simulator/controls_file.h"

namespace viscera {

Result<void> ControlsRecorder::begin() {
  auto out = AtomicFile::create(file_);
  if (!out) return std::unexpected(out.error());
  out_.emplace(*std::move(out));
  out_->write(controls_header() + "\n");
  return {};
}

void ControlsRecorder::add_frame(const World& world) {
  std::vector<std::string> names;
  Controls controls;
  for (const Entity tool : world.model().instruments()) {
    names.push_back(world.find<InstrumentBody>(tool)->description.name);
    const InstrumentState& state = *world.find<InstrumentState>(tool);
    controls.tools.push_back({state.tip, state.jaw, state.power, state.blade});
  }
  out_->write(controls_rows(world.frame(), names, controls, world.model().steps().per_second));
}

Result<void> ControlsRecorder::close(const World&) {
  return out_->commit_lines();
}

Result<void> ControlsRecorder::save_state(ByteWriter& writer) {
  auto text = out_->content();
  if (!text) return std::unexpected(text.error());
  return save_whole(writer, *text);
}

Result<void> ControlsRecorder::load_state(ByteReader& reader) {
  std::string text;
  if (auto whole = load_whole(reader, text); !whole) return whole;
  auto out = AtomicFile::create(file_);
  if (!out) return std::unexpected(out.error());
  out_.emplace(*std::move(out));
  out_->write(text);
  return {};
}

}  // namespace viscera
