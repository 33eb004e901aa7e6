// A hive that travels: what a tick takes at 1 kHz on the wall clock while the next hive is built
// beside it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "haptics/hive_tissue.h"
#include "kernels/base/result.h"
#include "tools/common/bench_figures.h"
#include "tools/common/percentiles.h"

namespace viscera {

struct MovingHiveCase {
  int nodes = 0;
  double poisson = 0.0;
  double speed = 0.0;  ///< of the tool over the dome [m/s]
  double seconds = 0.0;
  std::uint64_t ticks = 0, missed = 0;
  HiveTissueFigures tissue;
  Percentiles lateness, compute;
  double greatest_force = 0.0;  ///< of the tissue, by the sampled outputs [N]
  std::string scheduler;
};

struct MovingHiveOptions {
  int nodes = 200;
  double poisson = 0.45;
  double speed = 0.06;  ///< [m/s]
  double seconds = 5.0;
};

/// A ball of 0.1 R goes to and fro over the dome of the hemisphere, 0.05 R deep, its hives coupled,
/// of radius 0.4 R. Runs in real time. Fails on Ctrl-C.
Result<MovingHiveCase> measure_moving_hive(const MovingHiveOptions& options);

void print(const MovingHiveCase& one, std::ostream& out);
nlohmann::json to_json(const MovingHiveCase& one);
/// Computing time p99, and updates without an answer in time.
std::vector<BenchRow> rows_of(const MovingHiveCase& one);

}  // namespace viscera
