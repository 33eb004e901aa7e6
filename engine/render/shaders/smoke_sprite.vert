// One square a particle, facing the lens.
layout(location = 0) in vec4 in_particle;  // place [m], radius [m]
layout(location = 1) in float in_mass;     // [kg]
uniform float mass_extinction;             // [m2/kg]
out vec2 corner;
flat out float depth_in_middle;            // optical, were it spread evenly over the square
flat out vec2 place;                       // distance to the lens, and its cosine to the view axis
flat out float axial;

void main() {
  corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  vec4 centre = frame.view * vec4(in_particle.xyz, 1.0);
  axial = -centre.z;
  place = vec2(length(centre.xyz), axial / length(centre.xyz));
  depth_in_middle = mass_extinction * in_mass / (4.0 * in_particle.w * in_particle.w);
  centre.xy += corner * in_particle.w;
  gl_Position = axial > frame.lens.z ? frame.projection * centre : vec4(0.0, 0.0, -2.0, 1.0);
}
