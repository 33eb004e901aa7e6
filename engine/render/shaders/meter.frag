// One pixel: the factor that exposes the picture. Like a camera head's, the meter weighs the middle and
// goes only a part of the way, so that what is dark stays darker.
uniform sampler2D small_map;
out float exposure;

const float kMiddle = 0.135;       // luminance that is left alone
const float kShare = 0.75;         // of the way to it, in stops
const ivec2 kTaps = ivec2(36, 22);

void main() {
  float sum = 0.0, weights = 1e-4;
  for (int y = 0; y < kTaps.y; ++y) {
    for (int x = 0; x < kTaps.x; ++x) {
      vec2 place = (vec2(x, y) + 0.5) / vec2(kTaps);
      vec4 seen = textureLod(small_map, place, 0.0);
      vec2 aside = (place - 0.5) * vec2(frame.picture.x / frame.picture.y, 1.0);
      float luminance = dot(seen.rgb, vec3(0.2126, 0.7152, 0.0722));
      // What no light reaches isn't metered: a small body before darkness isn't burnt out.
      float weight = seen.a * exp(-6.0 * dot(aside, aside)) * smoothstep(0.002, 0.02, luminance);
      sum += weight * log2(clamp(luminance, 0.01, 1.5));
      weights += weight;
    }
  }
  float stops = weights > 0.5 ? log2(kMiddle) - sum / weights : 0.0;
  exposure = frame.shown.z * exp2(frame.shown.w * clamp(kShare * stops, -1.5, 1.5));
}
