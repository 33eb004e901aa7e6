#include "engine/io/report.h"

#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "engine/io/atomic_file.h"
#include "engine/io/memory_limit.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

Json preparation_json(const PreparationFigures& figures) {
  return {{"unknowns", figures.unknowns},
          {"stiffness_nonzeros", figures.stiffness_nonzeros},
          {"quadrature_points", figures.quadrature_points},
          {"gradient_correction", figures.gradient_correction},
          {"fixed_area_m2", figures.fixed_area},
          {"factor_bytes", figures.factor_bytes},
          {"assemble_s", figures.assemble_s},
          {"factor_s", figures.factor_s},
          {"compliance_s", figures.compliance_s},
          {"smallest_compliance_eigenvalue", figures.smallest_compliance_eigenvalue}};
}

Json organ_json(const OrganReport& organ) {
  return {{"name", organ.name},
          {"response", organ.response},
          {"nodes", organ.nodes},
          {"surface_nodes", organ.surface_nodes},
          {"triangles", organ.triangles},
          {"prepare_s", organ.prepare_s},
          {"cache_hit", organ.cache_hit},
          {"memory_bytes", organ.memory_bytes},
          {"columns_prepared", organ.columns_prepared},
          {"columns_on_demand", organ.columns_on_demand},
          {"on_demand_s", organ.on_demand_s},
          {"preparation", organ.preparation ? preparation_json(*organ.preparation) : Json(nullptr)},
          {"displacement_storage", organ.half_precision ? "half" : "single"},
          {"storage_error", organ.storage_error},
          {"saved_bytes", organ.saved_bytes}};
}

Json stage_json(const StageReport& stage) {
  return {{"name", stage.name},
          {"median_us", stage.median_us},
          {"p99_us", stage.p99_us},
          {"max_us", stage.max_us},
          {"total_s", stage.total_s}};
}

Json gpu_json(const GpuReport& gpu) {
  Json passes = Json::array();
  for (const StageReport& pass : gpu.passes) passes.push_back(stage_json(pass));
  return {{"device", gpu.device},
          {"start_s", gpu.start_s},
          {"organs", gpu.organs},
          {"smoke_volumes", gpu.smoke_volumes},
          {"heat_organs", gpu.heat_organs},
          {"bytes", gpu.bytes},
          {"passes", passes}};
}

/// The value of the first line of a /proc file that starts with `key`, without colon and blanks.
std::string proc_value(const char* file, std::string_view key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(key)) continue;
    const std::size_t begin = line.find_first_not_of(" \t:", key.size());
    if (begin != std::string::npos) return line.substr(begin);
  }
  return "";
}

}  // namespace

StageReport stage_report(std::string name, const Quantiles& durations) {
  return {.name = std::move(name),
          .median_us = 1e6 * durations.median,
          .p99_us = 1e6 * durations.p99,
          .max_us = 1e6 * durations.max,
          .total_s = durations.total};
}

std::vector<StageReport> stage_reports(const Trace& trace) {
  std::vector<StageReport> reports;
  for (std::size_t i = 0; i < trace.stages().size(); ++i) {
    const Quantiles q = trace.durations(static_cast<int>(i));
    if (q.count == 0) continue;
    reports.push_back(stage_report(trace.stages()[i], q));
  }
  return reports;
}

std::string to_json(const RunReport& report) {
  Json organs = Json::array(), stages = Json::array(), skipped = Json::array();
  Json failures = Json::array();
  for (const FailureReport& failure : report.failures)
    failures.push_back({{"what", failure.what}, {"time_s", failure.time_s}, {"why", failure.why}});
  for (const OrganReport& organ : report.organs) organs.push_back(organ_json(organ));
  for (const StageReport& stage : report.stages) stages.push_back(stage_json(stage));
  for (const SkippedReport& s : report.skipped) {
    skipped.push_back({{"what", s.what}, {"why", s.why}});
  }
  Json all = {{"version", report.version},
              {"command", report.command},
              {"complete", report.complete},
              {"reason", report.reason.empty() ? Json(nullptr) : Json(report.reason)},
              {"failures", failures},
              {"scene", report.scene},
              {"title", report.title},
              {"seed", report.seed},
              {"threads", report.threads},
              {"backend", report.backend},
              {"backend_reason", report.backend_reason},
              {"gpu", report.gpu ? gpu_json(*report.gpu) : Json(nullptr)},
              {"renderer", report.renderer},
              {"duration_s", report.duration_s},
              {"frames", report.frames},
              {"pictures", report.pictures},
              {"state_hash", report.state_hash},
              {"prepare_s", report.prepare_s},
              {"wall_s", report.wall_s},
              {"real_time_factor", report.real_time_factor},
              {"peak_memory_bytes", report.peak_memory_bytes},
              {"machine",
               {{"cpu", report.machine.cpu},
                {"cores", report.machine.cores},
                {"memory_bytes", report.machine.memory_bytes}}},
              {"organs", organs},
              {"stages", stages}};
  for (const ReportSection& section : report.sections)
    merge_section(all[section.key], Json::parse(section.json, nullptr, false));
  all["skipped"] = skipped;
  all["flags"] = report.flags;
  all["not_finite"] = report.not_finite;
  all["warnings"] = report.warnings;
  return all.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string preparation_line(const OrganReport& organ) {
  if (!organ.preparation) return "";
  const PreparationFigures& figures = *organ.preparation;
  const double megabytes = 1e-6 * static_cast<double>(figures.factor_bytes);
  std::string line =
      fmt::format("{}: {} nodes, {} unknowns, ", organ.name, organ.nodes, figures.unknowns);
  // A body on two levels isn't put together at once, and neither is its compliance.
  line += figures.stiffness_nonzeros == 0
              ? fmt::format("on two levels, gradients corrected by {:.1e}, coarse factor {:.1f} MB",
                            figures.gradient_correction, megabytes)
              : fmt::format(
                    "{:.2g} nonzeros, gradients corrected by {:.1e}, factor {:.1f} MB, "
                    "smallest eigenvalue of the compliance {:.1e} of its largest",
                    static_cast<double>(figures.stiffness_nonzeros), figures.gradient_correction,
                    megabytes, figures.smallest_compliance_eigenvalue);
  line += fmt::format("; assembly {:.2f} s, factor {:.2f} s, compliance {:.2f} s{}",
                      figures.assemble_s, figures.factor_s, figures.compliance_s,
                      organ.cache_hit ? ", when it was cached" : "");
  if (organ.columns_on_demand > 0)
    line += fmt::format("; {} columns of its compliance made on demand, in {:.2f} s",
                        organ.columns_on_demand, organ.on_demand_s);
  if (organ.half_precision)
    line += fmt::format("; displacements in half precision: error {:.1e}, {:.1f} MB saved",
                        organ.storage_error, 1e-6 * static_cast<double>(organ.saved_bytes));
  return line;
}

Result<void> write_report(const std::filesystem::path& file, const RunReport& report) {
  return write_file(file, to_json(report) + "\n");
}

std::uint64_t peak_memory_bytes() {
  const std::string high_water = proc_value("/proc/self/status", "VmHWM");
  if (!high_water.empty()) return std::strtoull(high_water.c_str(), nullptr, 10) * 1024;
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

MachineReport this_machine() {
  MachineReport machine;
  machine.cpu = proc_value("/proc/cpuinfo", "model name");
  if (machine.cpu.empty()) machine.cpu = "unknown processor";
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  machine.cores = sched_getaffinity(0, sizeof allowed, &allowed) == 0
                      ? CPU_COUNT(&allowed)
                      : static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
  machine.memory_bytes = machine_memory();
  return machine;
}

std::string shell_command(std::span<const std::string> words) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_@%+=:,./-";
  std::string command;
  for (const std::string& word : words) {
    if (!command.empty()) command += ' ';
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) {
      command += word;
      continue;
    }
    command += '\'';
    for (const char c : word) command += c == '\'' ? std::string("'\\''") : std::string(1, c);
    command += '\'';
  }
  return command;
}

}  // namespace viscera
