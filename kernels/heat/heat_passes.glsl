// What the kernels of heat share: HeatParameters (bioheat_passes.h) as GLSL sees it, the table of warm
// bricks, and what a brick looks like. A work group is a brick, a thread a voxel.
struct HeatParameters {
  float dry_conductivity, wet_conductivity, conductivity_slope;
  float boiling;
  float solids_capacity, water_capacity;
  float lost_solids;
  float drain;
  float inverse_square;
  float damage_exponent;
  float damage_kelvin;
  float resting_rate;
  float body;
  float voxel;
  float followed;
  float latent_heat;
  float water_mass;
  float fumes_mass;
  float pyrolysis_exponent;
  float pyrolysis_kelvin;
  float pyrolysis_heat;
  float cooling;
  float evaporation;
  float resting_vapour;
  float vapour_slope;
};
layout(std140, binding = 0) uniform Pass { HeatParameters pass; };

/// A warm brick: where its fields are, and its neighbours' at -x, +x, -y, +y, -z, +z; -1: none is warm.
struct HeatEntry {
  int slot;
  int geometry;
  int heated;  // else its sources are old
  int beside[6];
};
layout(std430, binding = 0) readonly buffer Table { HeatEntry table[]; };

const uint EDGE = 8u, LAYER = 64u, VOXELS = 512u;
layout(local_size_x = 512) in;
uniform int groups;  // of this dispatch; the grid may hold more

// Of a brick's geometry, in words.
const uint OPEN_X = 512u, OPEN_Y = OPEN_X + 576u, OPEN_Z = OPEN_Y + 576u, AREA = OPEN_Z + 576u;
const uint GEOMETRY = AREA + 512u;

uint group_index() {
  return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

/// What a step leaves of a brick; by slot.
struct HeatSums {
  float latent, vapour, pyrolysis, gas;  // [J/m3] of a voxel
  float stored;                          // likewise
  float greatest;
  uint vapours;  // voxels that gave off any
  uint changed;  // CHANGED_... bits
  float border[6];
};

/// e^x as lanes_math.h has it.
float exponential(float x) {
  x = clamp(x, -87.0, 88.0);
  float halves = roundEven(x * 1.44269504);
  precise float high = x - halves * 0.693359375;
  float r = high - halves * -2.12194440e-4;
  float p = r * 1.9875691500e-4 + 1.3981999507e-3;
  p = p * r + 8.3334519073e-3;
  p = p * r + 4.1665795894e-2;
  p = p * r + 1.6666665459e-1;
  p = p * r + 5.0000001201e-1;
  p = p * (r * r) + r + 1.0;
  return p * intBitsToFloat((int(halves) + 127) << 23);
}

/// e^x - 1, without the cancellation near 0.
float exponential_less_one(float x) {
  if (abs(x) > 0.4) return exponential(x) - 1.0;
  return x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 *
         (1.0 + x / 6.0 * (1.0 + x / 7.0))))));
}
