// What a pixel shows, by number, and how warm its surface is.
uniform int label;
uniform float temperature;         // [K]; NaN: unknown; of an organ that was burnt: where it isn't warm
#ifdef BURNT
in vec3 rest;
#endif
layout(location = 0) out uint label_out;
layout(location = 1) out float temperature_out;

void main() {
  label_out = uint(label);
  temperature_out = temperature;
#ifdef BURNT
  temperature_out += burn_at(rest).excess;
#endif
}
