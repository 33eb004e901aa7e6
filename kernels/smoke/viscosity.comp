// ViscosityPass (viscosity.h) on particles sorted by bin.comp, a thread each: DENSITY finds what they
// fill and how strongly each takes part in pairs, PAIRS their accelerations.
#include "kernels/smoke/smoke_passes.glsl"
#pragma passes DENSITY PAIRS

layout(std140, binding = 0) uniform Pass { ViscosityParameters pass; };
layout(std140, binding = 1) uniform Bins { BinParameters grid; };

layout(std430, binding = 0) readonly buffer CellBegin { uint cell_begin[]; };
layout(std430, binding = 1) readonly buffer Positions { vec4 positions[]; };

/// 1 - r^2/h^2. Rounded as on the CPU, so that both have the same neighbours.
float closeness(vec3 d) {
  precise float q = 1.0 - (d.x * d.x + d.y * d.y + d.z * d.z) * pass.inverse_square;
  return max(q, 0.0);
}

/// The particles of run 0 to 8 of the 27 cells about a cell: SmokeBins::runs.
uvec2 run_of(uint cell, int run) {
  int row = grid.size.x * ((run % 3 - 1) + grid.size.y * (run / 3 - 1));
  uint middle = uint(int(cell) + row);
  return uvec2(cell_begin[middle - 1u], cell_begin[middle + 2u]);
}

#ifdef DENSITY
layout(std430, binding = 2) writeonly buffer Strengths { vec2 strengths[]; };  // g; excess
layout(std430, binding = 3) writeonly buffer Accelerations { vec4 accelerations[]; };
layout(std430, binding = 4) buffer Counters { uint counters[]; };

shared uint isolated;

/// True where the particle has too few neighbours.
bool find_density(uint i) {
  vec3 at = positions[i].xyz;
  uint cell = cell_number(at, grid.origin.xyz, grid.inverse_cell, grid.size.xyz);
  float cubes = 0.0, squares = 0.0;
  vec3 first = vec3(0.0);
  uint near = 0u;
  for (int run = 0; run < 9; ++run) {
    uvec2 range = run_of(cell, run);
    for (uint j = range.x; j < range.y; ++j) {
      vec3 d = positions[j].xyz - at;
      float q = closeness(d);
      float square = q * q;
      near += q > 0.0 ? 1u : 0u;
      squares += square;
      cubes += square * q;
      first += square * d;
    }
  }
  bool alone = near < pass.fewest_neighbours + 1u;  // itself
  float moment = squares - cubes;
  float first_square = dot(first, first) * pass.inverse_square;
  float relaxed = moment - 2.0 * first_square / max(squares - 1.0, 1e-6);
  float used = max(max(relaxed, kLeastOfMoment * moment), kLeastOfDensity * cubes);
  float phi = pass.fill * cubes;
  strengths[i] = vec2(alone ? 0.0 : 6.0 * pass.inverse_square / used,
                      clamp(phi - 1.0, 0.0, pass.most_excess));
  accelerations[i] = vec4(0.0, 0.0, 0.0, pass.gas_drag * max(0.0, 1.0 - phi));
  return alone;
}

void main() {
  if (gl_LocalInvocationID.x == 0u) isolated = 0u;
  barrier();
  uint i = thread_index();
  if (i < pass.particles && find_density(i)) atomicAdd(isolated, 1u);
  barrier();
  if (gl_LocalInvocationID.x == 0u && isolated > 0u) atomicAdd(counters[kIsolatedWord], isolated);
}
#endif

#ifdef PAIRS
layout(std430, binding = 2) readonly buffer Velocities { vec4 velocities[]; };
layout(std430, binding = 3) readonly buffer Strengths { vec2 strengths[]; };
layout(std430, binding = 4) buffer Accelerations { vec4 accelerations[]; };

void main() {
  uint i = thread_index();
  if (i >= pass.particles) return;
  vec3 at = positions[i].xyz, v = velocities[i].xyz;
  vec2 own = strengths[i];
  float viscosity = pass.laplacian == kPairwise ? pass.viscosity : 0.0;
  uint cell = cell_number(at, grid.origin.xyz, grid.inverse_cell, grid.size.xyz);
  vec3 sum = vec3(0.0);
  for (int run = 0; run < 9; ++run) {
    uvec2 range = run_of(cell, run);
    for (uint j = range.x; j < range.y; ++j) {
      vec3 d = positions[j].xyz - at;
      float q = closeness(d);
      if (q == 0.0) continue;
      vec2 other = strengths[j];
      float weight =
          q * q * min(0.5 * (other.x + own.x), kMostRatio * min(other.x, own.x));
      float push = pass.crowding * weight * (other.y + own.y);
      sum += viscosity * weight * (velocities[j].xyz - v) - push * d;
    }
  }
  accelerations[i].xyz = sum;
}
#endif
