// The endoscope's light sits at the lens: light, view and half vector are one.

// Irradiance [times pi, so that a white matte surface facing the lens at 10 cm has radiance 1] of
// the lens light at a distance [m], `axis` the cosine to the view axis.
vec3 lens_light(float distance_to_lens, float axis) {
  float d = max(distance_to_lens, 0.015);
  return frame.light.rgb * (0.01 / (d * d)) * guide_spot(axis);
}

// Light that has bounced about the cavity between red walls: it falls off more slowly.
vec3 cavity_light(float distance_to_lens) {
  return frame.light.rgb * vec3(0.098, 0.048, 0.037) * clamp(0.09 / distance_to_lens, 0.25, 1.6);
}

// What tissue gives back of the light that reaches it, without gloss. The colours that are absorbed
// least travel furthest under the surface: they wrap round the terminator. `incoming` meets it at
// `cosine`; of `around` as much as `open` says.
vec3 diffuse_tissue(vec3 albedo, float translucency, float cosine, vec3 incoming, vec3 around,
                    float open) {
  vec3 wrap = 0.6 * translucency * sqrt(albedo);
  vec3 lit = clamp((cosine + wrap) / ((1.0 + wrap) * (1.0 + wrap)), 0.0, 1.0);
  // Crevices are lit by what bounces between red walls: darker and redder, not grey.
  vec3 crevice = pow(vec3(open), vec3(1.3, 1.9, 2.0));
  return albedo * (lit * incoming * mix(vec3(1.0), crevice, 0.55) + around * crevice);
}

// GGX lobe [Walter2007] for light along the view: D G / (4 cos^2) times cos, for irradiance as
// above.
float retro_lobe(float cosine, float roughness) {
  float a = roughness * roughness;
  float a2 = a * a;
  float c = max(cosine, 1e-3);
  float t = c * c * (a2 - 1.0) + 1.0;
  float d = a2 / (t * t);
  // Both directions are the same, so both masking terms are.
  float g = 2.0 / (1.0 + sqrt(a2 + (1.0 - a2) * c * c) / c);
  return 0.25 * d * g * g / max(c, 0.05);
}

// Widens a lobe where the normal turns within a pixel, so that glints don't sparkle
// [Tokuyoshi2019].
float filtered_roughness(vec3 normal, float roughness) {
  vec3 u = dFdx(normal), v = dFdy(normal);
  float variance = 0.25 * (dot(u, u) + dot(v, v));
  float a = roughness * roughness;
  return sqrt(sqrt(a * a + min(2.0 * variance, 0.18)));
}

// The same with two roughnesses: `along` a unit tangent, `across` square to it and to the normal.
float brushed_lobe(vec3 n, vec3 v, vec3 along, float rough_along, float rough_across) {
  vec3 across = cross(n, along);
  float ax = rough_along * rough_along, ay = rough_across * rough_across;
  float c = max(dot(n, v), 1e-3);
  float x = dot(v, along) / ax, y = dot(v, across) / ay;
  float t = x * x + y * y + c * c;
  return 0.25 / (ax * ay * t * t) / max(c, 0.05) * c;
}
