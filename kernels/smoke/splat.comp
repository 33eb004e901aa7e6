// splat (splat.h). ADD, a thread a particle, adds to sums in fixed point, in any order to the same
// bits: 64-bit numbers of two words, since 64-bit atomics are an extension. A particle adds less than
// 2^31 steps to a cell, so that 2^33 particles fit. RESOLVE, a thread a cell, makes means of them.
layout(std140, binding = 0) uniform Pass { SplatParameters pass; };

#ifdef ADD
layout(std430, binding = 0) readonly buffer Positions { vec4 positions[]; };
layout(std430, binding = 1) readonly buffer Velocities { vec4 velocities[]; };
layout(std430, binding = 2) readonly buffer Masses { float masses[]; };
layout(std430, binding = 3) buffer Sums { uint sums[]; };  // a channel's cells after another's

/// A tent along one axis, on cells inside the grid, with the sum of weights 1.
struct Tent {
  int first, count;
  float at, inverse, norm;
};

float raw_weight(Tent tent, int i) {
  precise float far = abs(float(tent.first + i) + 0.5 - tent.at);
  precise float weight = 1.0 - far * tent.inverse;
  return max(0.0, weight);
}

Tent make_tent(float at, float radius, int size) {
  Tent tent;
  precise float low = at - radius + 0.5, high = at + radius - 0.5;
  tent.at = at;
  tent.first = clamp(int(floor(low)), 0, size - 1);
  int last = clamp(int(floor(high)), tent.first, size - 1);
  tent.count = min(last - tent.first + 1, WIDEST);
  tent.inverse = 1.0 / radius;
  tent.norm = 0.0;
  precise float sum = 0.0;
  for (int i = 0; i < tent.count; ++i) sum += raw_weight(tent, i);
  if (sum > 0.0) {
    tent.norm = 1.0 / sum;
  } else {
    tent.count = 1;
  }
  return tent;
}

float weight_of(Tent tent, int i) {
  precise float weight = raw_weight(tent, i) * tent.norm;
  return tent.norm > 0.0 ? weight : 1.0;
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
  float mass = masses[i];
  precise float square = pass.first_square + pass.growth * v.w;
  precise float radius =
      clamp(min(sqrt(square), pass.widest) * pass.inverse_voxel, 1.0, 0.5 * float(WIDEST) - 1.0);
  precise vec3 cell = at.xyz * pass.inverse_voxel;
  Tent x = make_tent(cell.x, radius, pass.size.x);
  Tent y = make_tent(cell.y, radius, pass.size.y);
  Tent z = make_tent(cell.z, radius, pass.size.z);
  precise float heat = mass * at.w * pass.heat_scale;
  precise float momentum = mass * pass.momentum_scale;
  precise float amounts[5] = float[5](mass * pass.mass_scale, heat, momentum * v.x, momentum * v.y,
                                      momentum * v.z);
  uint cells = uint(pass.size.w);
  for (int cz = 0; cz < z.count; ++cz) {
    for (int cy = 0; cy < y.count; ++cy) {
      precise float across = weight_of(z, cz) * weight_of(y, cy);
      int row = x.first + pass.size.x * (y.first + cy + pass.size.y * (z.first + cz));
      for (int cx = 0; cx < x.count; ++cx) {
        float along = weight_of(x, cx);
        for (uint c = 0u; c < 5u; ++c) {
          precise float amount = across * amounts[c];
          precise float steps = amount * along + (amount < 0.0 ? -0.5 : 0.5);
          add(c * cells + uint(row + cx), int(steps));
        }
      }
    }
  }
}
#endif

#ifdef RESOLVE
layout(std430, binding = 0) readonly buffer Sums { uint sums[]; };
layout(std430, binding = 1) writeonly buffer Density { float density[]; };
layout(std430, binding = 2) writeonly buffer Temperature { float temperature[]; };
layout(std430, binding = 3) writeonly buffer Velocity { float velocity[]; };  // three a cell

double sum_of(uint channel, uint cell) {
  uint place = 2u * (channel * uint(pass.size.w) + cell);
  return double(int(sums[place + 1u])) * 4294967296.0lf + double(sums[place]);
}

void main() {
  uint cell = thread_index();
  if (cell >= uint(pass.size.w)) return;
  double mass = sum_of(0u, cell);
  double edge = 1.0lf / double(pass.inverse_voxel);
  double scale = double(pass.mass_scale);
  double inverse_mass = mass > 0.0lf ? 1.0lf / mass : 0.0lf;
  double heat_step = scale / double(pass.heat_scale);
  double momentum_step = scale / double(pass.momentum_scale);
  density[cell] = float(mass / (scale * edge * edge * edge));
  temperature[cell] = float(sum_of(1u, cell) * heat_step * inverse_mass);
  for (uint a = 0u; a < 3u; ++a) {
    velocity[3u * cell + a] = float(sum_of(2u + a, cell) * momentum_step * inverse_mass);
  }
}
#endif
