// What every pass knows of the picture. Mirrors FrameBlock in canvas.cpp.
layout(std140, binding = 0) uniform Frame {
  mat4 view;
  mat4 projection;
  vec4 eye;        // lens [m], its barrel distortion per square of the picture's height
  vec4 light;      // linear RGB times intensity
  vec4 lens;       // tan of half the field of view across and up, near, far [m]
  vec4 picture;    // shaded width, height [pixels], number of the picture, radius of the mask / height
  vec4 shown;      // the picture's width, height [pixels], exposure, 1: automatic exposure besides
};

const float kPi = 3.14159265;
const vec2 kGuide = vec2(0.0015, 0.0045);   // of the light guide off the lens, right and up [m]

// How much of its light the guide sends aside, at the cosine `axis` to the view axis.
float guide_spot(float axis) { return mix(0.45, 1.0, smoothstep(0.70, 1.0, axis)); }

// Distance along the view axis [m] of a value of the depth buffer (0 near ... 1 far).
float axial_distance(float depth) {
  return lens.z * lens.w / (lens.w - depth * (lens.w - lens.z));
}

// Point at unit axial distance in view space (x right, y up, z towards the viewer) under uv.
vec3 view_ray(vec2 uv) { return vec3((2.0 * uv - 1.0) * lens.xy, -1.0); }

// Blue-looking dither in [0, 1): [Jimenez2014].
float interleaved_noise(vec2 pixel) {
  return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}
