// What of the surroundings' light (x) and of the lens's (y) gets to this pixel: four neighbours of the
// half-resolution map, those at the pixel's distance.
uniform sampler2D open_map;
uniform sampler2D distance_map;    // axial [m]

vec2 open_at(float axial) {
  vec2 place = gl_FragCoord.xy / frame.picture.xy;
  vec2 f = fract(place * vec2(textureSize(open_map, 0)) - 0.5);
  // Order of textureGather: from the upper left, against the clock's sense seen with y down.
  vec4 near = vec4((1.0 - f.x) * f.y, f.x * f.y, f.x * (1.0 - f.y), (1.0 - f.x) * (1.0 - f.y));
  vec4 apart = (textureGather(distance_map, place) - axial) / axial;
  vec4 weight = (near + 1e-3) / (1e-3 + apart * apart);
  weight /= dot(weight, vec4(1.0));
  return vec2(dot(weight, textureGather(open_map, place, 0)),
              dot(weight, textureGather(open_map, place, 1)));
}
