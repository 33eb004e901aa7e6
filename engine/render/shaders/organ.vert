layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in vec3 in_rest;
layout(location = 3) in vec3 in_rest_normal;
layout(location = 4) in float in_depth;  // 0 where nothing is given
uniform mat4 model;
out vec3 world;
out vec3 organ_normal;
out vec3 rest;
out vec3 rest_normal;
out float depth;
invariant gl_Position;

void main() {
  vec4 placed = model * vec4(in_position, 1.0);
  world = placed.xyz;
  organ_normal = in_normal;
  rest = in_rest;
  rest_normal = in_rest_normal;
  depth = in_depth;
  gl_Position = frame.projection * (frame.view * placed);
}
