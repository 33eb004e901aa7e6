// report.json: what a run was, what it made and what it cost.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/io/trace.h"
#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

struct OrganReport {
  std::string name;
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
  double greatest_displacement = 0.0;       ///< of the drawn surface, in the whole run [m]
  double greatest_displacement_time = 0.0;  ///< when that was [s]
};

struct LinkReport {
  std::string name;
  std::array<std::string, 2> between;
  double stiffness = 0.0;  ///< [N/m]
  std::size_t springs = 0;
  double greatest_force = 0.0;  ///< of all springs together [N]
};

/// An instrument that was held, and what its device felt.
struct HapticReport {
  std::string tool, device;
  std::uint64_t ticks = 0;
  double greatest_force = 0.0;  ///< on the hand [N]
  double energy = 0.0;          ///< net to the hand [J]
  std::uint64_t passivity_violations = 0;
  std::uint64_t hives_built = 0, hives_refused = 0;
  std::uint64_t ticks_without = 0;  ///< a hive, in contact
  // Of tissue beyond linear (haptics/hive_tissue.h):
  std::uint64_t newton_steps = 0, tangent_answers = 0, deadline_misses = 0, linear_answers = 0;
  /// Of what the hand felt, from what the frame's contact finds, over the frames in which the tool
  /// touched and stood still (root of the mean square).
  double frame_difference = 0.0;
  std::uint64_t frames_at_rest = 0;
  std::vector<std::string> events;
};

/// Where the energy of all hooks' generators went: generated = delivered + body + sparks, and
/// delivered + metabolic = stored + latent + perfused + lost + what the residual says.
struct CauteryReport {
  double generated = 0.0;           ///< [J]
  double delivered = 0.0;           ///< heat in tissue that is followed [J]
  double body = 0.0, sparks = 0.0;  ///< spread beyond; outside the tissue [J]
  double metabolic = 0.0;           ///< [J]
  double stored = 0.0;              ///< in tissue that is still warm [J]
  double latent = 0.0;              ///< of water that left [J]
  double perfused = 0.0;            ///< carried away by blood [J]
  double lost = 0.0;      ///< to gas, instruments, vapour's warmth, char and cold tissue [J]
  double residual = 0.0;  ///< over what was delivered
};

struct TissueReport {
  std::string organ;
  double vaporised = 0.0;             ///< water and solids [kg]
  double smoke = 0.0;                 ///< of that [kg]
  double above_60 = 0.0;              ///< volume above 60 C at its greatest [m3]
  double coagulated = 0.0;            ///< volume with damage of at least 1 [m3]
  double greatest_temperature = 0.0;  ///< [K]
  /// How the organ's elasticity followed; none: nothing coagulated, or it isn't followed.
  struct Stiffening {
    double greatest_factor = 1.0;     ///< of Young's modulus
    double stiffened = 0.0;           ///< volume at least half as stiff again [m3]
    double left_out = 0.0;            ///< like it, but too far from the hooks' paths [m3]
    double greatest_shrinkage = 0.0;  ///< of the surface, by shrinkage alone [m]
    int updates = 0;
    std::size_t nodes = 0, rank = 0;  ///< of the last update
  };
  std::optional<Stiffening> stiffening;
};

/// Measures of the trainee's work.
struct TraineeReport {
  struct Organ {
    std::string name;
    double peak_force = 0.0;  ///< of all instruments together [N]
    double mean_force = 0.0;  ///< while touched [N]
    double touched = 0.0;     ///< [s]
  };
  struct Tip {
    std::string name;
    double path = 0.0;  ///< [m]
    /// -ln(T^3 / v^2 times the integral of jerk^2), v the greatest speed [Hogan2009]; greater is
    /// smoother. None: it never moved, or for too short.
    std::optional<double> smoothness;
  };
  struct SparedBurn {
    std::string organ;
    double coagulated = 0.0;  ///< [m3]
  };
  double energy = 0.0;                         ///< that hooks delivered [J]
  double idle_current = 0.0;                   ///< current asked for with no tissue to take it [s]
  std::optional<double> greatest_temperature;  ///< of tissue [K]
  std::vector<SparedBurn> spared_burns;        ///< of organs that the scene spares
  std::vector<Organ> organs;                   ///< that were touched
  std::vector<Tip> tips;
  std::optional<double> time_in_smoke;  ///< [s]
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

/// Something that the scene didn't need or the machine couldn't give.
struct SkippedReport {
  std::string what, why;
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
  std::vector<LinkReport> links;
  std::vector<HapticReport> haptics;
  std::vector<StageReport> stages;
  /// emitted = airborne + background + evacuated + leaked + deposited.
  struct Smoke {
    std::size_t particles_max = 0, volumes = 0;
    double emitted_kg = 0.0;
    double airborne_kg = 0.0;    ///< carried by particles
    double background_kg = 0.0;  ///< mixed into the whole cavity's gas
    double evacuated_kg = 0.0, leaked_kg = 0.0;
    double deposited_kg = 0.0;  ///< on surfaces
    /// Share of the pictures' times at which less than half of the light came through from around
    /// the tip that burns, or the worst of all tips; without camera or tips: none.
    std::optional<double> time_in_smoke;
    double writing_s = 0.0;  ///< that volumes took their thread, while frames went on
  } smoke;
  std::optional<CauteryReport> cautery;  ///< none: no hook carries current
  std::vector<TissueReport> tissue;      ///< of organs that heat was followed in
  TraineeReport trainee;
  /// Of features that bring their own: key and JSON text.
  std::vector<std::pair<std::string, std::string>> sections;
  std::vector<SkippedReport> skipped;
  std::vector<std::string> flags, warnings;
  bool complete = true;  ///< false: ended early by Ctrl-C or an error
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
