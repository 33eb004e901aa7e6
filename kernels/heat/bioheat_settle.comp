// settle_brick of bioheat_passes.h, in single precision: differences are written out where they would
// cancel.
layout(std430, binding = 1) readonly buffer Geometry { float geometry[]; };
layout(std430, binding = 2) readonly buffer Before { float before[]; };
layout(std430, binding = 3) buffer Excess { float excess[]; };
layout(std430, binding = 4) buffer Water { float water[]; };
layout(std430, binding = 5) buffer Damage { float damage[]; };
layout(std430, binding = 6) buffer Charred { float charred[]; };
layout(std430, binding = 7) buffer Sums { HeatSums sums[]; };
layout(std430, binding = 8) buffer Lost { vec4 lost[]; };  // water, fumes [kg/m3], excess [K]

uniform float dt;
uniform int first;  // substep of its step: sums begin anew

// Greatest values, of numbers that aren't negative, as their bits.
const uint GREATEST = 0u, BEFORE = 1u, OMEGA = 2u, BORDER = 3u, MOSTS = 9u;
shared uint most[MOSTS];
shared uint changes, vapours;
shared vec4 parts[VOXELS];

void keep_greater(uint which, float value) {
  if (value > 0.0) atomicMax(most[which], floatBitsToUint(value));
}

/// The sum over all threads, by halves.
vec4 sum_of(vec4 value) {
  uint lane = gl_LocalInvocationID.x;
  barrier();
  parts[lane] = value;
  for (uint half_way = VOXELS / 2u; half_way > 0u; half_way /= 2u) {
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
  return v.fraction * (pass.solids_capacity * (1.0 - pass.lost_solids * v.c) +
                       pass.water_capacity * v.w);
}

void lose_water(inout Voxel v, float mass) {
  float whole = v.fraction * pass.water_mass;
  float left = mass >= whole * v.w ? 0.0 : max(0.0, v.w - mass / whole);
  if (left < LEAST_WATER) left = 0.0;
  v.latent += mass * pass.latent_heat;
  v.vapour += v.fraction * pass.water_capacity * (v.w - left) * v.t;
  v.w = left;
}

/// Saturated vapour over what there is at body temperature.
float vapour_rise(float t) {
  float e = min(t, pass.boiling), at = pass.body + e;
  float more = exponential_less_one(pass.vapour_slope * e / (pass.body * at));
  return pass.resting_vapour * (more * pass.body - e) / at;
}

void cool(inout Voxel v, float area) {
  float dry = pass.cooling * v.t;
  float wet = pass.evaporation * min(1.0, v.w / WET_SURFACE) * vapour_rise(v.t);
  float capacity_before = capacity(v);
  float pull = dt * (dry + wet) / v.t * area / (pass.voxel * capacity_before);
  float energy = capacity_before * v.t * (pull / (1.0 + pull));
  v.t = v.t / (1.0 + pull);
  float into_vapour =
      min(energy * (wet / (dry + wet)), v.fraction * pass.water_mass * v.w * pass.latent_heat);
  lose_water(v, into_vapour / pass.latent_heat);
  v.gas += energy - into_vapour;
}

void boil(inout Voxel v) {
  if (!(v.t > pass.boiling) || !(v.w > 0.0)) return;
  float energy = capacity(v) * (v.t - pass.boiling);
  float mass = min(energy / pass.latent_heat, v.fraction * pass.water_mass * v.w);
  v.t = pass.boiling;
  lose_water(v, mass);
  v.boiled += mass;
  if (v.w <= 0.0) v.t += max(0.0, energy - mass * pass.latent_heat) / capacity(v);
}

void char_solids(inout Voxel v) {
  if (!(v.w <= 0.0) || !(v.t > pass.boiling) || !(v.c < 1.0)) return;
  float whole = v.fraction * pass.fumes_mass;
  float rate = exponential(pass.pyrolysis_exponent - pass.pyrolysis_kelvin / (pass.body + v.t));
  float share = (1.0 - v.c) * -exponential_less_one(-dt * rate);
  float at_hand = capacity(v) * (v.t - pass.boiling);
  share = min(share, at_hand / (whole * pass.pyrolysis_heat));
  if (!(share > LEAST_CHARRING)) return;
  float mass = whole * share, heat = mass * pass.pyrolysis_heat;
  v.t -= heat / capacity(v);
  float after = min(1.0, v.c + share);
  v.vapour += v.fraction * pass.solids_capacity * pass.lost_solids * (after - v.c) * v.t;
  v.c = after;
  v.fumes += mass;
  v.pyrolysis += heat;
}

/// Of Omega, as damage_rows has it.
float damage_gain(float t0, float t1) {
  float x0 = pass.damage_exponent - pass.damage_kelvin / (pass.body + t0);
  float x1 = pass.damage_exponent - pass.damage_kelvin / (pass.body + t1);
  float half_way = 0.5 * (x1 - x0), square = half_way * half_way;
  float mean = square < 0.25
                   ? exponential(0.5 * (x0 + x1)) *
                         (1.0 + square * (1.0 / 6.0 + square * (1.0 / 120.0)))
                   : (exponential(x1) - exponential(x0)) / (x1 - x0);
  return max(0.0, mean - pass.resting_rate);
}

void main() {
  uint group = group_index();
  if (group >= uint(groups)) return;
  uint lane = gl_LocalInvocationID.x;
  uint slot = uint(table[group].slot), i = slot * VOXELS + lane;
  uint place = uint(table[group].geometry) * GEOMETRY;
  if (lane < MOSTS) most[lane] = 0u;
  if (lane == 0u) {
    changes = 0u;
    vapours = 0u;
  }
  HeatSums before_now = sums[slot];
  barrier();

  Voxel v = Voxel(geometry[place + lane], excess[i], water[i], charred[i], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
  float area = geometry[place + AREA + lane];
  bool dries = false;
  if (pass.cooling > 0.0 && area > 0.0 && v.t > FELT_AT_SURFACE) {
    cool(v, area);
    dries = true;
  }
  if (v.t > pass.boiling && !(v.w <= 0.0 && v.c >= 1.0)) {
    boil(v);
    char_solids(v);
    dries = true;
  }
  if (dries) {
    excess[i] = v.t;
    water[i] = v.w;
    charred[i] = v.c;
    atomicOr(changes, v.w < DRIED_WATER ? CHANGED_WATER | HARMED : CHANGED_WATER);
  }
  bool gives = v.boiled + v.fumes > 0.0;
  if (gives) atomicAdd(vapours, 1u);
  float size = abs(v.t);
  keep_greater(GREATEST, size);
  keep_greater(BEFORE, before[i]);
  uint x = lane % EDGE, y = lane / EDGE % EDGE, z = lane / LAYER;
  uint open_x = place + OPEN_X + x + 9u * (y + EDGE * z);
  uint open_y = place + OPEN_Y + x + EDGE * (y + 9u * z);
  uint open_z = place + OPEN_Z + lane;
  if (x == 0u && geometry[open_x] > 0.0) keep_greater(BORDER, size);
  if (x == 7u && geometry[open_x + 1u] > 0.0) keep_greater(BORDER + 1u, size);
  if (y == 0u && geometry[open_y] > 0.0) keep_greater(BORDER + 2u, size);
  if (y == 7u && geometry[open_y + EDGE] > 0.0) keep_greater(BORDER + 3u, size);
  if (z == 0u && geometry[open_z] > 0.0) keep_greater(BORDER + 4u, size);
  if (z == 7u && geometry[open_z + LAYER] > 0.0) keep_greater(BORDER + 5u, size);
  barrier();

  // A voxel that was hot at the start and isn't now counts too.
  if (uintBitsToFloat(max(most[GREATEST], most[BEFORE])) > DAMAGE_FELT) {
    float omega = damage[i];
    if (v.fraction > 0.0) {
      omega = min(omega + dt * damage_gain(before[i], v.t), MOST_DAMAGE);
      damage[i] = omega;
    }
    keep_greater(OMEGA, omega);
    if (lane == 0u) atomicOr(changes, CHANGED_DAMAGE);
  }
  uint vapours_before = first != 0 ? 0u : before_now.vapours;
  if (vapours > 0u) {
    vec4 earlier = vapours_before > 0u ? lost[i] : vec4(0.0);
    lost[i] = vec4(earlier.xy + vec2(v.boiled, v.fumes), gives ? v.t : earlier.z, 0.0);
  }
  barrier();
  vec4 energies = vec4(0.0);
  if ((changes & CHANGED_WATER) != 0u) energies = sum_of(vec4(v.latent, v.vapour, v.pyrolysis, v.gas));
  float stored = sum_of(vec4(capacity(v) * v.t, 0.0, 0.0, 0.0)).x;
  if (lane != 0u) return;
  uint flags = changes;
  if (uintBitsToFloat(most[OMEGA]) > HARMED_DAMAGE) flags |= HARMED;
  if (first == 0) {
    energies += vec4(before_now.latent, before_now.vapour, before_now.pyrolysis, before_now.gas);
    flags |= before_now.changed;
  }
  HeatSums now;
  now.latent = energies.x;
  now.vapour = energies.y;
  now.pyrolysis = energies.z;
  now.gas = energies.w;
  now.stored = stored;
  now.greatest = uintBitsToFloat(most[GREATEST]);
  now.vapours = vapours_before + vapours;
  now.changed = flags;
  for (uint side = 0u; side < 6u; ++side) now.border[side] = uintBitsToFloat(most[BORDER + side]);
  sums[slot] = now;
}
