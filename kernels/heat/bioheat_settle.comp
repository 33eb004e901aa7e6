// settle_brick of bioheat_passes.h, in single precision: differences are written out where they would
// cancel.
#include "kernels/heat/heat_passes.glsl"

layout(std430, binding = 1) readonly buffer Geometry { float geometry[]; };
layout(std430, binding = 2) readonly buffer Before { float before[]; };
layout(std430, binding = 3) buffer Excess { float excess[]; };
layout(std430, binding = 4) buffer Water { float water[]; };
layout(std430, binding = 5) buffer Charred { float charred[]; };
layout(std430, binding = 6) buffer Dose { float dose[]; };
layout(std430, binding = 7) buffer Coagulation { float coagulation[]; };
layout(std430, binding = 8) buffer Collagen { float collagen[]; };
layout(std430, binding = 9) buffer Sums { HeatSums sums[]; };
layout(std430, binding = 10) buffer Lost { VoxelLoss lost[]; };

uniform float dt;
uniform int first;  // substep of its step: sums begin anew

shared uint border[6];  // greatest excess along each side, as its bits: it isn't negative
shared uint dried, harmed;
shared vec4 parts[kBrickVoxels];

/// Over all threads, by halves: sums of x and w, the greatest y and z.
vec4 state_of_brick(vec4 value) {
  uint lane = gl_LocalInvocationID.x;
  parts[lane] = value;
  for (uint half_way = kBrickVoxels / 2u; half_way > 0u; half_way /= 2u) {
    barrier();
    if (lane < half_way) {
      vec4 a = parts[lane], b = parts[lane + half_way];
      parts[lane] = vec4(a.x + b.x, max(a.yz, b.yz), a.w + b.w);
    }
  }
  barrier();
  return parts[0];
}

vec4 sum_of_brick(vec4 value) {
  uint lane = gl_LocalInvocationID.x;
  barrier();  // the parts before these have been read
  parts[lane] = value;
  for (uint half_way = kBrickVoxels / 2u; half_way > 0u; half_way /= 2u) {
    barrier();
    if (lane < half_way) parts[lane] += parts[lane + half_way];
  }
  barrier();
  return parts[0];
}

/// DryingVoxel; by volume of the voxel.
struct Voxel {
  float fraction, t, w, c;
  float latent, vapour, pyrolysis, gas;  // [J/m3]
  float boiled, fumes;                   // [kg/m3]
};

float capacity(Voxel v) {
  return v.fraction * (pass.numbers.solids_capacity * (1.0 - pass.numbers.lost_solids * v.c) +
                       pass.numbers.water_capacity * v.w);
}

void lose_water(inout Voxel v, float mass) {
  float whole = v.fraction * pass.water_mass;
  float left = mass >= whole * v.w ? 0.0 : max(0.0, v.w - mass / whole);
  if (left < float(kLeastWater)) left = 0.0;
  v.latent += mass * pass.latent_heat;
  v.vapour += v.fraction * pass.numbers.water_capacity * (v.w - left) * v.t;
  v.w = left;
}

/// Saturated vapour over what there is at body temperature.
float vapour_rise(float t) {
  float e = min(t, pass.numbers.boiling), at = pass.numbers.body + e;
  float more = exponential_less_one(pass.vapour_slope * e / (pass.numbers.body * at));
  return pass.resting_vapour * (more * pass.numbers.body - e) / at;
}

void cool(inout Voxel v, float area) {
  float dry = pass.cooling * v.t;
  float wet = pass.evaporation * min(1.0, v.w / kWetSurface) * vapour_rise(v.t);
  float capacity_before = capacity(v);
  float pull = dt * (dry + wet) / v.t * area / (pass.numbers.voxel * capacity_before);
  float energy = capacity_before * v.t * (pull / (1.0 + pull));
  v.t = v.t / (1.0 + pull);
  float into_vapour =
      min(energy * (wet / (dry + wet)), v.fraction * pass.water_mass * v.w * pass.latent_heat);
  lose_water(v, into_vapour / pass.latent_heat);
  v.gas += energy - into_vapour;
}

void boil(inout Voxel v) {
  if (!(v.t > pass.numbers.boiling) || !(v.w > 0.0)) return;
  float energy = capacity(v) * (v.t - pass.numbers.boiling);
  float mass = min(energy / pass.latent_heat, v.fraction * pass.water_mass * v.w);
  v.t = pass.numbers.boiling;
  lose_water(v, mass);
  v.boiled += mass;
  if (v.w <= 0.0) v.t += max(0.0, energy - mass * pass.latent_heat) / capacity(v);
}

void char_solids(inout Voxel v) {
  if (!(v.w <= 0.0) || !(v.t > pass.numbers.boiling) || !(v.c < 1.0)) return;
  float whole = v.fraction * pass.fumes_mass;
  float rate =
      exponential(pass.pyrolysis_exponent - pass.pyrolysis_kelvin / (pass.numbers.body + v.t));
  float share = (1.0 - v.c) * -exponential_less_one(-dt * rate);
  float at_hand = capacity(v) * (v.t - pass.numbers.boiling);
  share = min(share, at_hand / (whole * pass.pyrolysis_heat));
  if (!(share > float(kLeastCharring))) return;
  float mass = whole * share, heat = mass * pass.pyrolysis_heat;
  v.t -= heat / capacity(v);
  float after = min(1.0, v.c + share);
  v.vapour += v.fraction * pass.numbers.solids_capacity * pass.numbers.lost_solids *
              (after - v.c) * v.t;
  v.c = after;
  v.fumes += mass;
  v.pyrolysis += heat;
}

/// Of e^x between two ends, as mean_exponential has it.
float mean_exponential(float from, float to) {
  float x0 = min(from, kFastestHarm), x1 = min(to, kFastestHarm), d = x1 - x0;
  float e0 = exponential(x0);
  if (abs(d) >= 0.5) return (exponential(x1) - e0) / d;
  float series = 1.0 + d * (1.0 / 7.0);
  for (int k = 6; k > 1; --k) series = 1.0 + d * (1.0 / float(k)) * series;
  return e0 * series;
}

float arrhenius(float exponent, float kelvin, float from, float to) {
  return mean_exponential(exponent - kelvin / from, exponent - kelvin / to);
}

float dose_exponent(float kelvin) {
  float x = kDoseSlope * (kelvin - kDoseKnee);
  return x < 0.0 ? kDoseColdSlope * x : x;
}

/// As harm_rows; whether it is to be kept.
bool harm(uint i, float from, float to) {
  float hottest = max(from, to);
  if (hottest > kDoseCounts) {
    float gain = mean_exponential(dose_exponent(from), dose_exponent(to));
    dose[i] = min(dose[i] + gain * (dt / kLethalTime), kMostDose);
  }
  if (hottest > kCoagulates) {
    float gain =
        arrhenius(pass.numbers.coagulation_exponent, pass.numbers.coagulation_kelvin, from, to);
    coagulation[i] = min(coagulation[i] + gain * dt, kMostCoagulation);
  }
  if (hottest > kCollagenShrinks) {
    float gain = arrhenius(pass.numbers.collagen_exponent, pass.numbers.collagen_kelvin, from, to);
    collagen[i] = min(collagen[i] + gain * dt, kMostCollagen);
  }
  return dose[i] > kHarmedDose || coagulation[i] > kHarmedCoagulation;
}

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  uint lane = gl_LocalInvocationID.x;
  uint slot = uint(table[group].slot), i = slot * kBrickVoxels + lane;
  uint place = uint(table[group].geometry) * kGeometryWords;
  if (lane < 6u) border[lane] = 0u;
  if (lane == 0u) {
    dried = 0u;
    harmed = 0u;
  }
  HeatSums earlier = sums[slot];
  barrier();

  Voxel v = Voxel(geometry[place + lane], excess[i], water[i], charred[i], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
  float area = geometry[place + kSurfaceArea + lane], start = before[i];
  bool dries = false;
  if (pass.cooling > 0.0 && area > 0.0 && v.t > kFeltAtSurface) {
    cool(v, area);
    dries = true;
  }
  if (v.t > pass.numbers.boiling && !(v.w <= 0.0 && v.c >= 1.0)) {
    boil(v);
    char_solids(v);
    dries = true;
  }
  if (dries) {
    excess[i] = v.t;
    water[i] = v.w;
    charred[i] = v.c;
    dried = 1u;
    if (v.w < float(kDriedWater)) harmed = 1u;
  }
  bool gives = v.boiled + v.fumes > 0.0;
  float size = abs(v.t);
  uvec3 at = uvec3(lane % kBrickEdge, lane / kBrickEdge % kBrickEdge, lane / kBrickLayer);
  uint open[3] = uint[3](place + kOpenX + at.x + kBrickRow * (at.y + kBrickEdge * at.z),
                         place + kOpenY + at.x + kBrickEdge * (at.y + kBrickRow * at.z),
                         place + kOpenZ + lane);
  uint stride[3] = uint[3](1u, kBrickEdge, kBrickLayer);
  for (uint axis = 0u; axis < 3u; ++axis) {
    if (at[axis] == 0u && geometry[open[axis]] > 0.0)
      atomicMax(border[2u * axis], floatBitsToUint(size));
    if (at[axis] == kBrickEdge - 1u && geometry[open[axis] + stride[axis]] > 0.0)
      atomicMax(border[2u * axis + 1u], floatBitsToUint(size));
  }
  vec4 state = state_of_brick(
      vec4(capacity(v) * v.t, size, max(0.0, start), gives ? 1.0 : 0.0));

  // A voxel that was hot at the start and isn't now counts too.
  bool felt = pass.numbers.body + max(state.y, state.z) > kDoseCounts;
  if (felt && v.fraction > 0.0 && harm(i, pass.numbers.body + start, pass.numbers.body + v.t))
    harmed = 1u;
  uint vapours = uint(state.w), vapours_before = first != 0 ? 0u : earlier.vapours;
  if (vapours > 0u) {
    VoxelLoss lost_before = VoxelLoss(0.0, 0.0, 0.0, 0.0);
    if (vapours_before > 0u) lost_before = lost[i];
    lost[i] = VoxelLoss(lost_before.water + v.boiled, lost_before.fumes + v.fumes,
                        gives ? v.t : lost_before.excess, 0.0);
  }
  barrier();
  vec4 energies = vec4(0.0);
  if (dried != 0u) energies = sum_of_brick(vec4(v.latent, v.vapour, v.pyrolysis, v.gas));
  if (lane != 0u) return;
  uint flags = (dried != 0u ? kWaterChanged : 0u) | (felt ? kHarmChanged : 0u) |
               (harmed != 0u ? kHarmedForGood : 0u);
  if (first == 0) {
    energies += vec4(earlier.latent, earlier.vapour, earlier.pyrolysis, earlier.gas);
    flags |= earlier.changed;
  }
  HeatSums now;
  now.latent = energies.x;
  now.vapour = energies.y;
  now.pyrolysis = energies.z;
  now.gas = energies.w;
  now.stored = state.x;
  now.greatest = state.y;
  now.vapours = vapours_before + vapours;
  now.changed = flags;
  for (uint side = 0u; side < 6u; ++side) now.border[side] = uintBitsToFloat(border[side]);
  sums[slot] = now;
}
