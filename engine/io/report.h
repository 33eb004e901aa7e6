// report.json: what a run was, what it made and what it cost.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/io/report_section.h"
#include "engine/io/trace.h"
#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

struct OrganReport {
  std::string name;
  std::string response = "none";  ///< linear, finite or local; none: nothing reaches it
  std::size_t nodes = 0, surface_nodes = 0, triangles = 0;
  double prepare_s = 0.0;
  bool cache_hit = false;
  std::size_t memory_bytes = 0;
  std::size_t columns_prepared = 0;   ///< of its compliance, before the run
  std::size_t columns_on_demand = 0;  ///< made since, where a tool came to the rest of the surface
  double on_demand_s = 0.0;           ///< that took
  std::optional<PreparationFigures> preparation;  ///< none: the organ has no elasticity
  bool half_precision = false;     ///< of the displacements' storage; the two below are its price
  double storage_error = 0.0;      ///< greatest, over the greatest entry of the compliance
  std::ptrdiff_t saved_bytes = 0;  ///< against single precision
};

struct StageReport {
  std::string name;
  double median_us = 0.0, p99_us = 0.0, max_us = 0.0;
  double total_s = 0.0;
};

/// What a run did on the GPU.
struct GpuReport {
  std::string device;
  double start_s = 0.0;             ///< context, kernels, uploads
  std::size_t organs = 0;           ///< that it deforms
  std::size_t smoke_volumes = 0;    ///< whose passes it runs
  std::size_t heat_organs = 0;      ///< whose heat it moves, where a hook burns them
  std::size_t bytes = 0;            ///< of its memory, for organs
  std::vector<StageReport> passes;  ///< times on the device, of frames that deform something
};

/// Something that went wrong after a run had begun.
struct FailureReport {
  std::string what;     ///< the output, or "simulation", "checkpoint"
  double time_s = 0.0;  ///< simulated up to there
  std::string why;
};

struct MachineReport {
  std::string cpu;
  int cores = 0;  ///< that this process may use
  std::uint64_t memory_bytes = 0;
};

/// Plain values that the engine fills; the keys of report.json have the same names.
struct RunReport {
  std::string version;  ///< of the program
  std::string command;  ///< repeats the run
  std::string scene;    ///< file
  std::string title;    ///< of the scene, for people
  std::uint64_t seed = 0;
  int threads = 0;
  std::string backend;           ///< "cpu", "gpu"
  std::string backend_reason;    ///< why this one
  std::optional<GpuReport> gpu;  ///< where it computed anything
  std::string renderer;          ///< device; empty: no pictures were drawn
  double duration_s = 0.0;       ///< simulated
  std::uint64_t frames = 0;      ///< of the simulation
  std::uint64_t pictures = 0;
  std::string state_hash;
  double prepare_s = 0.0;         ///< before the first frame
  double wall_s = 0.0;            ///< of the whole loop, pictures included
  double real_time_factor = 0.0;  ///< simulated time over the time of the simulation's stages
  std::uint64_t peak_memory_bytes = 0;
  MachineReport machine;
  std::vector<OrganReport> organs;
  std::vector<StageReport> stages;
  /// What features tell, and after them what observers saw; of one key several may be.
  std::vector<ReportSection> sections;
  std::vector<SkippedReport> skipped;
  std::vector<std::string> flags, warnings;
  std::vector<std::string> not_finite;  ///< numbers that weren't: stage, what, value, time
  bool complete = true;                 ///< false: ended early, or something is missing
  std::string reason;                   ///< why it isn't complete
  std::vector<FailureReport> failures;  ///< in the order in which they were noticed
};

/// Durations [s] of one stage or pass.
StageReport stage_report(std::string name, const Quantiles& durations);
/// One entry a stage that ran, in the order of the trace's stages.
std::vector<StageReport> stage_reports(const Trace& trace);

/// What preparing the organ found out, in one line for people; empty where it has no elasticity.
std::string preparation_line(const OrganReport& organ);

/// Indented JSON; numbers that aren't finite become null.
std::string to_json(const RunReport& report);
Result<void> write_report(const std::filesystem::path& file, const RunReport& report);

/// The greatest resident memory of this process so far.
std::uint64_t peak_memory_bytes();
MachineReport this_machine();
/// Words joined so that a shell reads them back as they were.
std::string shell_command(std::span<const std::string> words);

}  // namespace viscera
