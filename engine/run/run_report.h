// What report.json says of a run besides what its observers saw.
#pragma once

#include <cstdint>
#include <string>

#include "engine/io/report.h"
#include "engine/run/run.h"
#include "engine/run/run_book.h"
#include "engine/simulation/frame_flag.h"
#include "engine/simulation/world.h"

namespace viscera {

/// What is known of a run before anything is prepared.
RunReport begun_report(const SceneDescription& scene, const RunOptions& options);

/// Where it computes: one line for the person who started the run.
std::string backend_line(const RunReport& report);

/// What the world and the trace tell of it afterwards; `report` knows its wall time already.
/// `book`: what its frames raised.
void finish_report(const World& world, const SceneDescription& scene, const Trace& trace,
                   const RunBook& book, RunReport& report);

}  // namespace viscera
