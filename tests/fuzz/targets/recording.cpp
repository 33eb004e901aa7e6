// A device's recording as CSV.
#include "engine/features/held_tools/haptic_recording.h"
#include "tests/fuzz/recordings.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

bool read(std::string_view input) {
  return is_recording(load_recording(scratch("hand.csv", input)));
}

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  for (const std::size_t samples : {0u, 1u, 3u}) {
    const auto file = scratch("written.csv", "");
    expect(save_recording(file, small_recording(samples)).has_value(), "a recording is written");
    all.push_back(file_text(file));
  }
  return all;
}

}  // namespace

Target recording() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
