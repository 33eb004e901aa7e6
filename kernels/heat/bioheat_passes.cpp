#include "kernels/heat/bioheat_passes.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/lanes_math.h"
#include "kernels/base/wide.h"

namespace viscera {
namespace {

constexpr int kEdge = HeatBricks::kEdge;
constexpr int kLayer = kEdge * kEdge;
constexpr int kVoxels = BrickField::kVoxels;
static_assert(kEdge == kLanes, "a row of a brick is one register");

// A brick's field with a layer of its neighbours' around it; corners and edges aren't read.
constexpr int kHaloRow = kEdge + 2, kHaloLayer = kHaloRow * kHaloRow;
constexpr int kHaloVoxels = kHaloLayer * kHaloRow;

constexpr int halo_at(int x, int y, int z) {
  return (x + 1) + kHaloRow * (y + 1) + kHaloLayer * (z + 1);
}

constexpr int kStep[3] = {1, kEdge, kLayer};
constexpr int kHaloStep[3] = {1, kHaloRow, kHaloLayer};

// Voxels along a side, by two numbers across it.
constexpr int side_voxel(int side, int u, int v) {
  const int axis = side / 2;
  return (side % 2 ? (kEdge - 1) * kStep[axis] : 0) + u * kStep[(axis + 1) % 3] +
         v * kStep[(axis + 2) % 3];
}

constexpr int side_halo(int side, int u, int v) {
  const int axis = side / 2;
  return halo_at(0, 0, 0) + (side % 2 ? kEdge : -1) * kHaloStep[axis] +
         u * kHaloStep[(axis + 1) % 3] + v * kHaloStep[(axis + 2) % 3];
}

float open_at_side(const BrickGeometry& geometry, int side, int voxel) {
  const int x = voxel % kEdge, y = voxel / kEdge % kEdge, z = voxel / kLayer, up = side % 2;
  switch (side / 2) {
    case 0:
      return geometry.open_x[(x + up) + BrickGeometry::kRow * (y + kEdge * z)];
    case 1:
      return geometry.open_y[x + kEdge * ((y + up) + BrickGeometry::kRow * z)];
    default:
      return geometry.open_z[x + kEdge * (y + kEdge * (z + up))];
  }
}

const HeatBrick::Warm* warm_beside(const HeatBrick& brick, int side) {
  return brick.neighbours[side] ? brick.neighbours[side]->warm.get() : nullptr;
}

bool leaks(const HeatBrick& brick, int side, const BioheatNumbers& numbers) {
  return !warm_beside(brick, side) && brick.warm->border[side] > numbers.followed;
}

// Own values inside; around them the neighbours', or, where none is warm, the own border's.
void gather(const HeatBrick& brick, const BioheatNumbers& numbers, float* excess,
            float* conductivity) {
  const HeatBrick::Warm& own = *brick.warm;
  for (int row = 0; row < kLayer; ++row) {
    const int to = halo_at(0, row % kEdge, row / kEdge);
    std::copy_n(own.excess.data() + kEdge * row, kEdge, excess + to);
    std::copy_n(own.conductivity.data() + kEdge * row, kEdge, conductivity + to);
  }
  for (int side = 0; side < 6; ++side) {
    const HeatBrick::Warm* other = warm_beside(brick, side);
    const float kept = leaks(brick, side, numbers) ? 0.0f : 1.0f;
    for (int v = 0; v < kEdge; ++v) {
      for (int u = 0; u < kEdge; ++u) {
        const int to = side_halo(side, u, v);
        const int from = side_voxel(other ? side ^ 1 : side, u, v);
        excess[to] = other ? other->excess[from] : kept * own.excess[from];
        conductivity[to] = (other ? other : &own)->conductivity[from];
      }
    }
  }
}

// Where blood reaches all.
constexpr BrickField::Values kAllPerfused = [] {
  BrickField::Values ones{};
  ones.fill(1.0f);
  return ones;
}();

VISCERA_WIDE void prepare_rows(const BioheatNumbers& numbers, const float* fraction,
                               const float* perfused, const float* water, const float* coagulation,
                               const float* charred, const float* excess, float* conductivity,
                               float* inverse, float* living) {
  const BioheatNumbers n = numbers;
  const Lanes zero = {}, one = zero + 1.0f;
  for (int i = 0; i < kVoxels; i += kLanes) {
    Lanes w, d, c, t, f, p;
    load(w, water + i);
    load(d, coagulation + i);
    load(c, charred + i);
    load(t, excess + i);
    load(f, fraction + i);
    load(p, perfused + i);
    Lanes warm = t > 0.0f ? t : zero;
    warm = warm < n.boiling ? warm : zero + n.boiling;
    const Lanes conducts = (n.dry_conductivity + (n.wet_conductivity - n.dry_conductivity) * w) *
                           (1.0f + n.conductivity_slope * warm);
    // Where the front of drying is, the sign says so.
    Lanes marked = w > 0.0f ? -conducts : conducts;
    marked = w < 1.0f ? marked : conducts;
    store(conductivity + i, t >= kAtBoiling * n.boiling ? marked : conducts);
    const Lanes capacity =
        f * (n.solids_capacity * (1.0f - n.lost_solids * c) + n.water_capacity * w);
    store(inverse + i, capacity > 0.0f ? one / capacity : zero);
    Lanes alive;
    exponential(alive, -d);
    store(living + i, f * alive * p);
  }
}

struct RateSums {
  Lanes living, source, fastest;
};

// Heat crosses a face by the two voxels' conductivities in series, so what one loses the other
// gains to the last bit. A voxel that the front of drying crosses is dry towards the dry and wet
// towards the wet: it conducts as its neighbour does, whose side of the front the way between them
// lies on. (Their mean would put the front a quarter of a voxel too far.)
VISCERA_WIDE void rate_rows(const BioheatNumbers& numbers, const BrickGeometry& geometry,
                            const float* excess, const float* conductivity, const float* source,
                            const float* inverse, const float* living, float* rate,
                            RateSums* sums) {
  const BioheatNumbers n = numbers;
  RateSums total = {};
  for (int row = 0; row < kLayer; ++row) {
    const int y = row % kEdge, z = row / kEdge, i = kEdge * row;
    const int c = halo_at(0, y, z);
    const float* open[6];
    open[0] = geometry.open_x.data() + BrickGeometry::kRow * row;
    open[1] = open[0] + 1;
    open[2] = geometry.open_y.data() + kEdge * (y + BrickGeometry::kRow * z);
    open[3] = open[2] + kEdge;
    open[4] = geometry.open_z.data() + i;
    open[5] = open[4] + kLayer;
    Lanes t, k, flow = {}, links = {};
    load(t, excess + c);
    load(k, conductivity + c);
    for (int side = 0; side < 6; ++side) {
      const int at = side % 2 ? c + kHaloStep[side / 2] : c - kHaloStep[side / 2];
      Lanes other_t, other_k, share;
      load(other_t, excess + at);
      load(other_k, conductivity + at);
      load(share, open[side]);
      const Lanes size = k < 0.0f ? -k : k, other_size = other_k < 0.0f ? -other_k : other_k;
      const Lanes series = 2.0f * (size * other_size) / (size + other_size);
      const Lanes at_front = other_k < 0.0f ? series : other_size;
      const Lanes away = other_k < 0.0f ? size : series;
      const Lanes link = share * (k < 0.0f ? at_front : away);
      flow += link * (other_t - t);
      links += link;
    }
    Lanes q, inv, alive;
    load(q, source + i);
    load(inv, inverse + i);
    load(alive, living + i);
    const Lanes felt = alive * t;
    store(rate + i, (n.inverse_square * flow + q - n.drain * felt) * inv);
    total.living += felt;
    total.source += q;
    const Lanes follow = (n.inverse_square * links + n.drain * alive) * inv;
    keep_greater(total.fastest, follow);
  }
  *sums = total;
}

VISCERA_WIDE void advance_rows(float* excess, float* before, const float* rate, float dt) {
  for (int i = 0; i < kVoxels; ++i) {
    before[i] = excess[i];
    excess[i] += dt * rate[i];
  }
}

struct StageFactors {
  float newest, older, first, slope, first_slope;
};

VISCERA_WIDE void stage_rows(float* excess, float* older, const float* first, const float* rate,
                             const float* first_rate, const StageFactors& factors) {
  const StageFactors f = factors;
  for (int i = 0; i < kVoxels; ++i) {
    const float next = f.newest * excess[i] + f.older * older[i] + f.first * first[i] +
                       f.slope * rate[i] + f.first_slope * first_rate[i];
    older[i] = excess[i];
    excess[i] = next;
  }
}

// Mean of e^x over a step in which x goes linearly from one end's value to the other's: the
// difference of the powers over that of the exponents, exact for any length of the step. Near equal
// exponents, the series.
VISCERA_INLINE void mean_exponential(Lanes& mean, const Lanes& from, const Lanes& to) {
  const Lanes zero = {}, most = zero + kFastestHarm;
  const Lanes x0 = from < most ? from : most, x1 = to < most ? to : most;
  Lanes e0, e1;
  exponential(e0, x0);
  exponential(e1, x1);
  const Lanes d = x1 - x0, size = d < 0.0f ? -d : d;
  Lanes series = 1.0f + d * (1.0f / 7.0f);
  for (int k = 6; k > 1; --k) series = 1.0f + d * (1.0f / static_cast<float>(k)) * series;
  mean = size < 0.5f ? e0 * series : (e1 - e0) / d;
}

// What a law A exp(-Ea / (R T)) does in a step between two temperatures [1/s].
VISCERA_INLINE void arrhenius(Lanes& mean, float exponent, float kelvin, const Lanes& from,
                              const Lanes& to) {
  mean_exponential(mean, exponent - kelvin / from, exponent - kelvin / to);
}

// Adds where it is hot enough, up to a limit.
VISCERA_INLINE void grow(float* field, const Lanes& gain, const Lanes& hottest, float counts,
                         float limit) {
  const Lanes zero = {}, most = zero + limit;
  Lanes value;
  load(value, field);
  const Lanes next = value + (hottest > counts ? gain : zero);
  store(field, next < most ? next : most);
}

// Three processes of their own (damage.h). Most rows are too cold for any.
VISCERA_WIDE void harm_rows(const BioheatNumbers& numbers, const float* before, const float* excess,
                            const float* fraction, float* dose, float* coagulation, float* collagen,
                            float dt) {
  const BioheatNumbers n = numbers;
  const Lanes zero = {};
  for (int i = 0; i < kVoxels; i += kLanes) {
    Lanes from, to, f, gain;
    load(from, before + i);
    load(to, excess + i);
    load(f, fraction + i);
    from += n.body;
    to += n.body;
    Lanes hottest = from > to ? from : to;
    hottest = f > 0.0f ? hottest : zero;
    const float most = greatest(hottest);
    if (!(most > kDoseCounts)) continue;
    // In powers of two above the knee and of four below.
    Lanes x0 = kDoseSlope * (from - kDoseKnee), x1 = kDoseSlope * (to - kDoseKnee);
    x0 = x0 < 0.0f ? kDoseColdSlope * x0 : x0;
    x1 = x1 < 0.0f ? kDoseColdSlope * x1 : x1;
    mean_exponential(gain, x0, x1);
    grow(dose + i, gain * (dt / kLethalTime), hottest, kDoseCounts, kMostDose);
    if (!(most > kCoagulates)) continue;
    arrhenius(gain, n.coagulation_exponent, n.coagulation_kelvin, from, to);
    grow(coagulation + i, gain * dt, hottest, kCoagulates, kMostCoagulation);
    if (!(most > kCollagenShrinks)) continue;
    arrhenius(gain, n.collagen_exponent, n.collagen_kelvin, from, to);
    grow(collagen + i, gain * dt, hottest, kCollagenShrinks, kMostCollagen);
  }
}

VISCERA_WIDE float greatest_size(const float* values) {
  Lanes most = {};
  for (int i = 0; i < kVoxels; i += kLanes) {
    Lanes v;
    load(v, values + i);
    keep_greater(most, v);
    keep_greater(most, -v);
  }
  return greatest(most);
}

VISCERA_WIDE float greatest_value(const float* values) {
  Lanes most;
  load(most, values);
  for (int i = kLanes; i < kVoxels; i += kLanes) {
    Lanes v;
    load(v, values + i);
    keep_greater(most, v);
  }
  return greatest(most);
}

// One voxel while it gives off heat and vapour; by volume of the voxel. Writes itself back at its
// end.
class DryingVoxel {
 public:
  DryingVoxel(HeatBrick& brick, const BioheatNumbers& numbers, const ThermalTissue& tissue, int i)
      : brick_(brick),
        n_(numbers),
        tissue_(tissue),
        i_(i),
        fraction_(brick.geometry->fraction[i]),
        excess_(brick.warm->excess[i]),
        water_(brick.water[i]),
        charred_(brick.charred[i]) {}
  ~DryingVoxel() {
    brick_.warm->excess[i_] = static_cast<float>(excess_);
    brick_.water[i_] = static_cast<float>(water_);
    brick_.charred[i_] = static_cast<float>(charred_);
    brick_.harmed = brick_.harmed || water_ < kDriedWater;
    if (water_boiled_ + solids_lost_ > 0.0)
      brick_.warm->vapour.push_back({i_, static_cast<float>(water_boiled_ * volume()),
                                     static_cast<float>(solids_lost_ * volume()),
                                     static_cast<float>(n_.body + excess_)});
  }
  DryingVoxel(const DryingVoxel&) = delete;
  DryingVoxel& operator=(const DryingVoxel&) = delete;

  double excess() const { return excess_; }
  double capacity() const {
    return fraction_ *
           (n_.solids_capacity * (1.0 - n_.lost_solids * charred_) + n_.water_capacity * water_);
  }

  // The surface gives `loss` [W/m2] of heat, `vapour_share` of it as vapour, over `area` of a face.
  // Linearised about zero and implicit, so that no step is too long for it.
  void cool(double loss, double vapour_share, double area, double dt) {
    const double capacity_before = capacity();
    const double pull = loss / excess_ * area / (n_.voxel * capacity_before);
    const double next = excess_ / (1.0 + dt * pull);
    const double energy = capacity_before * (excess_ - next);
    excess_ = next;
    const double vapour = std::min(energy * vapour_share, water_mass() * water::kLatentHeat);
    lose_water(vapour / water::kLatentHeat);
    sums().gas += (energy - vapour) * volume();
  }

  // What is over boiling goes into vapour as long as there is water.
  void boil() {
    if (!(excess_ > n_.boiling) || !(water_ > 0.0)) return;
    const double energy = capacity() * (excess_ - n_.boiling);
    const double mass = std::min(energy / water::kLatentHeat, water_mass());
    excess_ = n_.boiling;
    lose_water(mass);
    water_boiled_ += mass;
    if (water_ <= 0.0) excess_ += (energy - mass * water::kLatentHeat) / capacity();
  }

  // Solids turn to char and fumes once they are dry.
  void char_solids(double dt) {
    if (!(water_ <= 0.0) || !(excess_ > n_.boiling) || !(charred_ < 1.0)) return;
    const double whole = fraction_ * tissue_.density * (1.0 - tissue_.water_fraction) *
                         static_cast<double>(n_.lost_solids);
    double share = (1.0 - charred_) * -std::expm1(-dt * tissue_.pyrolysis.rate(n_.body + excess_));
    const double at_hand = capacity() * (excess_ - n_.boiling);
    share = std::min(share, at_hand / (whole * tissue_.pyrolysis_heat));
    if (!(share > kLeastCharring)) return;
    const double mass = whole * share, heat = mass * tissue_.pyrolysis_heat;
    excess_ -= heat / capacity();
    const double held = capacity() * excess_;
    charred_ = std::min(1.0, charred_ + share);
    solids_lost_ += mass;
    sums().pyrolysis += heat * volume();
    sums().vapour += (held - capacity() * excess_) * volume();
  }

 private:
  double water_mass() const {
    return fraction_ * water_ * tissue_.density * tissue_.water_fraction;
  }
  // Water takes its latent heat and its warmth along; the rest keeps its temperature.
  void lose_water(double mass) {
    const double whole = fraction_ * tissue_.density * tissue_.water_fraction;
    const double held = capacity() * excess_;
    water_ = mass >= water_mass() ? 0.0 : std::max(0.0, water_ - mass / whole);
    if (water_ < kLeastWater) water_ = 0.0;
    sums().latent += mass * water::kLatentHeat * volume();
    sums().vapour += (held - capacity() * excess_) * volume();
  }
  BrickSums& sums() { return brick_.warm->sums; }
  double volume() const {
    return static_cast<double>(n_.voxel) * static_cast<double>(n_.voxel) * n_.voxel;
  }

  HeatBrick& brick_;
  const BioheatNumbers& n_;
  const ThermalTissue& tissue_;
  int i_;
  double fraction_, excess_, water_, charred_;
  double water_boiled_ = 0.0, solids_lost_ = 0.0;  // [kg/m3]
};

void cool_surface(HeatBrick& brick, const BioheatNumbers& numbers, const ThermalTissue& tissue,
                  const SurfaceCooling& cooling, double dt) {
  if (cooling.coefficient <= 0.0) return;
  const double transfer = cooling.vapour_transfer();
  const double resting = water::vapour_density(numbers.body);
  for (const BrickGeometry::Surface& face : brick.geometry->surface) {
    if (!(brick.warm->excess[face.voxel] > kFeltAtSurface)) continue;
    DryingVoxel voxel(brick, numbers, tissue, face.voxel);
    const double dry = cooling.coefficient * voxel.excess();
    double wet = 0.0;
    // What evaporates at rest belongs to the resting state.
    if (cooling.evaporates)
      wet = water::kLatentHeat * transfer * std::min(1.0f, brick.water[face.voxel] / kWetSurface) *
            (water::vapour_density(numbers.body + voxel.excess()) - resting);
    voxel.cool(dry + wet, wet / (dry + wet), face.area, dt);
  }
}

void find_borders(HeatBrick& brick) {
  HeatBrick::Warm& warm = *brick.warm;
  warm.greatest = greatest_size(warm.excess.data());
  for (int side = 0; side < 6; ++side) {
    float most = 0.0f;
    for (int v = 0; v < kEdge; ++v) {
      for (int u = 0; u < kEdge; ++u) {
        const int at = side_voxel(side, u, v);
        const float size = std::abs(warm.excess[at]);
        if (size > most && open_at_side(*brick.geometry, side, at) > 0.0f) most = size;
      }
    }
    warm.border[side] = most;
  }
}

}  // namespace

HeatParameters heat_parameters(const BioheatNumbers& numbers, const ThermalTissue& tissue,
                               const SurfaceCooling& cooling) {
  const auto f = [](double value) { return static_cast<float>(value); };
  HeatParameters p;
  p.numbers = numbers;
  p.latent_heat = f(water::kLatentHeat);
  p.water_mass = f(tissue.density * tissue.water_fraction);
  p.fumes_mass = f(tissue.density * (1.0 - tissue.water_fraction) * (1.0 - tissue.char_share));
  p.pyrolysis_exponent = f(std::log(std::max(tissue.pyrolysis.frequency, 1e-300)));
  p.pyrolysis_kelvin = f(tissue.pyrolysis.energy / kGasConstant);
  p.pyrolysis_heat = f(tissue.pyrolysis_heat);
  p.cooling = f(std::max(0.0, cooling.coefficient));
  p.evaporation = cooling.evaporates && cooling.coefficient > 0.0
                      ? f(water::kLatentHeat * cooling.vapour_transfer())
                      : 0.0f;
  p.resting_vapour = f(water::vapour_density(numbers.body));
  p.vapour_slope = f(water::kVapourSlope);
  return p;
}

void prepare_brick(HeatBrick& brick, const BioheatNumbers& numbers) {
  HeatBrick::Warm& warm = *brick.warm;
  const std::vector<float>& perfused = brick.geometry->perfused;
  prepare_rows(numbers, brick.geometry->fraction.data(),
               perfused.empty() ? kAllPerfused.data() : perfused.data(), brick.water.data(),
               brick.coagulation.data(), brick.charred.data(), warm.excess.data(),
               warm.conductivity.data(), warm.inverse_capacity.data(), warm.living.data());
}

void find_rates(HeatBrick& brick, const BioheatNumbers& numbers) {
  HeatBrick::Warm& warm = *brick.warm;
  alignas(32) float excess[kHaloVoxels], conductivity[kHaloVoxels];
  gather(brick, numbers, excess, conductivity);
  RateSums sums;
  rate_rows(numbers, *brick.geometry, excess, conductivity, warm.source.data(),
            warm.inverse_capacity.data(), warm.living.data(), warm.rate.data(), &sums);
  warm.living_sum = sum(sums.living);
  warm.source_sum = sum(sums.source);
  warm.fastest = greatest(sums.fastest);
  warm.boundary_sum = 0.0;
  for (int side = 0; side < 6; ++side) {
    if (!leaks(brick, side, numbers)) continue;
    for (int v = 0; v < kEdge; ++v) {
      for (int u = 0; u < kEdge; ++u) {
        const int at = side_voxel(side, u, v);
        warm.boundary_sum += open_at_side(*brick.geometry, side, at) *
                             std::abs(warm.conductivity[at]) * warm.excess[at];
      }
    }
  }
}

void advance_brick(HeatBrick& brick, float dt) {
  HeatBrick::Warm& warm = *brick.warm;
  advance_rows(warm.excess.data(), warm.before.data(), warm.rate.data(), dt);
}

void advance_stage(HeatBrick& brick, const SuperStage& stage, int j, float dt) {
  HeatBrick::Warm& warm = *brick.warm;
  if (!warm.stages) warm.stages = std::make_unique<std::array<HeatBrick::Values, 2>>();
  HeatBrick::Values& first_rate = (*warm.stages)[0];
  HeatBrick::Values& older = (*warm.stages)[1];
  if (j == 1) {
    warm.before = warm.excess;
    first_rate = warm.rate;
    older = warm.excess;
  }
  stage_rows(warm.excess.data(), older.data(), warm.before.data(), warm.rate.data(),
             first_rate.data(),
             {static_cast<float>(stage.newest), static_cast<float>(stage.older),
              static_cast<float>(stage.first), static_cast<float>(stage.slope * dt),
              static_cast<float>(stage.first_slope * dt)});
}

void settle_brick(HeatBrick& brick, const BioheatNumbers& numbers, const ThermalTissue& tissue,
                  const SurfaceCooling& cooling, double dt) {
  HeatBrick::Warm& warm = *brick.warm;
  cool_surface(brick, numbers, tissue, cooling, dt);
  if (greatest_value(warm.excess.data()) > numbers.boiling) {
    for (int i = 0; i < kVoxels; ++i) {
      if (!(warm.excess[i] > numbers.boiling)) continue;
      if (brick.water[i] <= 0.0f && brick.charred[i] >= 1.0f) continue;
      DryingVoxel voxel(brick, numbers, tissue, i);
      voxel.boil();
      voxel.char_solids(dt);
    }
  }
  find_borders(brick);
  // A voxel that was hot at the start and isn't now counts too.
  if (numbers.body + std::max(warm.greatest, greatest_value(warm.before.data())) > kDoseCounts) {
    harm_rows(numbers, warm.before.data(), warm.excess.data(), brick.geometry->fraction.data(),
              brick.dose.data(), brick.coagulation.data(), brick.collagen.data(),
              static_cast<float>(dt));
    brick.harmed = brick.harmed || greatest_value(brick.dose.data()) > kHarmedDose ||
                   greatest_value(brick.coagulation.data()) > kHarmedCoagulation;
  }
}

double stored_in(const HeatBrick& brick, const BioheatNumbers& n) {
  double stored = 0.0;
  for (int i = 0; i < kVoxels; ++i) {
    const double capacity =
        brick.geometry->fraction[i] *
        (n.solids_capacity * (1.0 - static_cast<double>(n.lost_solids) * brick.charred[i]) +
         static_cast<double>(n.water_capacity) * brick.water[i]);
    stored += capacity * brick.warm->excess[i];
  }
  return stored * n.voxel * n.voxel * n.voxel;
}

}  // namespace viscera
