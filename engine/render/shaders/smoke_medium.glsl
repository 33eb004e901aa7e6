// What smoke does to light on rays from the lens: the sum over all volumes, which may overlap. A grid
// of columns over the picture and of slices along the view axis, between the two distances of
// `slices`, holds what has gathered from the lens (or the guide) up to each slice's far side; texel 0
// is the first slice's near side.
struct Volume {
  vec3 low, size;                  // of the texture [m]
  vec3 filled_low, filled_high;    // where there is any smoke
  vec3 optics;                     // mass extinction [m2/kg], that times albedo, and times g besides
};
uniform Volume volumes[VOLUMES];
uniform sampler3D density_maps[VOLUMES];  // r: smoke per volume [kg/m3]; g: its temperature excess [K]
uniform vec3 background;           // optics as above times the density mixed into the whole cavity [1/m]
uniform vec2 slices;               // axial [m]
uniform mat3 view_to_world;

// Axial distances between which a ray from the lens (world, unit axial distance) meets a volume.
vec2 span_of(int v, vec3 from, vec3 ray) {
  vec3 inverse = 1.0 / (ray + vec3(equal(ray, vec3(0.0))) * 1e-9);
  vec3 a = (volumes[v].filled_low - from) * inverse, b = (volumes[v].filled_high - from) * inverse;
  vec3 low = min(a, b), high = max(a, b);
  return vec2(max(low.x, max(low.y, low.z)), min(high.x, min(high.y, high.z)));
}
