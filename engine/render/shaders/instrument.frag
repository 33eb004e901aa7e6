// Turned steel, insulating sleeve, heat-stained electrode.
in vec3 world;
in vec3 normal;
in vec3 local;                     // tip at the origin, shaft along +z [m]
flat in float finish;              // Finish of shader_layout.h
out vec4 radiance;

uniform mat4 model;

// What polished metal mirrors: lit organs where the lens looks, darkness behind it, in patches.
vec3 surroundings(vec3 direction, vec3 towards_lens, float distance_to_lens) {
  float facing = dot(direction, towards_lens);
  float patches = 0.75 + 0.6 * noise(2.3 * direction + 5.0).x;
  vec3 tissue = 0.7 * cavity_light(distance_to_lens) * patches;
  vec3 dark = frame.light.rgb * vec3(0.016, 0.012, 0.011);
  return mix(tissue, dark, smoothstep(-0.55, 0.45, facing));
}

void main() {
  vec3 to_lens = frame.eye.xyz - world;
  float distance_to_lens = length(to_lens);
  vec3 v = to_lens / distance_to_lens;
  vec3 n = normalize(normal);
  if (dot(n, v) < 0.0) n = reflect(n, v);
  float axial = -(frame.view * vec4(world, 1.0)).z;
  vec3 incoming = lens_light(distance_to_lens, axial / distance_to_lens);
  vec2 opened = open_at(axial);
  float open = opened.x;
  incoming *= mix(0.30, 1.0, opened.y);
  float pixel = 2.0 * frame.lens.y * axial / frame.picture.y;

  bool sleeve = finish == float(kSleeve);
  bool stained = finish == float(kElectrode);
  // Turning leaves grooves round the shaft; they tilt the normal along it.
  vec3 axis = mat3(model) * vec3(0.0, 0.0, 1.0);
  vec4 grooves = noise(vec3(local.xy * 60.0, local.z * 2600.0));
  vec4 wear = noise(local * vec3(900.0, 900.0, 240.0));
  float groove_kept = 1.0 - smoothstep(0.1, 0.5, pixel * 2600.0);
  n = normalize(n + axis * grooves.x * (sleeve ? 0.02 : 0.07) * groove_kept);

  float c = max(dot(n, v), 1e-3);
  vec3 mirrored = reflect(-v, n);
  if (sleeve) {
    vec3 albedo = vec3(0.016, 0.016, 0.018) * (1.0 + 0.2 * wear.x);
    float rough = filtered_roughness(n, 0.36 + 0.03 * wear.x);
    float fresnel = 0.04 + 0.96 * pow(1.0 - c, 5.0);
    radiance.rgb = albedo * incoming * c + incoming * 0.045 * retro_lobe(c, rough) +
                   fresnel * 0.6 * surroundings(mirrored, v, distance_to_lens) * open;
  } else {
    vec3 steel = vec3(0.60, 0.585, 0.565);
    if (stained) {
      // Old char on the electrode's end, straw to blue heat tints behind it.
      float burnt = 1.0 - smoothstep(1.5e-3, 5.5e-3, length(local) + 2.0e-3 * wear.x);
      steel = mix(vec3(0.46, 0.43, 0.39), vec3(0.05, 0.043, 0.04), burnt);
    }
    float rough = filtered_roughness(n, 0.22 + 0.04 * wear.x + (stained ? 0.14 : 0.0));
    float smudge = 0.88 + 0.12 * wear.x;
    // Turned grooves run round the shaft: light spreads across them, along the shaft.
    vec3 round_shaft = cross(axis, n);
    float turned = length(round_shaft);
    vec3 tangent = turned > 0.2 ? round_shaft / turned : normalize(cross(n, vec3(n.z, n.x, n.y)));
    float stretched = mix(rough, min(1.9 * rough, 0.75), smoothstep(0.3, 0.9, turned));
    vec3 lobe = incoming * min(brushed_lobe(n, v, tangent, rough, stretched), 8.0);
    // A rough second lobe stands for the light that grooves scatter sideways.
    vec3 scatter = incoming * 0.16 * retro_lobe(c, 0.66);
    vec3 fresnel = steel + (1.0 - steel) * pow(1.0 - c, 5.0);
    radiance.rgb = smudge * steel * (lobe * 0.85 + scatter) +
                   fresnel * surroundings(mirrored, v, distance_to_lens) * open;
  }
  radiance.rgb *= mix(0.45, 1.0, open);
  radiance.a = 1.0;
}
