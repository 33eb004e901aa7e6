// Covers the field of view: a disc (a fan of kRimCorners + 2 vertices) where the picture is round,
// since half of a wide frame lies outside it; else one triangle over everything. Lies on the far
// plane.
out vec2 uv;

void main() {
  if (frame.picture.w < 1.0) {
    float angle = 6.2831853 * float(gl_VertexID - 1) / float(kRimCorners);
    // The polygon's flats must still touch the circle.
    float reach = gl_VertexID == 0 ? 0.0 : frame.picture.w / cos(3.14159265 / float(kRimCorners));
    uv = 0.5 + reach * vec2(cos(angle) * frame.picture.y / frame.picture.x, sin(angle));
  } else {
    uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
  }
  gl_Position = vec4(2.0 * uv - 1.0, 1.0, 1.0);
}
