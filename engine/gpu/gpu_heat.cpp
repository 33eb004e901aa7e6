#include "engine/gpu/gpu_heat.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>

#include "engine/gpu/kernels.h"

namespace viscera {
namespace {

constexpr std::size_t kVoxels = BrickField::kVoxels;
constexpr std::size_t kValues = sizeof(HeatBrick::Values);
constexpr std::size_t kRoomToGrow = 2;  // of what comes back, where it comes to be more
constexpr int kMostBuffers = 11;        // that a kernel binds
constexpr std::size_t kFewestSlots = 64;

static_assert(std::tuple_size_v<decltype(BrickGeometry::open_x)> == kBrickFaces);

const HeatBrick::Warm* warm_beside(const HeatBrick& brick, std::size_t side) {
  return brick.neighbours[side] ? brick.neighbours[side]->warm.get() : nullptr;
}

}  // namespace

int GpuHeat::Numbers::take() {
  if (free_.empty()) return static_cast<int>(count_++);
  const int number = free_.back();
  free_.pop_back();
  return number;
}

void GpuHeat::Numbers::give(int number) {
  free_.insert(std::lower_bound(free_.begin(), free_.end(), number, std::greater<>()), number);
}

GpuHeat::~GpuHeat() {
  watch_.make_current();
}

Result<std::unique_ptr<GpuHeat>> GpuHeat::create(GpuLimits limits,
                                                 std::shared_ptr<EglContext> context) {
  if (context) context->make_current();
  std::unique_ptr<GpuHeat> made(new GpuHeat(limits, std::move(context)));
  if (const Result<void> able = check_bindings("heat on the GPU", kMostBuffers); !able)
    return std::unexpected(able.error());
  if (const Result<void> loaded = made->load_kernels(); !loaded)
    return std::unexpected(loaded.error());
  made->places_.take();
  return made;
}

std::unique_ptr<GpuHeat> GpuHeat::another() const {
  watch_.make_current();
  std::unique_ptr<GpuHeat> made(new GpuHeat(limits_, watch_.context()));
  made->kernels_ = kernels_;
  made->places_.take();
  return made;
}

Result<void> GpuHeat::load_kernels() {
  kernels_ = std::make_shared<Kernels>();
  KernelLoader kernels;
  kernels.load(kernels_->prepare, "bioheat_rates.comp", "PREPARE");
  kernels.load(kernels_->rates, "bioheat_rates.comp", "RATES");
  kernels.load(kernels_->advance, "bioheat_advance.comp", "ADVANCE");
  kernels.load(kernels_->stage, "bioheat_advance.comp", "STAGE");
  kernels.load(kernels_->settle, "bioheat_settle.comp");
  return kernels.result();
}

void GpuHeat::mark(const char* name) {
  if (timer_ != nullptr) timer_->mark(name);
}

/// Room for that many bytes; what was there stays, where it is to be kept.
bool GpuHeat::reserve(Buffer& buffer, std::size_t bytes, bool keep, const char* what) {
  if (!watch_.fits(bytes, limits_, what)) return false;
  if (buffer.size() >= bytes) return true;
  Buffer larger;
  larger.allocate(std::min(bytes + bytes / 2, limits_.block_bytes));
  if (keep && buffer.size() > 0) {
    glCopyNamedBufferSubData(buffer.id(), larger.id(), 0, 0,
                             static_cast<GLsizeiptr>(buffer.size()));
  }
  std::swap(buffer, larger);
  return watch_.is_well();
}

bool GpuHeat::reserve_slots() {
  const std::size_t slots = std::max(slot_numbers_.count(), kFewestSlots);
  const std::size_t values = slots * kValues;
  for (Buffer* field : {&excess_, &water_, &charred_, &dose_, &coagulation_, &collagen_})
    if (!reserve(*field, values, true, "a field of heat")) return false;
  for (Buffer* field : {&source_, &before_, &rate_, &conductivity_, &inverse_capacity_, &living_})
    if (!reserve(*field, values, false, "a field of heat")) return false;
  return reserve(sums_, slots * sizeof(HeatSums), true, "sums of bricks") &&
         reserve(flows_, slots * sizeof(BrickFlows), false, "flows of bricks") &&
         reserve(lost_, slots * kVoxels * sizeof(VoxelLoss), false, "vapour of bricks") &&
         reserve(table_, slots * sizeof(HeatEntry), false, "the table of bricks") &&
         reserve(geometry_,
                 std::max(places_.count(), kFewestSlots) * kGeometryWords * sizeof(float), true,
                 "geometry of bricks");
}

void GpuHeat::free_unseen() {
  for (Slot& slot : slots_) slot.seen = false;
  for (const HeatBrick* brick : warm_)
    if (brick->warm->slot >= 0) slots_[static_cast<std::size_t>(brick->warm->slot)].seen = true;
  for (std::size_t s = 0; s < slots_.size(); ++s) {
    Slot& slot = slots_[s];
    if (!slot.used || slot.seen) continue;
    if (slot.place > 0) places_.give(slot.place);
    slot_numbers_.give(static_cast<int>(s));
    slot = {};
  }
}

/// Bricks without a slot get one, and their fields are to go up.
void GpuHeat::assign_slots() {
  for (HeatBrick* brick : warm_) {
    if (brick->warm->slot >= 0) continue;
    const int number = slot_numbers_.take();
    slots_.resize(std::max(slots_.size(), slot_numbers_.count()));
    Slot& slot = slots_[static_cast<std::size_t>(number)];
    slot.used = true;
    slot.geometry = brick->geometry;
    slot.place = brick->geometry == BrickGeometry::whole() ? 0 : places_.take();
    brick->warm->slot = number;
  }
}

void GpuHeat::upload_geometry(const Slot& slot) {
  const BrickGeometry& geometry = *slot.geometry;
  std::vector<float> words;
  words.reserve(kGeometryWords);
  const auto append = [&](const auto& values) {
    words.insert(words.end(), values.begin(), values.end());
  };
  append(geometry.fraction);
  append(geometry.open_x);
  append(geometry.open_y);
  append(geometry.open_z);
  words.resize(kGeometryWords, 0.0f);
  float* area = words.data() + kSurfaceArea;
  for (const BrickGeometry::Surface& face : geometry.surface) area[face.voxel] = face.area;
  for (std::size_t voxel = 0; voxel < kVoxels; ++voxel)
    words[kPerfused + voxel] = geometry.perfused_at(voxel);
  geometry_.upload_part(static_cast<std::size_t>(slot.place) * kGeometryWords * sizeof(float),
                        std::span<const float>(words));
}

void GpuHeat::upload_fields(HeatBrick& brick, bool fresh) {
  const auto s = static_cast<std::size_t>(brick.warm->slot);
  const auto send = [&](Buffer& buffer, const HeatBrick::Values& values) {
    buffer.upload_part(s * kValues, std::span<const float>(values));
  };
  send(excess_, brick.warm->excess);
  send(water_, brick.water);
  send(charred_, brick.charred);
  send(dose_, brick.dose);
  send(coagulation_, brick.coagulation);
  send(collagen_, brick.collagen);
  slots_[s].stale = 0;
  brick.warm->altered = false;
  ++uploaded_;
  if (!fresh) return;
  HeatSums outcome;
  outcome.border = brick.warm->border;
  sums_.upload_part(s * sizeof outcome, std::span<const HeatSums>(&outcome, 1));
  if (slots_[s].place > 0) upload_geometry(slots_[s]);
}

void GpuHeat::upload_table() {
  std::vector<HeatEntry> entries;
  entries.reserve(warm_.size());
  for (const HeatBrick* brick : warm_) {
    HeatEntry& entry = entries.emplace_back();
    entry.slot = brick->warm->slot;
    entry.geometry = slots_[static_cast<std::size_t>(entry.slot)].place;
    entry.heated = brick->warm->heated ? 1 : 0;
    for (std::size_t side = 0; side < 6; ++side) {
      const HeatBrick::Warm* other = warm_beside(*brick, side);
      entry.beside[side] = other ? other->slot : -1;
    }
  }
  if (entries == entries_) return;
  table_.upload_part(0, std::span<const HeatEntry>(entries));
  entries_ = std::move(entries);
}

bool GpuHeat::start(std::span<HeatBrick* const> warm, const HeatModel& model) {
  watch_.begin();
  warm_ = warm;
  queue_.make_readable();
  free_unseen();
  const bool begins = slots_.empty();
  std::vector<HeatBrick*> fresh, altered;
  for (HeatBrick* brick : warm_) {
    if (brick->warm->slot < 0)
      fresh.push_back(brick);
    else if (brick->warm->altered)
      altered.push_back(brick);
  }
  assign_slots();
  const std::size_t table_before = table_.size();
  if (!reserve_slots()) return false;
  if (table_.size() != table_before) entries_.clear();
  if (begins) upload_geometry({.geometry = BrickGeometry::whole(), .place = 0});
  for (HeatBrick* brick : fresh) upload_fields(*brick, true);
  for (HeatBrick* brick : altered) upload_fields(*brick, false);
  for (const HeatBrick* brick : warm_) {
    if (!brick->warm->heated) continue;
    source_.upload_part(static_cast<std::size_t>(brick->warm->slot) * kValues,
                        std::span<const float>(brick->warm->source));
  }
  upload_table();
  active_ = slots_of(warm_, 0);
  parameters_ = heat_parameters(*model.numbers, *model.tissue, *model.cooling);
  pass_.upload(std::span<const HeatParameters>(&parameters_, 1));
  first_ = true;
  mark("upload");
  return watch_.is_well();
}

/// The slots of these bricks, of those with something `stale` if that is given.
GpuHeat::Range GpuHeat::slots_of(std::span<HeatBrick* const> bricks, std::uint32_t stale) const {
  std::size_t low = slots_.size(), high = 0;
  for (const HeatBrick* brick : bricks) {
    if (!brick->warm || brick->warm->slot < 0) continue;
    const auto s = static_cast<std::size_t>(brick->warm->slot);
    if (stale != 0 && (slots_[s].stale & stale) == 0) continue;
    low = std::min(low, s);
    high = std::max(high, s + 1);
  }
  return high > low ? Range{low, high - low} : Range{};
}

HeatFlows GpuHeat::prepare() {
  if (!trouble().empty()) return {};
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, pass_.id());
  queue_.dispatch(kernels_->prepare, warm_.size(),
                  {{0, &table_},
                   {1, &excess_},
                   {2, &geometry_},
                   {3, &water_},
                   {4, &coagulation_},
                   {5, &charred_}},
                  {{6, &conductivity_}, {7, &inverse_capacity_}, {8, &living_}});
  return rates();
}

HeatFlows GpuHeat::rates() {
  if (!trouble().empty()) return {};
  queue_.dispatch(kernels_->rates, warm_.size(),
                  {{0, &table_},
                   {1, &excess_},
                   {2, &geometry_},
                   {3, &source_},
                   {4, &conductivity_},
                   {5, &inverse_capacity_},
                   {6, &living_},
                   {7, &sums_}},
                  {{8, &rate_}, {9, &flows_}});
  mark("rates");
  return read_flows();
}

/// In the order of the bricks.
HeatFlows GpuHeat::read_flows() {
  queue_.make_readable();
  const std::vector<BrickFlows> flows =
      flows_.download<BrickFlows>(active_.first * sizeof(BrickFlows), active_.count);
  mark("read back");
  // What a failed device answers isn't a number of steps.
  if (!watch_.is_well()) return {};
  HeatFlows all;
  for (const HeatBrick* brick : warm_) {
    const BrickFlows& one = flows[static_cast<std::size_t>(brick->warm->slot) - active_.first];
    all.living += one.living;
    all.boundary += one.boundary;
    all.source += one.source;
    all.fastest = std::max(all.fastest, one.fastest);
  }
  return all;
}

void GpuHeat::advance(double dt) {
  if (!trouble().empty()) return;
  kernels_->advance.set("dt", static_cast<float>(dt));
  queue_.dispatch(kernels_->advance, warm_.size(), {{0, &table_}, {1, &rate_}},
                  {{2, &excess_}, {3, &before_}});
  mark("advance");
}

void GpuHeat::advance_stage(const SuperStage& stage, int j, double dt) {
  if (!trouble().empty()) return;
  const std::size_t values = excess_.size();
  if (!reserve(first_rate_, values, true, "a field of heat") ||
      !reserve(older_, values, true, "a field of heat")) {
    return;
  }
  Program& program = kernels_->stage;
  program.set("begins", j == 1 ? 1 : 0);
  program.set("newest_share", static_cast<float>(stage.newest));
  program.set("older_share", static_cast<float>(stage.older));
  program.set("first_share", static_cast<float>(stage.first));
  program.set("slope", static_cast<float>(stage.slope * dt));
  program.set("first_slope", static_cast<float>(stage.first_slope * dt));
  queue_.dispatch(program, warm_.size(), {{0, &table_}, {1, &rate_}},
                  {{2, &excess_}, {3, &before_}, {4, &first_rate_}, {5, &older_}});
  mark("advance");
}

void GpuHeat::settle(double dt) {
  if (!trouble().empty()) return;
  kernels_->settle.set("dt", static_cast<float>(dt));
  kernels_->settle.set("first", first_ ? 1 : 0);
  queue_.dispatch(kernels_->settle, warm_.size(), {{0, &table_}, {1, &geometry_}, {2, &before_}},
                  {{3, &excess_},
                   {4, &water_},
                   {5, &charred_},
                   {6, &dose_},
                   {7, &coagulation_},
                   {8, &collagen_},
                   {9, &sums_},
                   {10, &lost_}});
  first_ = false;
  mark("settle");
}

bool GpuHeat::finish(bool fields) {
  if (!trouble().empty()) return false;
  queue_.make_readable();
  const std::vector<HeatSums> outcomes =
      sums_.download<HeatSums>(active_.first * sizeof(HeatSums), active_.count);
  if (!watch_.is_well()) return false;
  const double edge = parameters_.numbers.voxel, volume = edge * edge * edge;
  std::vector<std::uint32_t> vapours;
  vapours.reserve(warm_.size());
  for (HeatBrick* brick : warm_) {
    HeatBrick::Warm& warm = *brick->warm;
    const HeatSums& one = outcomes[static_cast<std::size_t>(warm.slot) - active_.first];
    warm.sums = {one.latent * volume, one.vapour * volume, one.pyrolysis * volume,
                 one.gas * volume};
    warm.stored = one.stored;
    warm.greatest = one.greatest;
    warm.border = one.border;
    warm.vapour.clear();
    brick->harmed = brick->harmed || (one.changed & kHarmedForGood) != 0;
    slots_[static_cast<std::size_t>(warm.slot)].stale |=
        kExcessChanged | (one.changed & (kWaterChanged | kHarmChanged));
    vapours.push_back(one.vapours);
  }
  read_vapour(volume, vapours);
  const bool well = watch_.is_well() && (!fields || fetch(warm_));
  mark("read back");
  warm_ = {};
  return well;
}

/// Of the bricks that gave any, in the order of their voxels.
void GpuHeat::read_vapour(double volume, std::span<const std::uint32_t> vapours) {
  std::array<VoxelLoss, kVoxels> lost;
  for (std::size_t b = 0; b < warm_.size(); ++b) {
    if (vapours[b] == 0) continue;
    HeatBrick::Warm& warm = *warm_[b]->warm;
    lost_.download_bytes(static_cast<std::size_t>(warm.slot) * sizeof lost, lost.data(),
                         sizeof lost);
    for (std::size_t i = 0; i < kVoxels; ++i) {
      if (!(lost[i].water + lost[i].fumes > 0.0f)) continue;
      warm.vapour.push_back({static_cast<int>(i), static_cast<float>(lost[i].water * volume),
                             static_cast<float>(lost[i].fumes * volume),
                             parameters_.numbers.body + lost[i].excess});
    }
  }
}

bool GpuHeat::fetch(std::span<HeatBrick* const> bricks) {
  watch_.make_current();
  if (!trouble().empty()) return false;
  queue_.make_readable();
  struct Field {
    const Buffer* buffer;
    std::uint32_t stale;
    HeatBrick::Values& (*of)(HeatBrick&);
  };
  const std::array<Field, 6> fields = {{
      {&excess_, kExcessChanged, [](HeatBrick& b) -> HeatBrick::Values& { return b.warm->excess; }},
      {&water_, kWaterChanged, [](HeatBrick& b) -> HeatBrick::Values& { return b.water; }},
      {&charred_, kWaterChanged, [](HeatBrick& b) -> HeatBrick::Values& { return b.charred; }},
      {&dose_, kHarmChanged, [](HeatBrick& b) -> HeatBrick::Values& { return b.dose; }},
      {&coagulation_, kHarmChanged,
       [](HeatBrick& b) -> HeatBrick::Values& { return b.coagulation; }},
      {&collagen_, kHarmChanged, [](HeatBrick& b) -> HeatBrick::Values& { return b.collagen; }},
  }};
  std::array<Range, fields.size()> ranges;
  std::array<std::size_t, fields.size()> begin;
  std::size_t bytes = 0;
  for (std::size_t f = 0; f < fields.size(); ++f) {
    ranges[f] = slots_of(bricks, fields[f].stale);
    begin[f] = bytes;
    bytes += ranges[f].count * kValues;
  }
  if (bytes == 0) return watch_.is_well();
  fetched_ += bytes;
  if (!read_back_ || read_back_->size() < bytes)
    read_back_ = std::make_unique<ReadBack>(kRoomToGrow * bytes);
  for (std::size_t f = 0; f < fields.size(); ++f)
    read_back_->start(*fields[f].buffer, ranges[f].first * kValues, ranges[f].count * kValues,
                      begin[f]);
  read_back_->submit();
  // Only now that all of it is known to be good.
  if (!read_back_->wait() || !watch_.is_well()) return false;
  const auto* values = static_cast<const std::byte*>(read_back_->data());
  for (std::size_t f = 0; f < fields.size(); ++f) {
    for (HeatBrick* brick : bricks) {
      if (!brick->warm || brick->warm->slot < 0) continue;
      const auto s = static_cast<std::size_t>(brick->warm->slot);
      if ((slots_[s].stale & fields[f].stale) != 0)
        std::memcpy(&fields[f].of(*brick), values + begin[f] + (s - ranges[f].first) * kValues,
                    kValues);
    }
  }
  for (const HeatBrick* brick : bricks)
    if (brick->warm && brick->warm->slot >= 0)
      slots_[static_cast<std::size_t>(brick->warm->slot)].stale = 0;
  return true;
}

std::size_t GpuHeat::bytes() const {
  std::size_t sum = 0;
  for (const Buffer* buffer :
       {&table_, &excess_, &water_, &charred_, &dose_, &coagulation_, &collagen_, &source_,
        &geometry_, &before_, &rate_, &conductivity_, &inverse_capacity_, &living_, &first_rate_,
        &older_, &flows_, &sums_, &lost_})
    sum += buffer->size();
  return sum;
}

}  // namespace viscera
