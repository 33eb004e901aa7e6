// Gradient noise with its analytic derivative, from an integer hash: the same on every device.

// A vector in [-1, 1)^3 for a lattice point whose axes are already multiplied by their primes.
vec3 lattice_gradient(uint x, uint y, uint z) {
  uint h = (x ^ y ^ z) * 0x2c1b3c6du;
  h ^= h >> 15u;
  h *= 0x297a2d39u;
  return vec3(ivec3(int(h), int(h << 11u), int(h << 21u))) * (1.0 / 2147483648.0);
}

// x: value, about -1 ... 1; yzw: its gradient.
vec4 noise(vec3 x) {
  vec3 cell = floor(x);
  vec3 w = x - cell;
  vec3 u = w * w * w * (w * (w * 6.0 - 15.0) + 10.0);
  vec3 du = 30.0 * w * w * (w * (w - 2.0) + 1.0);
  uvec3 i = uvec3(ivec3(cell)) * uvec3(73856093u, 19349663u, 83492791u);
  uvec3 j = i + uvec3(73856093u, 19349663u, 83492791u);
  vec3 ga = lattice_gradient(i.x, i.y, i.z);
  vec3 gb = lattice_gradient(j.x, i.y, i.z);
  vec3 gc = lattice_gradient(i.x, j.y, i.z);
  vec3 gd = lattice_gradient(j.x, j.y, i.z);
  vec3 ge = lattice_gradient(i.x, i.y, j.z);
  vec3 gf = lattice_gradient(j.x, i.y, j.z);
  vec3 gg = lattice_gradient(i.x, j.y, j.z);
  vec3 gh = lattice_gradient(j.x, j.y, j.z);
  float va = dot(ga, w);
  float vb = dot(gb, w - vec3(1.0, 0.0, 0.0));
  float vc = dot(gc, w - vec3(0.0, 1.0, 0.0));
  float vd = dot(gd, w - vec3(1.0, 1.0, 0.0));
  float ve = dot(ge, w - vec3(0.0, 0.0, 1.0));
  float vf = dot(gf, w - vec3(1.0, 0.0, 1.0));
  float vg = dot(gg, w - vec3(0.0, 1.0, 1.0));
  float vh = dot(gh, w - vec3(1.0, 1.0, 1.0));
  float kx = vb - va, ky = vc - va, kz = ve - va;
  float kxy = va - vb - vc + vd, kyz = va - vc - ve + vg, kzx = va - vb - ve + vf;
  float kxyz = -va + vb + vc - vd + ve - vf - vg + vh;
  float value = va + u.x * kx + u.y * ky + u.z * kz + u.x * u.y * kxy + u.y * u.z * kyz +
                u.z * u.x * kzx + u.x * u.y * u.z * kxyz;
  vec3 gradient = ga + u.x * (gb - ga) + u.y * (gc - ga) + u.z * (ge - ga) +
                  u.x * u.y * (ga - gb - gc + gd) + u.y * u.z * (ga - gc - ge + gg) +
                  u.z * u.x * (ga - gb - ge + gf) +
                  u.x * u.y * u.z * (-ga + gb + gc - gd + ge - gf - gg + gh) +
                  du * (vec3(kx, ky, kz) + u.yzx * vec3(kxy, kyz, kzx) +
                        u.zxy * vec3(kzx, kxy, kyz) + u.yzx * u.zxy * kxyz);
  return vec4(value, gradient);
}
