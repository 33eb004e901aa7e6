// What heat has made of the tissue, from bricks of voxels in rest space, and what one sees of it.
#include "kernels/heat/brick_layout.h"

#ifdef BURNT
uniform usampler3D brick_map;      // 0: no brick, else 1 + tile
uniform sampler3D burn_atlas;      // tiles of (kEdge + 2 kBorder)^3
uniform ivec3 first_brick;
uniform ivec3 atlas_tiles;
uniform float voxel;               // [m]

const int kEdge = int(kBrickEdge), kBorder = kBurnBorder;

struct Burn {
  float coagulated;                // of the proteins
  float dried;                     // 0 wet ... 1 dry and brown
  float charred;
  float excess;                    // temperature over the body's [K]
};

// Cubic B-spline weights folded into two linear fetches an axis [Sigg2005].
Burn burn_at(vec3 place) {
  vec3 voxels = place / voxel;
  ivec3 brick = ivec3(floor(voxels / float(kEdge)));
  ivec3 cell = brick - first_brick;
  ivec3 size = textureSize(brick_map, 0);
  bool outside = any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, size));
  int tile = outside ? 0 : int(texelFetch(brick_map, clamp(cell, ivec3(0), size - 1), 0).r);
  int index = max(tile - 1, 0);
  ivec3 corner = ivec3(index % atlas_tiles.x, (index / atlas_tiles.x) % atlas_tiles.y,
                       index / (atlas_tiles.x * atlas_tiles.y)) * (kEdge + 2 * kBorder);
  vec3 inside = voxels - vec3(brick * kEdge) + float(kBorder) - 0.5;
  vec3 base = floor(inside);
  vec3 f = inside - base;
  vec3 f2 = f * f, f3 = f2 * f;
  vec3 w0 = (1.0 - 3.0 * f + 3.0 * f2 - f3) / 6.0;
  vec3 w1 = (4.0 - 6.0 * f2 + 3.0 * f3) / 6.0;
  vec3 w3 = f3 / 6.0;
  vec3 g0 = w0 + w1;
  vec3 g1 = 1.0 - g0;
  vec3 scale = 1.0 / vec3(textureSize(burn_atlas, 0));
  vec3 low = (vec3(corner) + base - 0.5 + w1 / g0) * scale;
  vec3 high = (vec3(corner) + base + 1.5 + w3 / g1) * scale;
  vec4 upper = mix(mix(textureLod(burn_atlas, high, 0.0),
                      textureLod(burn_atlas, vec3(low.x, high.yz), 0.0), g0.x),
                  mix(textureLod(burn_atlas, vec3(high.x, low.y, high.z), 0.0),
                      textureLod(burn_atlas, vec3(low.xy, high.z), 0.0), g0.x), g0.y);
  vec4 lower = mix(mix(textureLod(burn_atlas, vec3(high.xy, low.z), 0.0),
                     textureLod(burn_atlas, vec3(low.x, high.y, low.z), 0.0), g0.x),
                 mix(textureLod(burn_atlas, vec3(high.x, low.yz), 0.0),
                     textureLod(burn_atlas, low, 0.0), g0.x), g0.y);
  vec4 value = mix(upper, lower, g0.z);
  // Empty voxels tell nothing: the mean is over those with tissue.
  vec3 mean = tile == 0 ? vec3(0.0) : value.xyz / max(value.w, 1e-3);
  return Burn(mean.x, clamp(2.0 * mean.y, 0.0, 1.0), clamp(2.0 * mean.y - 1.0, 0.0, 1.0),
              float(kHottestBurn) * mean.z);
}

// In flakes: 1 black, 0 dried.
float char_of(Burn burn, float flake) {
  return smoothstep(0.3, 0.9, burn.charred + 0.25 * flake * smoothstep(0.05, 0.3, burn.charred));
}

const vec3 kPale = vec3(0.40, 0.285, 0.20), kBrown = vec3(0.115, 0.052, 0.024),
           kBlack = vec3(0.012, 0.010, 0.009);

// Pale where proteins have coagulated, brown where it dries, black where it chars.
vec3 burnt_colour(vec3 albedo, Burn burn, float flake) {
  float pale = smoothstep(0.08, 0.85, burn.coagulated + 0.08 * flake * burn.coagulated);
  albedo = mix(albedo, mix(kPale, albedo, 0.25), pale);
  float brown = smoothstep(0.04, 0.6, burn.dried + 0.15 * flake * burn.dried);
  albedo = mix(albedo, kBrown * (1.0 + 0.5 * flake), brown);
  return mix(albedo, kBlack * (1.0 + 0.8 * flake), 0.93 * char_of(burn, flake));
}

// Light that tissue this hot gives off: Planck's radiation over a body's at 1150 K, nothing that one
// sees below 800 K.
const float kBody = 310.15;        // [K]
vec3 glow_of(float excess) {
  float kelvin = max(kBody + excess, 300.0);
  vec3 waves = vec3(22135.0, 26160.0, 30940.0);  // h c / (k lambda) at 650, 550 and 465 nm [K]
  float seen = smoothstep(780.0, 880.0, kelvin);
  return seen * exp(waves.x / 1150.0 - waves / kelvin);
}
#endif
