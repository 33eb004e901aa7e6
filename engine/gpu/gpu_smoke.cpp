#include "engine/gpu/gpu_smoke.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/gpu/device_kernels.h"
#include "engine/gpu/kernels.h"
#include "kernels/smoke/integrate.h"
#include "kernels/smoke/smoke_device.h"
#include "kernels/smoke/splat_levels.h"
#include "kernels/smoke/viscosity.h"

namespace viscera {

namespace {

constexpr std::size_t kExtentGroups = 512;  // at most: each ends with atomics on the same words
constexpr int kMostBuffers = 11;            // that a kernel binds
constexpr std::size_t kSumWords = 2 * kSplatChannels;

std::size_t groups_of(std::size_t threads) {
  return (threads + kSmokeGroup - 1) / kSmokeGroup;
}

template <class Pass>
void bind_pass(unsigned binding, Buffer& buffer, const Pass& pass) {
  buffer.upload(std::span<const Pass>(&pass, 1));
  glBindBufferBase(GL_UNIFORM_BUFFER, binding, buffer.id());
}

/// The number whose word extent.comp made.
float from_ascending(std::uint32_t word) {
  return std::bit_cast<float>((word & 0x8000'0000u) != 0 ? word & 0x7fff'ffffu : ~word);
}

double sum_of(std::span<const float> masses) {
  double sum = 0.0;
  for (const float mass : masses) sum += mass;
  return sum;
}

}  // namespace

GpuSmoke::~GpuSmoke() {
  watch_.make_current();
}

Result<std::unique_ptr<GpuSmoke>> GpuSmoke::create(GpuLimits limits,
                                                   std::shared_ptr<EglContext> context) {
  if (context) context->make_current();
  std::unique_ptr<GpuSmoke> made(new GpuSmoke(limits, std::move(context)));
  if (const Result<void> able = check_bindings("smoke on the GPU", kMostBuffers); !able)
    return std::unexpected(able.error());
  if (const Result<void> loaded = made->load_kernels(); !loaded) {
    return std::unexpected(loaded.error());
  }
  made->counters_.allocate(kCounterWords * sizeof(std::uint32_t));
  made->extent_.allocate(kBoxWords * sizeof(std::uint32_t));
  // A buffer without a byte can't be bound.
  for (Buffer* buffer :
       {&made->waves_, &made->gas_, &made->capsules_, &made->triangles_, &made->surface_entries_}) {
    buffer->allocate(sizeof(SurfaceTriangle));
  }
  return made;
}

Result<void> GpuSmoke::load_kernels() {
  KernelLoader kernels;
  kernels.load(clear_, "clear.comp");
  kernels.load(box_, "extent.comp", "BOX");
  kernels.load(amounts_, "extent.comp", "AMOUNTS");
  kernels.load(count_, "bin.comp", "COUNT");
  kernels.load(mark_, "bin.comp", "MARK");
  kernels.load(scatter_, "bin.comp", "SCATTER");
  kernels.load(gather_, "bin.comp", "GATHER");
  kernels.load(scan_blocks_, "scan.comp", "BLOCKS");
  kernels.load(scan_totals_, "scan.comp", "TOTALS");
  kernels.load(scan_add_, "scan.comp", "ADD");
  kernels.load(density_, "viscosity.comp", "DENSITY");
  kernels.load(pairs_, "viscosity.comp", "PAIRS");
  kernels.load(paper_, "paper_viscosity.comp");
  kernels.load(integrate_, "integrate.comp");
  kernels.load(collide_, "collide.comp");
  kernels.load(splat_add_, "splat.comp", "ADD");
  kernels.load(splat_fold_, "splat.comp", "FOLD");
  kernels.load(splat_blur_, "splat.comp", "BLUR");
  kernels.load(splat_resolve_, "splat.comp", "RESOLVE");
  return kernels.result();
}

/// Room for that many bytes, of unknown content where it has to grow.
bool GpuSmoke::reserve(Buffer& buffer, std::size_t bytes, const char* what) {
  bytes = std::max<std::size_t>(bytes, 16);
  if (!watch_.fits(bytes, limits_, what)) return false;
  if (buffer.size() >= bytes) return true;
  buffer.allocate(std::min(bytes + bytes / 4, limits_.block_bytes));
  return watch_.is_well();
}

std::size_t GpuSmoke::particle_groups() const {
  return groups_of(particles_);
}

void GpuSmoke::mark(const char* name) {
  if (timer_ != nullptr) timer_->mark(name);
}

void GpuSmoke::skip() {
  if (timer_ != nullptr) timer_->skip();
}

void GpuSmoke::clear(const Buffer& buffer, std::size_t words) {
  clear_.set("count", static_cast<int>(words));
  queue_.dispatch(clear_, (words + kClearGroup - 1) / kClearGroup, {}, {{0, &buffer}});
}

bool GpuSmoke::upload(const SmokeParticles& particles) {
  watch_.begin();
  particles_ = particles.size();
  survey_.reset();
  isolated_.reset();
  const std::size_t n = particles_, vectors = n * sizeof(Float4), words = n * sizeof(float);
  for (Particles* side : {&now_, &sorted_}) {
    if (!reserve(side->positions, vectors, "positions") ||
        !reserve(side->velocities, vectors, "velocities") ||
        !reserve(side->masses, words, "masses") || !reserve(side->ids, words, "ids")) {
      return false;
    }
  }
  if (!reserve(accelerations_, vectors, "accelerations") ||
      !reserve(strengths_, 2 * words, "strengths") || !reserve(fates_, words, "fates") ||
      !reserve(places_, 2 * words, "places in cells") || !reserve(slots_, words, "slots")) {
    return false;
  }
  queue_.make_readable();
  now_.positions.upload_part(0, std::span<const Float4>(particles.positions));
  now_.velocities.upload_part(0, std::span<const Float4>(particles.velocities));
  now_.masses.upload_part(0, std::span<const float>(particles.masses));
  now_.ids.upload_part(0, std::span<const std::uint32_t>(particles.ids));
  return watch_.is_well();
}

bool GpuSmoke::start(SmokeParticles& particles) {
  if (!upload(particles)) return false;
  mass_before_ = sum_of(particles.masses);
  clear(fates_, particles_);
  clear(counters_, kCounterWords);
  return true;
}

/// Finds the box and the greatest speed, where they aren't known.
void GpuSmoke::survey() {
  if (survey_) return;
  clear(extent_, kBoxWords);
  box_.set("count", static_cast<int>(particles_));
  queue_.dispatch(box_, std::min(particle_groups(), kExtentGroups),
                  {{0, &now_.positions}, {1, &now_.velocities}}, {{2, &extent_}});
  queue_.make_readable();
  const std::vector<std::uint32_t> words = extent_.download<std::uint32_t>(0, kBoxWords);
  survey_ = Survey();
  // What a failed device answers is no box, and a grid would be laid over it.
  if (particles_ == 0 || !watch_.is_well()) {
    survey_->box.extend(Vec3f::Zero().eval());
  } else {
    survey_->box = Eigen::AlignedBox3f(
        Vec3f(from_ascending(~words[0]), from_ascending(~words[1]), from_ascending(~words[2])),
        Vec3f(from_ascending(words[3]), from_ascending(words[4]), from_ascending(words[5])));
  }
  if (trouble().empty()) survey_->speed = std::sqrt(std::bit_cast<float>(words[6]));
  mark("box");
}

float GpuSmoke::greatest_speed() {
  survey();
  return survey_->speed;
}

/// bin (bin.h).
void GpuSmoke::sort(float cell) {
  survey();
  grid_ = bin_grid(survey_->box, particles_, cell);
  const auto cells = static_cast<std::size_t>(grid_.size.w);
  const std::size_t blocks = (cells + kScanBlock - 1) / kScanBlock;
  if (!reserve(counts_, cells * sizeof(std::uint32_t), "cells") ||
      !reserve(cell_begin_, (cells + 1) * sizeof(std::uint32_t), "cells") ||
      !reserve(totals_, (blocks + 1) * sizeof(std::uint32_t), "cells")) {
    return;
  }
  bind_pass(0, bin_pass_, grid_);
  clear(counts_, cells);
  queue_.dispatch(count_, particle_groups(), {{0, &now_.positions}},
                  {{1, &places_}, {2, &counts_}});
  for (Program* program : {&scan_blocks_, &scan_add_}) {
    program->set("count", static_cast<int>(cells));
  }
  scan_totals_.set("count", static_cast<int>(blocks));
  queue_.dispatch(scan_blocks_, blocks, {{0, &counts_}}, {{1, &cell_begin_}, {2, &totals_}});
  queue_.dispatch(scan_totals_, 1, {}, {{0, &totals_}});
  queue_.dispatch(scan_add_, groups_of(cells + 1), {{0, &totals_}}, {{1, &cell_begin_}});
  queue_.dispatch(scatter_, particle_groups(), {{0, &places_}, {1, &cell_begin_}}, {{2, &slots_}});
  queue_.dispatch(gather_, particle_groups(),
                  {{0, &places_},
                   {1, &cell_begin_},
                   {2, &slots_},
                   {3, &now_.positions},
                   {4, &now_.velocities},
                   {5, &now_.masses},
                   {6, &now_.ids}},
                  {{7, &sorted_.positions},
                   {8, &sorted_.velocities},
                   {9, &sorted_.masses},
                   {10, &sorted_.ids}});
  std::swap(now_, sorted_);
  mark("bin");
}

void GpuSmoke::exchange(float cell, ViscosityParameters parameters) {
  sort(cell);
  if (!trouble().empty()) return;
  parameters.particles = static_cast<std::uint32_t>(particles_);
  bind_pass(0, viscosity_pass_, parameters);
  glBindBufferBase(GL_UNIFORM_BUFFER, 1, bin_pass_.id());
  clear(counters_, kCounterWords);
  isolated_.reset();
  queue_.dispatch(density_, particle_groups(), {{0, &cell_begin_}, {1, &now_.positions}},
                  {{2, &strengths_}, {3, &accelerations_}, {4, &counters_}});
  queue_.dispatch(
      pairs_, particle_groups(),
      {{0, &cell_begin_}, {1, &now_.positions}, {2, &now_.velocities}, {3, &strengths_}},
      {{4, &accelerations_}});
  if (parameters.laplacian == Laplacian::kPaper) {
    queue_.dispatch(
        paper_, particle_groups(),
        {{0, &cell_begin_}, {1, &now_.positions}, {2, &now_.velocities}, {3, &strengths_}},
        {{4, &accelerations_}});
  }
  mark("viscosity");
}

std::uint64_t GpuSmoke::isolated() const {
  if (!isolated_) {
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    isolated_ = counters_.download<std::uint32_t>(kIsolatedWord * sizeof(std::uint32_t), 1)[0];
  }
  return *isolated_;
}

void GpuSmoke::integrate(IntegrateParameters parameters, std::span<const SwirlWave> waves,
                         SurroundingGas* gas) {
  if (!trouble().empty()) return;
  parameters.particles = static_cast<std::uint32_t>(particles_);
  parameters.waves = static_cast<std::uint32_t>(waves.size());
  if (gas != nullptr) {
    queue_.make_readable();
    const std::vector<Float4> positions = now_.positions.download<Float4>(0, particles_);
    around_.resize(particles_);
    gas->velocity(positions, around_);
    skip();
    if (!reserve(gas_, particles_ * sizeof(Float4), "gas")) return;
    gas_.upload_part(0, std::span<const Float4>(around_));
  }
  if (!waves.empty()) {
    if (!reserve(waves_, waves.size_bytes(), "waves")) return;
    waves_.upload_part(0, waves);
  }
  bind_pass(0, integrate_pass_, parameters);
  integrate_.set("with_gas", gas != nullptr ? 1 : 0);
  queue_.dispatch(integrate_, particle_groups(),
                  {{2, &now_.ids}, {3, &accelerations_}, {4, &waves_}, {5, &gas_}},
                  {{0, &now_.positions}, {1, &now_.velocities}});
  survey_.reset();
  mark("integrate");
}

/// As SurfaceCells::build takes them.
std::vector<std::uint32_t> GpuSmoke::cells_of_pace(const BinParameters& grid, float fastest) {
  const std::size_t words = (static_cast<std::size_t>(grid.size.w) + 31) / 32;
  if (!reserve(occupied_, kPaces * words * sizeof(std::uint32_t), "cells"))
    return std::vector<std::uint32_t>(kPaces * words, 0);
  bind_pass(0, bin_pass_, grid);
  mark_.set("fastest_square", fastest * fastest);
  clear(occupied_, kPaces * words);
  queue_.dispatch(mark_, particle_groups(), {{0, &now_.positions}, {2, &now_.velocities}},
                  {{1, &occupied_}});
  queue_.make_readable();
  return occupied_.download<std::uint32_t>(0, kPaces * words);
}

bool GpuSmoke::upload_surfaces(const SurfaceCells& cells, std::span<const SmokeCapsule> capsules) {
  const auto send = [&]<class T>(Buffer& buffer, std::span<const T> values, const char* what) {
    if (!reserve(buffer, values.size_bytes(), what)) return false;
    buffer.upload_part(0, values);
    return true;
  };
  return send(surface_begin_, cells.cell_begin(), "cells of surfaces") &&
         send(surface_entries_, cells.entries(), "triangles in cells") &&
         send(triangles_, cells.triangles(), "triangles") &&
         send(capsules_near_, cells.capsules_near(), "cells of surfaces") &&
         send(capsules_, capsules, "instruments");
}

CollideCounts GpuSmoke::collide(SurfaceCells& cells, const SurfaceMeeting& meeting,
                                std::span<const SmokeCapsule> capsules,
                                CollideParameters parameters) {
  if (!trouble().empty()) return {};
  survey();
  const BinParameters grid = bin_grid(survey_->box, particles_, meeting.cell);
  const float fastest = greatest_speed();
  cells.build(grid, cells_of_pace(grid, fastest), fastest, meeting.fraction, meeting.dt,
              meeting.reach, capsules);
  if (cells.empty() || !upload_surfaces(cells, capsules)) return {};
  mark("surface cells");
  parameters.particles = static_cast<std::uint32_t>(particles_);
  parameters.capsules = static_cast<std::uint32_t>(capsules.size());
  parameters.origin = grid.origin;
  parameters.size = grid.size;
  parameters.inverse_cell = grid.inverse_cell;
  bind_pass(0, collide_pass_, parameters);
  isolated();  // before its word goes
  clear(counters_, kCounterWords);
  queue_.dispatch(collide_, particle_groups(),
                  {{0, &surface_begin_},
                   {1, &surface_entries_},
                   {2, &triangles_},
                   {3, &capsules_near_},
                   {4, &capsules_}},
                  {{5, &now_.positions},
                   {6, &now_.velocities},
                   {7, &now_.masses},
                   {8, &fates_},
                   {9, &counters_}});
  survey_.reset();
  mark("collide");
  queue_.make_readable();
  const std::vector<std::uint32_t> words = counters_.download<std::uint32_t>(0, kCounterWords);
  CollideCounts counts;
  counts.tested = words[kTestedWord];
  counts.touching = words[kTouchingWord];
  counts.trapped = words[kTrappedWord];
  return counts;
}

std::optional<double> GpuSmoke::finish(SmokeParticles& particles, std::vector<SmokeFate>& fates) {
  if (!trouble().empty()) return std::nullopt;
  SmokeParticles back = read_particles();
  const std::vector<std::uint32_t> words = fates_.download<std::uint32_t>(0, particles_);
  if (!watch_.is_well()) return std::nullopt;
  fates.resize(words.size());
  std::ranges::transform(words, fates.begin(),
                         [](std::uint32_t word) { return static_cast<SmokeFate>(word); });
  std::swap(particles, back);
  return mass_before_ - sum_of(particles.masses);
}

bool GpuSmoke::splat_here(SplatParameters& parameters) {
  const auto cells = static_cast<std::size_t>(parameters.size.w);
  if (!reserve(sums_, kSumWords * cells * sizeof(std::uint32_t), "sums of a smoke volume") ||
      !reserve(amounts_cells_, kSplatChannels * cells * sizeof(float), "cells") ||
      !reserve(blurred_cells_, kSplatChannels * cells * sizeof(float), "cells") ||
      !reserve(density_cells_, cells * sizeof(float), "cells") ||
      !reserve(temperature_cells_, cells * sizeof(float), "cells") ||
      !reserve(velocity_cells_, cells * sizeof(Vec3f), "cells")) {
    return false;
  }
  clear(extent_, kAmountWords);
  amounts_.set("count", static_cast<int>(particles_));
  queue_.dispatch(amounts_, std::min(particle_groups(), kExtentGroups),
                  {{0, &now_.positions}, {1, &now_.velocities}, {2, &now_.masses}},
                  {{3, &extent_}});
  queue_.make_readable();
  const std::vector<std::uint32_t> words = extent_.download<std::uint32_t>(0, kAmountWords);
  set_scales({std::bit_cast<float>(words[0]), std::bit_cast<float>(words[1]),
              std::bit_cast<float>(words[2])},
             parameters);
  parameters.particles = static_cast<std::uint32_t>(particles_);
  bind_pass(0, splat_pass_, parameters);
  clear(sums_, kSumWords * cells);
  add_and_blur(parameters);
  queue_.dispatch(splat_resolve_, groups_of(cells), {{0, &amounts_cells_}},
                  {{1, &density_cells_}, {2, &temperature_cells_}, {3, &velocity_cells_}});
  mark("splat");
  return watch_.is_well();
}

/// Leaves in amounts_cells_ what the cells hold.
void GpuSmoke::add_and_blur(const SplatParameters& parameters) {
  const std::size_t groups = groups_of(static_cast<std::size_t>(parameters.size.w));
  const std::vector<SplatLevel> levels = splat_levels(parameters);
  std::vector<float> weights;
  std::vector<int> first;
  for (const SplatLevel& level : levels) {
    first.push_back(static_cast<int>(weights.size()));
    weights.insert(weights.end(), level.weights.begin(), level.weights.end());
  }
  splat_weights_.upload(std::span<const float>(weights));
  for (std::size_t level = levels.size(); level-- > 0;) {
    if (level + 1 < levels.size()) {
      splat_blur_.set("first", first[level + 1]);
      splat_blur_.set("reach", levels[level + 1].reach());
      for (int axis = 0; axis < 3; ++axis) {
        splat_blur_.set("axis", axis);
        queue_.dispatch(splat_blur_, groups, {{0, &amounts_cells_}, {1, &splat_weights_}},
                        {{2, &blurred_cells_}});
        std::swap(amounts_cells_, blurred_cells_);
      }
    }
    const auto square = [&](std::size_t l) { return levels[l].square; };
    splat_add_.set("below", square(level > 0 ? level - 1 : level));
    splat_add_.set("here", square(level));
    splat_add_.set("above", square(std::min(level + 1, levels.size() - 1)));
    queue_.dispatch(splat_add_, particle_groups(),
                    {{0, &now_.positions}, {1, &now_.velocities}, {2, &now_.masses}},
                    {{3, &sums_}});
    splat_fold_.set("replace", level + 1 == levels.size() ? 1 : 0);
    queue_.dispatch(splat_fold_, groups, {}, {{0, &sums_}, {1, &amounts_cells_}});
  }
}

void GpuSmoke::read_splat(const SplatParameters& parameters, SmokeGrid& grid) {
  const auto cells = static_cast<std::size_t>(parameters.size.w);
  grid.size = {parameters.size.x, parameters.size.y, parameters.size.z};
  queue_.make_readable();
  grid.density = density_cells_.download<float>(0, cells);
  grid.temperature = temperature_cells_.download<float>(0, cells);
  grid.velocity = velocity_cells_.download<Vec3f>(0, cells);
}

bool GpuSmoke::splat(const SmokeParticles& particles, SplatParameters& parameters,
                     SmokeGrid& grid) {
  skip();
  if (!upload(particles) || !splat_here(parameters)) return false;
  read_splat(parameters, grid);
  return watch_.is_well();
}

SmokeParticles GpuSmoke::read_particles() {
  queue_.make_readable();
  SmokeParticles back;
  back.positions = now_.positions.download<Float4>(0, particles_);
  back.velocities = now_.velocities.download<Float4>(0, particles_);
  back.masses = now_.masses.download<float>(0, particles_);
  back.ids = now_.ids.download<std::uint32_t>(0, particles_);
  return back;
}

std::vector<Float4> GpuSmoke::read_accelerations() {
  queue_.make_readable();
  return accelerations_.download<Float4>(0, particles_);
}

std::vector<std::uint32_t> GpuSmoke::read_cell_begin() {
  queue_.make_readable();
  return cell_begin_.download<std::uint32_t>(0, static_cast<std::size_t>(grid_.size.w) + 1);
}

std::size_t GpuSmoke::bytes() const {
  std::size_t sum = 0;
  for (const Buffer* buffer : {&now_.positions,
                               &now_.velocities,
                               &now_.masses,
                               &now_.ids,
                               &sorted_.positions,
                               &sorted_.velocities,
                               &sorted_.masses,
                               &sorted_.ids,
                               &accelerations_,
                               &strengths_,
                               &fates_,
                               &counters_,
                               &extent_,
                               &places_,
                               &slots_,
                               &counts_,
                               &cell_begin_,
                               &totals_,
                               &occupied_,
                               &waves_,
                               &gas_,
                               &surface_begin_,
                               &surface_entries_,
                               &triangles_,
                               &capsules_near_,
                               &capsules_,
                               &sums_,
                               &amounts_cells_,
                               &blurred_cells_,
                               &splat_weights_,
                               &density_cells_,
                               &temperature_cells_,
                               &velocity_cells_}) {
    sum += buffer->size();
  }
  return sum;
}

}  // namespace viscera
