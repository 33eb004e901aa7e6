#include "tools/bench/smoke_rows.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

namespace viscera {

nlohmann::json to_json(const SmokeRow& row) {
  nlohmann::json json = {{"backend", row.backend},     {"device", row.device},
                         {"particles", row.particles}, {"pass", row.pass},
                         {"median_ms", row.median_ms}, {"p99_ms", row.p99_ms},
                         {"bandwidth_share", nullptr}};
  if (row.bandwidth_share) json["bandwidth_share"] = *row.bandwidth_share;
  return json;
}

nlohmann::json to_json(const SmokeDecay& decay) {
  return {{"laplacian", decay.laplacian},
          {"spacing_over_wavelength", decay.spacing_over_wavelength},
          {"error", decay.error}};
}

std::optional<std::size_t> number_of_particles(std::string_view text) {
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc()) return std::nullopt;
  const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  if (unit == "k") {
    value *= 1e3;
  } else if (unit == "M") {
    value *= 1e6;
  } else if (!unit.empty()) {
    return std::nullopt;
  }
  if (!(value >= 0.0 && value <= 1e12) || std::abs(value - std::round(value)) > 1e-6)
    return std::nullopt;
  return static_cast<std::size_t>(std::llround(value));
}

std::string particles_text(std::size_t particles) {
  if (particles >= 1'000'000 && particles % 100'000 == 0)
    return fmt::format("{:g}M", 1e-6 * static_cast<double>(particles));
  if (particles >= 1'000 && particles % 100 == 0)
    return fmt::format("{:g}k", 1e-3 * static_cast<double>(particles));
  return std::to_string(particles);
}

double least_bytes(std::string_view pass, double particles, double cells, double voxels) {
  // Places, numbers, two lists; all that a particle is, to and fro. Cells: clear, scan, add.
  if (pass == "bin") return (16 + 8 + 8 + 4 + 4 + 8 + 40 + 40) * particles + 20 * cells;
  if (pass == "viscosity") return (16 + 8 + 16 + 16 + 16 + 8 + 16) * particles + 8 * cells;
  if (pass == "integrate") return (32 + 4 + 16 + 32) * particles;
  if (pass == "collide") return 16 * particles + 8 * cells;
  if (pass == "splat") return 2 * 36 * particles + (40 + 40 + 40 + 20) * voxels;
  return 0.0;
}

}  // namespace viscera
