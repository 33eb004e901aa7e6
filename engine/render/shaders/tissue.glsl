// Patterns of tissue in rest space.

// How much of a pattern of this wavelength survives pixels this wide.
float kept(float wavelength, float pixel) {
  return 1.0 - smoothstep(0.22, 0.55, pixel / wavelength);
}

// A direction of the body at rest, turned the shortest way from the rest normal to the deformed one.
vec3 to_deformed(vec3 v, vec3 from, vec3 to) {
  vec3 axis = cross(from, to);
  float c = dot(from, to);
  return v * c + cross(axis, v) + axis * (dot(axis, v) / (1.0 + max(c, -0.95)));
}

#ifdef LOBULES
struct Lobule {
  float inside;   // 1 in the middle of a lobule, 0.5 in the furrow between two
  float tone;     // of its own, -1 ... 1
  vec3 slope;     // of domes as high as half a cell, per cell
};

// Soft cells about jittered points, one a unit cube.
Lobule lobule_at(vec3 x) {
  vec3 low = floor(x - 0.5);
  float sum = 1e-6, best = 0.0, tone = 0.0;
  vec3 pull = vec3(0.0);
  for (int i = 0; i < 8; ++i) {
    vec3 cell = low + vec3(i & 1, (i >> 1) & 1, i >> 2);
    uvec3 key = uvec3(ivec3(cell)) * uvec3(73856093u, 19349663u, 83492791u);
    vec3 random = lattice_gradient(key.x, key.y, key.z);
    vec3 apart = x - (cell + 0.5 + 0.36 * random);
    float weight = exp(-13.0 * dot(apart, apart));
    sum += weight;
    best = max(best, weight);
    tone += weight * random.y;
    pull += weight * apart;
  }
  return Lobule(best / sum, tone / sum, -2.0 * pull / sum);
}
#endif

#ifdef VESSELS
uniform sampler2D vessel_map;      // coverage of arteries and of veins over a repeating square
uniform float vessel_scale;        // edge of the square [m]

// The square laid on along the three axes; the nearest to the normal shows.
vec2 vessels_at(vec3 p, vec3 normal) {
  vec3 weight = pow(abs(normal), vec3(6.0));
  weight /= weight.x + weight.y + weight.z;
  vec3 q = p / vessel_scale;
  return weight.x * texture(vessel_map, q.yz + 0.31).rg +
         weight.y * texture(vessel_map, q.zx + 0.57).rg +
         weight.z * texture(vessel_map, q.xy + 0.83).rg;
}
#endif
