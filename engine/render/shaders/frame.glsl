// What every pass knows of the picture.
#include "engine/render/shader_layout.h"

layout(std140, binding = 0) uniform Frame { FrameBlock frame; };

const float kPi = 3.14159265;
const vec2 kGuide = vec2(0.0015, 0.0045);   // of the light guide off the lens, right and up [m]

// How much of its light the guide sends aside, at the cosine `axis` to the view axis.
float guide_spot(float axis) { return mix(0.45, 1.0, smoothstep(0.70, 1.0, axis)); }

// Distance along the view axis [m] of a value of the depth buffer (0 near ... 1 far).
float axial_distance(float depth) {
  return frame.lens.z * frame.lens.w / (frame.lens.w - depth * (frame.lens.w - frame.lens.z));
}

// Point at unit axial distance in view space (x right, y up, z towards the viewer) under uv.
vec3 view_ray(vec2 uv) { return vec3((2.0 * uv - 1.0) * frame.lens.xy, -1.0); }

// Blue-looking dither in [0, 1): [Jimenez2014].
float interleaved_noise(vec2 pixel) {
  return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}
