#include "engine/simulator/controls_file.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

const std::vector<std::string>& tools() {
  static const std::vector<std::string> names = {"hook", "holder"};
  return names;
}

bool read(std::string_view input) {
  const auto frames = read_controls(scratch("controls.csv", input), tools(), 60);
  if (!frames) {
    expect(!frames.error().messages.empty() && frames.error().messages.size() <= 20,
           "a refusal has 1 to 20 reasons");
    return false;
  }
  expect(!frames->empty(), "there are frames");
  for (const Controls& frame : *frames)
    expect(frame.tools.size() == tools().size(), "a frame has controls for every tool");
  return true;
}

std::vector<std::string> seeds() {
  Controls controls;
  controls.tools.resize(2);
  controls.tools[0].tip = Vec3(-0.042, 0.01, 1.0 / 3.0);
  controls.tools[0].power = 30.0;
  controls.tools[1].blade = true;
  std::string text = controls_header() + "\n";
  std::vector<std::string> all;
  for (std::uint64_t frame = 1; frame < 4; ++frame) {
    text += controls_rows(frame, tools(), controls, 60);
    all.push_back(text);
  }
  return all;
}

}  // namespace

Target controls() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
