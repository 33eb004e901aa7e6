// What benchmarks of smoke share: sizes as they are written, and the rows of their tables.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace viscera {

/// What a pass, or the whole step, took.
struct SmokeRow {
  std::string backend, device;
  std::size_t particles = 0;
  std::string pass;
  double median_ms = 0.0, p99_ms = 0.0;
  std::optional<double> bandwidth_share;  ///< of the device's own; nothing: no bytes are counted
};

/// The rate of a shear wave's decay, relative to the exact one.
struct SmokeDecay {
  std::string laplacian;
  double spacing_over_wavelength = 0.0;
  double error = 0.0;
};

nlohmann::json to_json(const SmokeRow& row);
nlohmann::json to_json(const SmokeDecay& decay);

/// "10k", "1.5M", "20000": a whole number.
std::optional<std::size_t> number_of_particles(std::string_view text);
/// The same the other way: "10k", "1M", "1234".
std::string particles_text(std::size_t particles);

/// What a pass can't do without reading or writing once, caches being perfect [bytes]; 0 for passes
/// in which bytes aren't what counts. `cells`: of the sorting grid, occupied or not; `voxels`: of
/// the splatted one.
double least_bytes(std::string_view pass, double particles, double cells, double voxels);

}  // namespace viscera
