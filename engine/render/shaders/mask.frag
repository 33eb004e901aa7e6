// Fills the depth buffer outside the round field of view, so that nothing is shaded there.
in vec2 uv;

void main() {
  vec2 p = (uv - 0.5) * vec2(picture.x / picture.y, 1.0);
  if (dot(p, p) < picture.w * picture.w) discard;
}
