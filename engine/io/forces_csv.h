// forces.csv: where each instrument's tip was and what force it felt, a row a frame.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/io/atomic_file.h"
#include "kernels/base/result.h"
#include "kernels/base/types.h"

namespace viscera {

struct TipSample {
  Vec3 position = Vec3::Zero();  ///< [m]
  Vec3 force = Vec3::Zero();     ///< on the instrument [N]
};

/// Streams rows with the shortest digits that read back to the same doubles. The file takes its
/// name when it is finished.
class ForcesCsv {
 public:
  /// Columns time_s and, for each instrument, NAME_x_m, _y_m, _z_m, _fx_N, _fy_N, _fz_N.
  static Result<ForcesCsv> create(const std::filesystem::path& file,
                                  std::span<const std::string> instruments);

  /// Goes on after a table's rows so far, as text() gave them, with its header.
  static Result<ForcesCsv> go_on(const std::filesystem::path& file, std::string_view text);

  /// The table so far.
  Result<std::string> text() { return out_.content(); }

  /// One sample an instrument, in the order of the names; `time` in seconds.
  void add(double time, std::span<const TipSample> samples);
  /// The first failure so far.
  Result<void> status() const { return out_.status(); }
  /// Where a row couldn't be written, those before it are the file; it fails then.
  Result<void> finish();

 private:
  explicit ForcesCsv(AtomicFile out) : out_(std::move(out)) {}
  AtomicFile out_;
  std::string row_;
};

}  // namespace viscera
