// Connective tissue between organs: wet fibres, some of them in fat, charred where heat parted them.
// Colours are chosen by eye.
in vec3 world;
in vec3 normal;
flat in vec2 kind;                 // a number of its own in [0, 1); how charred it is
in float share;                    // of the way from its foot
out vec4 radiance;

const vec3 kFibre = vec3(0.40, 0.16, 0.115);
const vec3 kYellow = vec3(0.44, 0.24, 0.105);
const vec3 kChar = vec3(0.035, 0.022, 0.016);

void main() {
  vec3 to_lens = frame.eye.xyz - world;
  float distance_to_lens = length(to_lens);
  vec3 v = to_lens / distance_to_lens;
  float axial = -(frame.view * vec4(world, 1.0)).z;
  vec3 n = normalize(normal);
  if (dot(n, v) < 0.0) n = reflect(n, v);
  vec3 incoming = lens_light(distance_to_lens, axial / distance_to_lens);
  vec2 open = open_at(axial);
  incoming *= mix(0.30, 1.0, open.y);

  float own = fract(kind.x * 7.31);
  vec4 stain = noise(world / 1.7e-3 + 11.0 * kind.x);
  vec3 albedo = mix(kFibre, kYellow, smoothstep(0.35, 0.65, own));
  albedo *= 0.85 + 0.3 * fract(kind.x * 3.17) + 0.15 * stain.x;
  // Blood runs along from the feet.
  albedo = mix(albedo, vec3(0.27, 0.02, 0.015), 0.75 * smoothstep(1.1, 0.1, share + 0.7 * stain.x));
  albedo = mix(albedo, kChar, kind.y);

  float cosine = dot(n, v);
  vec3 diffuse = diffuse_tissue(albedo, 1.0 - kind.y, cosine, incoming,
                                cavity_light(distance_to_lens), open.x);
  float glint = 0.021 * (1.0 - kind.y) * retro_lobe(max(cosine, 0.0), filtered_roughness(n, 0.30));
  radiance = vec4(diffuse + incoming * min(glint, 4.0) * open.x, 1.0);
}
