// What a burn has done to the tissue: damage 0 ... 1 from bricks of voxels in rest space, and what one
// sees of it.
#ifdef BURNT
uniform usampler3D brick_map;      // 0: no brick, else 1 + tile
uniform sampler3D damage_atlas;    // tiles of (kEdge + 2 kBorder)^3
uniform ivec3 first_brick;
uniform ivec3 atlas_tiles;
uniform float voxel;               // [m]

const int kEdge = 8;
const int kBorder = 2;

// Cubic B-spline weights folded into two linear fetches an axis [Sigg2005].
float damage_at(vec3 place) {
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
  vec3 scale = 1.0 / vec3(textureSize(damage_atlas, 0));
  vec3 low = (vec3(corner) + base - 0.5 + w1 / g0) * scale;
  vec3 high = (vec3(corner) + base + 1.5 + w3 / g1) * scale;
  vec4 near = vec4(textureLod(damage_atlas, low, 0.0).r,
                   textureLod(damage_atlas, vec3(high.x, low.yz), 0.0).r,
                   textureLod(damage_atlas, vec3(low.x, high.y, low.z), 0.0).r,
                   textureLod(damage_atlas, vec3(high.xy, low.z), 0.0).r);
  vec4 far = vec4(textureLod(damage_atlas, vec3(low.xy, high.z), 0.0).r,
                  textureLod(damage_atlas, vec3(high.x, low.y, high.z), 0.0).r,
                  textureLod(damage_atlas, vec3(low.x, high.yz), 0.0).r,
                  textureLod(damage_atlas, high, 0.0).r);
  vec4 z = near * g0.z + far * g1.z;
  vec2 y = z.xy * g0.y + z.zw * g1.y;
  return tile == 0 ? 0.0 : y.x * g0.x + y.y * g1.x;
}

// How much is charred, in flakes: 1 black, 0 dried.
float charred(float damage, float flake) {
  return smoothstep(0.55, 0.97, damage + 0.22 * flake * smoothstep(0.3, 0.6, damage));
}

const vec3 kPale = vec3(0.36, 0.235, 0.155), kBrown = vec3(0.115, 0.052, 0.024),
           kBlack = vec3(0.012, 0.010, 0.009);

// Blanched where proteins have coagulated, brown where it dries, black where it chars.
vec3 burnt_colour(vec3 albedo, float damage, float flake) {
  // Blanching sets in far below the heat that dries.
  float blanched = smoothstep(0.12, 0.80, sqrt(sqrt(damage)) + 0.10 * flake * damage);
  albedo = mix(albedo, mix(kPale, albedo, 0.35), blanched);
  albedo = mix(albedo, kBrown * (1.0 + 0.5 * flake), smoothstep(0.26, 0.62, damage));
  return mix(albedo, kBlack * (1.0 + 0.8 * flake), 0.93 * charred(damage, flake));
}
#endif
