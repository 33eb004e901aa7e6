layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in float in_finish;
uniform mat4 model;
out vec3 world;
out vec3 normal;
out vec3 local;
flat out float finish;
invariant gl_Position;

void main() {
  vec4 placed = model * vec4(in_position, 1.0);
  world = placed.xyz;
  normal = mat3(model) * in_normal;
  local = in_position;
  finish = in_finish;
  gl_Position = frame.projection * (frame.view * placed);
}
