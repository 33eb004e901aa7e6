#include "engine/run/observers/force_curves.h"

#include "engine/run/observers/tip_samples.h"

namespace viscera {

ForceCurves::ForceCurves(const SceneDescription& scene) : Observer("forces") {
  for (const InstrumentDescription& tool : scene.instruments) names_.push_back(tool.name);
}

Result<void> ForceCurves::open(const std::filesystem::path& folder) {
  file_ = folder / "forces.csv";
  return {};
}

Result<void> ForceCurves::begin() {
  auto table = ForcesCsv::create(file_, names_);
  if (!table) return std::unexpected(table.error());
  table_.emplace(*std::move(table));
  return {};
}

void ForceCurves::add_frame(const World& world) {
  table_->add(world.time(), tip_samples(world));
}

Result<void> ForceCurves::close(const World&) {
  return table_->finish();
}

Result<void> ForceCurves::save_state(ByteWriter& writer) {
  auto text = table_->text();
  if (!text) return std::unexpected(text.error());
  return save_whole(writer, *text);
}

Result<void> ForceCurves::load_state(ByteReader& reader) {
  std::string text;
  if (auto whole = load_whole(reader, text); !whole) return whole;
  auto table = ForcesCsv::go_on(file_, text);
  if (!table) return std::unexpected(table.error());
  table_.emplace(*std::move(table));
  return {};
}

}  // namespace viscera
