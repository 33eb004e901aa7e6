// A particle's square of smoke, the look of [De2006]: one texture for all. Blended from far to near.
uniform sampler2D puff_map;        // optical depth, its mean over the square 1
uniform sampler2D distance_map;    // axial distance of what lies behind [m]; negative: outside the field
uniform float albedo;
uniform float asymmetry;
in vec2 corner;
flat in float depth_in_middle;
flat in vec2 place;
flat in float axial;
out vec4 sprite;                   // as smoke_march.comp's light, and what is left of that behind

void main() {
  float behind = texelFetch(distance_map, ivec2(gl_FragCoord.xy), 0).r;
  if (axial > behind) discard;
  float depth = depth_in_middle * texture(puff_map, 0.5 + 0.5 * corner).r;
  float taken = 1.0 - exp(-depth);
  float s = 1.0 + asymmetry;
  float back = 0.25 * (1.0 - asymmetry * asymmetry) / (s * s * s);
  float h = 1.0 + 0.5 * asymmetry;
  float second = 0.25 * (1.0 - 0.25 * asymmetry * asymmetry) / (h * h * h);
  // With what is scattered once and twice more, as in the march, but not shaded by what is before it.
  float arriving = back + 0.6 * second + 0.36 * 0.25;
  float d = max(place.x, 0.02);
  sprite = vec4(taken * albedo * vec2(arriving * guide_spot(place.y) * 0.01 / (d * d), 1.0), 0.0,
                1.0 - taken);
}
