#include "engine/io/forces_csv.h"

#include <charconv>
#include <utility>

namespace viscera {
namespace {

void append(std::string& row, double value) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  row.append(digits, end);
}

/// RFC 4180: a field with a comma, a quote or a line break stands in quotes.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

}  // namespace

Result<ForcesCsv> ForcesCsv::create(const std::filesystem::path& file,
                                    std::span<const std::string> instruments) {
  auto out = AtomicFile::create(file);
  if (!out) return std::unexpected(out.error());
  std::string header = "time_s";
  for (const std::string& name : instruments) {
    for (const char* column : {"_x_m", "_y_m", "_z_m", "_fx_N", "_fy_N", "_fz_N"}) {
      header += "," + field(name + column);
    }
  }
  out->write(header + "\n");
  return ForcesCsv(std::move(*out));
}

Result<ForcesCsv> ForcesCsv::go_on(const std::filesystem::path& file, std::string_view text) {
  auto out = AtomicFile::create(file);
  if (!out) return std::unexpected(out.error());
  out->write(text);
  return ForcesCsv(std::move(*out));
}

void ForcesCsv::add(double time, std::span<const TipSample> samples) {
  row_.clear();
  append(row_, time);
  for (const TipSample& sample : samples) {
    for (const Vec3* vector : {&sample.position, &sample.force}) {
      for (int axis = 0; axis < 3; ++axis) {
        row_ += ',';
        append(row_, (*vector)[axis]);
      }
    }
  }
  row_ += '\n';
  out_.write(row_);
}

Result<void> ForcesCsv::finish() {
  return out_.commit_lines();
}

}  // namespace viscera
