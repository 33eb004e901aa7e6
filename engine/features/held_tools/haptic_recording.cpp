#include "engine/features/held_tools/haptic_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "engine/io/atomic_file.h"
#include "engine/io/cache_file.h"
#include "engine/io/foreign_files.h"
#include "kernels/base/input_file.h"

namespace viscera {
namespace fs = std::filesystem;

namespace {

constexpr int kFormat = 1;
constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 30;
constexpr const char* kTitle = "viscera haptic recording";
constexpr std::string_view kColumns =
    "time_s,x_m,y_m,z_m,qw,qx,qy,qz,buttons,sample,connected,fx_N,fy_N,fz_N";
constexpr std::size_t kNumbers = 14;  // in a row
using Row = std::array<double, kNumbers>;
constexpr double kExactInteger = 9007199254740992.0;  // 2^53

struct LimitName {
  const char* name;
  double DeviceLimits::*value;
};
constexpr std::array<LimitName, 7> kLimits = {
    {{"peak_force_N", &DeviceLimits::peak_force},
     {"continuous_force_N", &DeviceLimits::continuous_force},
     {"resolution_m", &DeviceLimits::resolution},
     {"apparent_mass_kg", &DeviceLimits::apparent_mass},
     {"friction_N", &DeviceLimits::friction},
     {"stiffness_N_per_m", &DeviceLimits::stiffness},
     {"stale_after_s", &DeviceLimits::stale_after}}};

/// Numbers of the header, in its order: dt, work space, limits.
std::vector<double> header_numbers(const HapticRecording& recording) {
  const Box& box = recording.limits.work_space;
  std::vector<double> numbers = {recording.dt,  box.min().x(), box.min().y(), box.min().z(),
                                 box.max().x(), box.max().y(), box.max().z()};
  for (const LimitName& limit : kLimits) numbers.push_back(recording.limits.*limit.value);
  return numbers;
}

/// What is wrong with the header's numbers; nothing where they are a device's.
std::optional<std::string> take_header(std::span<const double> numbers,
                                       HapticRecording& recording) {
  for (const double number : numbers)
    if (!std::isfinite(number)) return "expected finite numbers in the header";
  recording.dt = numbers[0];
  recording.limits.work_space =
      Box(Vec3(numbers[1], numbers[2], numbers[3]), Vec3(numbers[4], numbers[5], numbers[6]));
  for (std::size_t i = 0; i < kLimits.size(); ++i)
    recording.limits.*kLimits[i].value = numbers[7 + i];
  if (recording.dt <= 0.0) return fmt::format("expected dt_s above 0, found {}", recording.dt);
  if (recording.limits.work_space.isEmpty()) return "expected a work space, found an empty box";
  for (const LimitName& limit : kLimits) {
    const double value = recording.limits.*limit.value;
    const bool may_be_zero = limit.value == &DeviceLimits::friction;
    if (value < 0.0 || (value == 0.0 && !may_be_zero))
      return fmt::format("expected {} above 0, found {}", limit.name, value);
  }
  return std::nullopt;
}

Row row_of(const HapticSample& sample) {
  const Vec3& p = sample.state.pose.position;
  const Quaternion& q = sample.state.pose.orientation;
  return {sample.time,
          p.x(),
          p.y(),
          p.z(),
          q.w(),
          q.x(),
          q.y(),
          q.z(),
          static_cast<double>(sample.state.buttons),
          static_cast<double>(sample.state.sample),
          sample.state.connected ? 1.0 : 0.0,
          sample.force.x(),
          sample.force.y(),
          sample.force.z()};
}

/// What is wrong with a row; nothing where it was added.
std::optional<std::string> take_row(const Row& row, HapticRecording& recording) {
  static const std::array<std::string_view, kNumbers> names = {
      "time_s", "x_m",     "y_m",    "z_m",       "qw",   "qx",   "qy",
      "qz",     "buttons", "sample", "connected", "fx_N", "fy_N", "fz_N"};
  for (std::size_t i = 0; i < kNumbers; ++i)
    if (!std::isfinite(row[i]))
      return fmt::format("expected a finite {}, found {}", names[i], row[i]);
  const auto whole = [](double value, double most) {
    return value >= 0.0 && value <= most && value == std::floor(value);
  };
  if (!whole(row[8], 4294967295.0))
    return fmt::format("expected 32 buttons' bits, found {}", row[8]);
  if (!whole(row[9], kExactInteger))
    return fmt::format("expected a whole sample number, found {}", row[9]);
  if (row[10] != 0.0 && row[10] != 1.0)
    return fmt::format("expected connected to be 0 or 1, found {}", row[10]);
  HapticSample sample;
  sample.time = row[0];
  sample.state.pose.position = Vec3(row[1], row[2], row[3]);
  sample.state.pose.orientation = Quaternion(row[4], row[5], row[6], row[7]);
  sample.state.buttons = static_cast<std::uint32_t>(row[8]);
  sample.state.sample = static_cast<std::uint64_t>(row[9]);
  sample.state.connected = row[10] == 1.0;
  sample.force = Vec3(row[11], row[12], row[13]);
  const double length = sample.state.pose.orientation.norm();
  if (std::abs(length - 1.0) > 1e-3)
    return fmt::format("expected a quaternion of length 1, found {:.4g}", length);
  if (!recording.samples.empty() && sample.time <= recording.samples.back().time) {
    return fmt::format("expected time to rise, found {} s after {} s", sample.time,
                       recording.samples.back().time);
  }
  recording.samples.push_back(sample);
  return std::nullopt;
}

/// Splits at the separator and reads numbers; fewer than asked for where one is none.
std::size_t read_numbers(std::string_view text, char separator, std::span<double> out) {
  std::size_t count = 0;
  const char *at = text.data(), *const end = at + text.size();
  while (count < out.size()) {
    const auto [rest, error] = std::from_chars(at, end, out[count]);
    if (error != std::errc()) return count;
    ++count;
    if (rest == end) return count;
    if (*rest != separator) return count - 1;
    at = rest + 1;
  }
  return count + 1;  // something is left
}

/// The lines of a CSV recording, one after the other, with their numbers for messages.
class CsvReader {
 public:
  CsvReader(std::string name, std::string_view text) : name_(std::move(name)), text_(text) {}

  Result<HapticRecording> read() {
    HapticRecording recording;
    if (!next() || line_ != fmt::format("# {} {}", kTitle, kFormat))
      return wrong(fmt::format("expected \"# {} {}\", found \"{}\"", kTitle, kFormat, shown()));
    if (!next() || !line_.starts_with("# device "))
      return wrong(fmt::format("expected \"# device NAME\", found \"{}\"", shown()));
    recording.device = line_.substr(9);

    std::vector<double> header(7 + kLimits.size());
    const std::span numbers(header);
    if (auto bad = header_line("dt_s", numbers.first(1))) return wrong(*bad);
    if (auto bad = header_line("work_space_m", numbers.subspan(1, 6))) return wrong(*bad);
    for (std::size_t i = 0; i < kLimits.size(); ++i)
      if (auto bad = header_line(kLimits[i].name, numbers.subspan(7 + i, 1))) return wrong(*bad);
    if (auto bad = take_header(header, recording))
      return failure(fmt::format("{}: header: {}", name_, *bad));
    if (!next() || line_ != kColumns)
      return wrong(fmt::format("expected the columns {}, found \"{}\"", kColumns, shown()));

    Row row;
    while (next() && !line_.starts_with('#')) {
      if (const std::size_t found = read_numbers(line_, ',', row); found != kNumbers) {
        return wrong(fmt::format("expected {} numbers, found {}", kNumbers,
                                 found > kNumbers ? std::string("more") : std::to_string(found)));
      }
      if (auto bad = take_row(row, recording)) return wrong(*bad);
    }
    const std::string end = fmt::format("# end {}", recording.samples.size());
    if (line_ != end)
      return wrong(
          fmt::format("the recording is truncated: expected \"{}\", found \"{}\"", end, shown()));
    return recording;
  }

 private:
  bool next() {
    ++number_;
    line_ = {};
    if (text_.empty()) return false;
    const std::size_t end = text_.find('\n');
    line_ = text_.substr(0, end);
    text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
    if (line_.ends_with('\r')) line_.remove_suffix(1);
    return true;
  }
  std::optional<std::string> header_line(std::string_view name, std::span<double> out) {
    const std::string start = fmt::format("# {} ", name);
    if (next() && line_.starts_with(start) &&
        read_numbers(line_.substr(start.size()), ' ', out) == out.size()) {
      return std::nullopt;
    }
    return fmt::format("expected \"{}\" and {} number{}, found \"{}\"", start, out.size(),
                       out.size() == 1 ? "" : "s", shown());
  }
  std::string shown() const {
    if (line_.empty() && text_.empty()) return "the end of the file";
    return std::string(line_.substr(0, 60));
  }
  std::unexpected<Error> wrong(const std::string& what) const {
    return failure(fmt::format("{}: line {}: {}", name_, number_, what));
  }

  std::string name_;
  std::string_view text_, line_;
  std::size_t number_ = 0;
};

std::string csv_text(const HapticRecording& recording) {
  const std::vector<double> header = header_numbers(recording);
  std::string text = fmt::format("# {} {}\n# device {}\n# dt_s {}\n", kTitle, kFormat,
                                 recording.device, header[0]);
  text +=
      fmt::format("# work_space_m {}\n", fmt::join(header.begin() + 1, header.begin() + 7, " "));
  for (std::size_t i = 0; i < kLimits.size(); ++i)
    text += fmt::format("# {} {}\n", kLimits[i].name, header[7 + i]);
  text += kColumns;
  text += '\n';
  for (const HapticSample& sample : recording.samples)
    text += fmt::format("{}\n", fmt::join(row_of(sample), ","));
  text += fmt::format("# end {}\n", recording.samples.size());
  return text;
}

Result<void> save_hdf5(const fs::path& file, const HapticRecording& recording) {
  std::vector<double> rows;
  rows.reserve(recording.samples.size() * kNumbers);
  for (const HapticSample& sample : recording.samples) {
    const Row row = row_of(sample);
    rows.insert(rows.end(), row.begin(), row.end());
  }
  const std::vector<double> header = header_numbers(recording);
  CacheContents contents;
  contents.text("device", recording.device);
  contents.text("columns", std::string(kColumns));
  contents.array("header", header);
  contents.array("rows", rows);
  return write_cache_file(file, kFormat, kTitle, contents);
}

Result<HapticRecording> load_hdf5(const fs::path& file) {
  auto data = read_sealed_file(file, kFormat, kTitle);
  auto recording = data ? recording_of(*std::move(data)) : std::unexpected(data.error());
  if (!recording) return failure(fmt::format("{}: {}", file.string(), recording.error().text()));
  return recording;
}

std::unexpected<Error> unknown_extension(const fs::path& file) {
  return failure(
      fmt::format("{}: expected a recording with the extension .csv or .h5, found \"{}\"",
                  file.string(), file.extension().string()));
}

}  // namespace

Result<void> save_recording(const fs::path& file, const HapticRecording& recording) {
  if (file.extension() == ".csv") return write_file(file, csv_text(recording));
  if (file.extension() == ".h5") return save_hdf5(file, recording);
  return unknown_extension(file);
}

Result<HapticRecording> recording_of(CacheData data) {
  HapticRecording recording;
  const auto device = data.text("device");
  if (!device) return std::unexpected(device.error());
  recording.device = *device;
  const auto header = data.take<double>("header", 7 + kLimits.size());
  if (!header) return std::unexpected(header.error());
  if (auto bad = take_header(*header, recording)) return failure("header: " + *bad);
  const auto rows = data.take<double>("rows");
  if (!rows) return std::unexpected(rows.error());
  if (rows->size() % kNumbers != 0)
    return failure(
        fmt::format("expected rows of {} numbers, found {} in all", kNumbers, rows->size()));
  recording.samples.reserve(rows->size() / kNumbers);
  for (std::size_t at = 0; at < rows->size(); at += kNumbers) {
    Row row;
    std::copy_n(rows->begin() + static_cast<std::ptrdiff_t>(at), kNumbers, row.begin());
    if (auto bad = take_row(row, recording))
      return failure(fmt::format("row {}: {}", at / kNumbers + 1, *bad));
  }
  return recording;
}

Result<HapticRecording> load_recording(const fs::path& file) {
  if (file.extension() != ".csv" && file.extension() != ".h5") return unknown_extension(file);
  auto in = InputFile::open(file, "a recording", kMostBytes);
  if (!in) return std::unexpected(in.error());
  if (file.extension() == ".h5") return load_hdf5(file);
  const auto text = in->rest();
  if (!text) return std::unexpected(text.error());
  return CsvReader(file.string(), *text).read();
}

}  // namespace viscera
