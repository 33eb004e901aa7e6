// splat (splat.h) by levels (splat_levels.h), from the widest down: ADD, a thread a particle, adds a
// level's shares to sums in fixed point, in any order to the same bits: 64-bit numbers of two words,
// since 64-bit atomics are an extension. A particle adds less than 2^31 steps to a cell, so that
// 2^33 particles fit. FOLD, a thread a cell, adds the sums to the amounts and empties them; BLUR, a
// thread a cell, widens the amounts along one axis; RESOLVE, a thread a cell, makes means of them.
#include "kernels/smoke/smoke_passes.glsl"
#pragma passes ADD FOLD BLUR RESOLVE

layout(std140, binding = 0) uniform Pass { SplatParameters pass; };

#ifdef ADD
layout(std430, binding = 0) readonly buffer Positions { vec4 positions[]; };
layout(std430, binding = 1) readonly buffer Velocities { vec4 velocities[]; };
layout(std430, binding = 2) readonly buffer Masses { float masses[]; };
layout(std430, binding = 3) buffer Sums { uint sums[]; };  // a channel's cells after another's
uniform float below, here, above;  // r^2 of the levels [cells^2]; equal where there is none

/// The two cells that a particle reaches along an axis, and the part of the first one.
struct Pair {
  int first, second;
  float part;
};

Pair make_pair(float at, int size) {
  precise float middle = clamp(at, 0.0, float(size)) - 0.5;
  float low = floor(middle);
  precise float part = 1.0 - (middle - low);
  return Pair(max(0, int(low)), min(int(low) + 1, size - 1), part);
}

/// Of this level.
float share_of(float square) {
  if (square >= here) {
    precise float upper = (square - here) / (above - here);
    precise float lower = 1.0 - upper;
    return square >= above ? (above > here ? 0.0 : 1.0) : lower;
  }
  precise float share = (square - below) / (here - below);
  return square >= below && here > below ? share : 0.0;
}

void add(uint place, int steps) {
  if (steps == 0) return;
  uint low = uint(steps);
  uint before = atomicAdd(sums[2u * place], low);
  uint high = (steps < 0 ? 0xffffffffu : 0u) + (before + low < before ? 1u : 0u);
  if (high != 0u) atomicAdd(sums[2u * place + 1u], high);
}

void main() {
  uint i = thread_index();
  if (i >= pass.particles) return;
  vec4 at = positions[i], v = velocities[i];
  if (any(isnan(at.xyz)) || any(isinf(at.xyz))) return;
  float mass = masses[i];
  precise float grown = pass.first_square + pass.growth * v.w;
  precise float square =
      clamp(min(grown, pass.widest_square) * (pass.inverse_voxel * pass.inverse_voxel), 1.0,
            kWidestSplat * kWidestSplat);
  float share = share_of(square);
  if (share == 0.0) return;
  precise vec3 cell = at.xyz * pass.inverse_voxel;
  Pair x = make_pair(cell.x, pass.size.x);
  Pair y = make_pair(cell.y, pass.size.y);
  Pair z = make_pair(cell.z, pass.size.z);
  precise float heat = mass * at.w * pass.heat_scale;
  precise float momentum = mass * pass.momentum_scale;
  precise float amounts[kSplatChannels] = float[kSplatChannels](
      mass * pass.mass_scale, heat, momentum * v.x, momentum * v.y, momentum * v.z);
  uint cells = uint(pass.size.w);
  for (int corner = 0; corner < 8; ++corner) {
    bvec3 last = bvec3(corner & 1, corner & 2, corner & 4);
    precise float of_z = share * (last.z ? 1.0 - z.part : z.part);
    precise float of_y = of_z * (last.y ? 1.0 - y.part : y.part);
    precise float weight = of_y * (last.x ? 1.0 - x.part : x.part);
    int place = (last.x ? x.second : x.first) +
                pass.size.x * ((last.y ? y.second : y.first) +
                               pass.size.y * (last.z ? z.second : z.first));
    for (uint c = 0u; c < kSplatChannels; ++c) {
      precise float steps = weight * amounts[c];
      add(c * cells + uint(place), int(roundEven(steps)));
    }
  }
}
#endif

#ifdef FOLD
layout(std430, binding = 0) buffer Sums { uint sums[]; };
layout(std430, binding = 1) buffer Amounts { float amounts[]; };  // channels as the sums'
uniform int replace;  // the amounts are unknown as yet

void main() {
  uint cell = thread_index();
  if (cell >= uint(pass.size.w)) return;
  for (uint c = 0u; c < kSplatChannels; ++c) {
    uint place = c * uint(pass.size.w) + cell;
    uint low = sums[2u * place], high = sums[2u * place + 1u];
    sums[2u * place] = sums[2u * place + 1u] = 0u;
    float sum = float(double(int(high)) * 4294967296.0lf + double(low));
    amounts[place] = replace != 0 ? sum : amounts[place] + sum;
  }
}
#endif

#ifdef BLUR
layout(std430, binding = 0) readonly buffer From { float from[]; };
layout(std430, binding = 1) readonly buffer Weights { float weights[]; };  // of all levels
layout(std430, binding = 2) writeonly buffer To { float to[]; };
uniform int axis, first, reach;  // this level's weights are at first, ..., first + reach

/// The cell that stands for one outside: the grid's ends are mirrors. The remainder of a negative
/// number isn't defined; no reach is beyond kWidestSplat.
int mirrored(int i, int size) {
  int turn = 2 * size;
  int within = (i + turn * int(kWidestSplat + 1.0)) % turn;
  return within < size ? within : turn - 1 - within;
}

void main() {
  uint cell = thread_index();
  if (cell >= uint(pass.size.w)) return;
  int stride = axis == 0 ? 1 : axis == 1 ? pass.size.x : pass.size.x * pass.size.y;
  int size = pass.size[axis];
  int own = int(cell) / stride % size;
  int origin = int(cell) - own * stride;
  for (int c = 0; c < int(kSplatChannels); ++c, origin += pass.size.w) {
    precise float sum = weights[first] * from[origin + own * stride];
    for (int k = 1; k <= reach; ++k) {
      precise float both = from[origin + mirrored(own - k, size) * stride] +
                           from[origin + mirrored(own + k, size) * stride];
      sum += weights[first + k] * both;
    }
    to[origin + own * stride] = sum;
  }
}
#endif

#ifdef RESOLVE
layout(std430, binding = 0) readonly buffer Amounts { float amounts[]; };
layout(std430, binding = 1) writeonly buffer Density { float density[]; };
layout(std430, binding = 2) writeonly buffer Temperature { float temperature[]; };
layout(std430, binding = 3) writeonly buffer Velocity { float velocity[]; };  // three a cell

void main() {
  uint cell = thread_index();
  if (cell >= uint(pass.size.w)) return;
  uint cells = uint(pass.size.w);
  float mass = amounts[cell];
  double edge = 1.0lf / double(pass.inverse_voxel);
  double scale = double(pass.mass_scale);
  float density_step = float(1.0lf / (scale * edge * edge * edge));
  float heat_step = float(scale / double(pass.heat_scale));
  float momentum_step = float(scale / double(pass.momentum_scale));
  float inverse = mass > 0.0 ? 1.0 / mass : 0.0;
  density[cell] = mass * density_step;
  temperature[cell] = amounts[cells + cell] * heat_step * inverse;
  for (uint a = 0u; a < 3u; ++a) {
    velocity[3u * cell + a] = amounts[(2u + a) * cells + cell] * (momentum_step * inverse);
  }
}
#endif
