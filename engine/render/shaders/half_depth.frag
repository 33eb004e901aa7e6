// Axial distance at half resolution; negative outside the field of view.
uniform sampler2D depth_map;
out float distance_out;

void main() {
  float depth = texelFetch(depth_map, ivec2(gl_FragCoord.xy) * 2, 0).r;
  distance_out = depth == 0.0 ? -1.0 : axial_distance(depth);
}
