// One half of a strand a time: a tube from its foot on a surface to where its other half goes on, or
// to where it tore.
layout(location = 0) in vec3 in_ring;   // share of the way, cosine and sine about it
layout(location = 1) in vec4 in_foot;   // place, radius [m]
layout(location = 2) in vec4 in_reach;  // from the foot to the end, radius there [m]
layout(location = 3) in vec3 in_bend;   // of its end, aside [m]
layout(location = 4) in vec2 in_kind;   // a number of its own in [0, 1); how charred it is
out vec3 world;
out vec3 normal;
flat out vec2 kind;                     // the number of its own, how charred
out float share;
invariant gl_Position;

const float kSunk = 0.25e-3;            // of a foot under the surface, so that no gap shows [m]

void main() {
  float reach = max(length(in_reach.xyz), 1e-6);
  vec3 along = in_reach.xyz / reach;
  vec3 side = normalize(cross(along, abs(along.z) < 0.8 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0)));
  vec3 across = cross(along, side);
  share = in_ring.x;
  float flare = (1.0 - share) * (1.0 - share);
  float radius = mix(in_reach.w, in_foot.w, flare);
  normal = in_ring.y * side + in_ring.z * across;
  world = in_foot.xyz + along * mix(-kSunk, reach, share) + share * share * in_bend + radius * normal;
  kind = in_kind;
  gl_Position = frame.projection * (frame.view * vec4(world, 1.0));
}
