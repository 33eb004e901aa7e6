// What a pixel shows, by number, and how warm its surface is.
uniform int label;
uniform float temperature;         // [K]; NaN: unknown
layout(location = 0) out uint label_out;
layout(location = 1) out float temperature_out;

void main() {
  label_out = uint(label);
  temperature_out = temperature;
}
