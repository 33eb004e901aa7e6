#include "engine/simulator/controls_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>
#include <string_view>

#include "kernels/base/input_file.h"

namespace viscera {
namespace {

/// Bytes of a line, and of a file: an hour of twenty tools.
constexpr std::size_t kLongestLine = 1000;
constexpr std::uintmax_t kLargestFile = std::uintmax_t{1} << 30;
constexpr std::size_t kMostMistakes = 20;

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cells.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  return cells;
}

bool number_of(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// Of files of before.
constexpr std::string_view kHeaderWithoutBlade = "frame,tool,tip_x_m,tip_y_m,tip_z_m,jaw,power_W";
constexpr std::string_view kHeaderWithoutRate =
    "frame,tool,tip_x_m,tip_y_m,tip_z_m,jaw,power_W,blade";
constexpr std::uint64_t kRateOfBefore = 60;

std::size_t columns_of(std::string_view header) {
  return static_cast<std::size_t>(std::ranges::count(header, ',')) + 1;
}

std::string other_rate(std::string_view found, std::uint64_t expected) {
  return fmt::format(
      "found {:.40} frames a second, expected the scene's {}: record it anew, or "
      "--set steps_per_s=...",
      found, expected);
}

/// What is wrong with a row; empty: nothing, and `control` is what it says.
std::string mistake_in(std::string_view line, std::string_view header, std::uint64_t frame,
                       const std::string& tool, std::uint64_t rate, ToolControl& control) {
  const std::vector<std::string_view> cells = cells_of(line);
  const std::size_t columns = columns_of(header);
  if (cells.size() != columns)
    return fmt::format("found {} values, expected {}: {}", cells.size(), columns, header);
  if (cells[0] != fmt::format("{}", frame) || cells[1] != tool)
    return fmt::format("found frame and tool \"{:.40}\", \"{:.40}\", expected {}, \"{}\"", cells[0],
                       cells[1], frame, tool);
  double* const values[] = {&control.tip.x(), &control.tip.y(), &control.tip.z(), &control.jaw,
                            &control.power};
  for (std::size_t i = 0; i < 5; ++i)
    if (!number_of(cells[i + 2], *values[i]))
      return fmt::format("found \"{:.40}\", expected a number", cells[i + 2]);
  if (columns == 7) return {};
  if (cells[7] != "0" && cells[7] != "1")
    return fmt::format("found \"{:.40}\", expected 0 or 1", cells[7]);
  control.blade = cells[7] == "1";
  if (columns > 8 && cells[8] != fmt::format("{}", rate)) return other_rate(cells[8], rate);
  return {};
}

}  // namespace

std::string controls_header() {
  return std::string(kHeaderWithoutRate) + ",frames_per_s";
}

std::string controls_rows(std::uint64_t frame, const std::vector<std::string>& tools,
                          const Controls& controls, std::uint64_t frames_per_second) {
  std::string rows;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const ToolControl& one = controls.tools[i];
    rows += fmt::format("{},{},{},{},{},{},{},{},{}\n", frame, tools[i], one.tip.x(), one.tip.y(),
                        one.tip.z(), one.jaw, one.power, one.blade ? 1 : 0, frames_per_second);
  }
  return rows;
}

Result<std::vector<Controls>> read_controls(const std::filesystem::path& file,
                                            const std::vector<std::string>& tools,
                                            std::uint64_t frames_per_second) {
  const std::string name = file.string();
  if (tools.empty()) return failure(name + ": found a scene without tools, expected some to move");
  auto text = read_input(file, "recorded controls", kLargestFile);
  if (!text) return std::unexpected(text.error());
  std::istringstream in(*std::move(text));
  std::string line, header;
  if (!std::getline(in, header) || (header != controls_header() && header != kHeaderWithoutRate &&
                                    header != kHeaderWithoutBlade))
    return failure(
        fmt::format("{}:1: found another first line, expected {}", name, controls_header()));
  if (header != controls_header() && frames_per_second != kRateOfBefore)
    return failure(fmt::format(
        "{}:1: {}", name, other_rate("no frames_per_s, which stands for 60", frames_per_second)));
  std::vector<Controls> frames;
  Error mistakes;
  std::size_t row = 0;
  for (; std::getline(in, line) && mistakes.messages.size() < kMostMistakes; ++row) {
    const std::size_t tool = row % tools.size();
    if (tool == 0) frames.push_back({std::vector<ToolControl>(tools.size())});
    const std::string wrong =
        line.size() > kLongestLine
            ? "found a line of " + std::to_string(line.size()) + " bytes, expected a row"
            : mistake_in(line, header, frames.size(), tools[tool], frames_per_second,
                         frames.back().tools[tool]);
    if (!wrong.empty()) mistakes.messages.push_back(fmt::format("{}:{}: {}", name, row + 2, wrong));
  }
  if (mistakes.messages.empty() && row % tools.size() != 0)
    mistakes.messages.push_back(
        fmt::format("{}:{}: found the end within frame {}, expected {} tools", name, row + 2,
                    frames.size(), tools.size()));
  if (mistakes.messages.empty() && frames.empty())
    mistakes.messages.push_back(name + ":2: found the end, expected the first frame");
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return frames;
}

}  // namespace viscera
