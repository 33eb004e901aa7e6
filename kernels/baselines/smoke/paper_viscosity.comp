// add_paper_viscosity (paper_viscosity.cpp), a thread a particle, in double precision as there: the
// moment matrix of a lopsided neighbourhood leaves nothing of single precision. What the CPU keeps
// of the neighbours in a list is found again in each of four rounds, for registers' sake.
#include "kernels/smoke/smoke_passes.glsl"

layout(std140, binding = 0) uniform Pass { ViscosityParameters pass; };
layout(std140, binding = 1) uniform Bins { BinParameters grid; };

layout(std430, binding = 0) readonly buffer CellBegin { uint cell_begin[]; };
layout(std430, binding = 1) readonly buffer Positions { vec4 positions[]; };
layout(std430, binding = 2) readonly buffer Velocities { vec4 velocities[]; };
layout(std430, binding = 3) readonly buffer Strengths { vec2 strengths[]; };
layout(std430, binding = 4) buffer Accelerations { vec4 accelerations[]; };

uvec2 run_of(uint cell, int run) {
  int row = grid.size.x * ((run % 3 - 1) + grid.size.y * (run / 3 - 1));
  uint middle = uint(int(cell) + row);
  return uvec2(cell_begin[middle - 1u], cell_begin[middle + 2u]);
}

/// x_j - x_i over h, and 1 - its square; false where j is out of reach or isolated.
bool is_neighbour(vec3 at, uint j, double inverse_h, out dvec3 offset, out double q) {
  offset = inverse_h * dvec3(positions[j].xyz - at);
  q = 1.0lf - dot(offset, offset);
  return q > 0.0lf && strengths[j].x != 0.0;
}

double component(dvec3 v, int k) {
  return k == 0 ? v.x : k == 1 ? v.y : v.z;
}

/// The greatest sum of sizes in a column.
double norm_of(dmat4 a) {
  double most = 0.0lf;
  for (int c = 0; c < 4; ++c) {
    dvec4 sizes = abs(a[c]);
    most = max(most, (sizes.x + sizes.y) + (sizes.z + sizes.w));
  }
  return most;
}

/// The inverse of a symmetric matrix by Cholesky; false where it isn't positive, or its condition
/// is beyond what may be inverted. Arrays, since drivers are known that can't write to a component
/// of a double vector by a number that isn't constant.
bool invert(dmat4 matrix, out dmat4 inverse_a) {
  double a[4][4], l[4][4], m[4][4];  // a = l l^T, m = l^-1; [column][row]
  for (int c = 0; c < 4; ++c) {
    a[c] = double[4](matrix[c].x, matrix[c].y, matrix[c].z, matrix[c].w);
    l[c] = m[c] = double[4](0.0lf, 0.0lf, 0.0lf, 0.0lf);
  }
  inverse_a = dmat4(0.0lf);
  for (int c = 0; c < 4; ++c) {
    double pivot = a[c][c];
    for (int k = 0; k < c; ++k) pivot -= l[k][c] * l[k][c];
    if (!(pivot > 0.0lf)) return false;
    l[c][c] = sqrt(pivot);
    for (int r = c + 1; r < 4; ++r) {
      double rest = a[c][r];
      for (int k = 0; k < c; ++k) rest -= l[k][r] * l[k][c];
      l[c][r] = rest / l[c][c];
    }
  }
  for (int c = 0; c < 4; ++c) {
    m[c][c] = 1.0lf / l[c][c];
    for (int r = c + 1; r < 4; ++r) {
      double rest = 0.0lf;
      for (int k = c; k < r; ++k) rest -= l[k][r] * m[c][k];
      m[c][r] = rest / l[r][r];
    }
  }
  dmat4 inverse_l;
  for (int c = 0; c < 4; ++c) inverse_l[c] = dvec4(m[c][0], m[c][1], m[c][2], m[c][3]);
  inverse_a = transpose(inverse_l) * inverse_l;
  return 1.0lf > kLeastCondition * norm_of(matrix) * norm_of(inverse_a);
}

void main() {
  uint i = thread_index();
  if (i >= pass.particles) return;
  if (strengths[i].x == 0.0) return;
  vec3 at = positions[i].xyz;
  dvec3 now = dvec3(velocities[i].xyz);
  uint cell = cell_number(at, grid.origin.xyz, grid.inverse_cell, grid.size.xyz);
  double inverse_h = sqrt(double(pass.inverse_square));
  dvec3 offset;
  double q;

  // Moments by component of velocity are matrices of one column each.
  dmat4 a = dmat4(0.0lf);
  dmat3x4 f = dmat3x4(0.0lf);
  dvec3 low = now, high = now;
  for (int run = 0; run < 9; ++run) {
    uvec2 range = run_of(cell, run);
    for (uint j = range.x; j < range.y; ++j) {
      if (!is_neighbour(at, j, inverse_h, offset, q)) continue;
      dvec4 p = dvec4(1.0lf, offset);
      dvec4 weighted = q * q * q * p;
      dvec3 v = dvec3(velocities[j].xyz);
      a += outerProduct(weighted, p);
      f += outerProduct(weighted, v);
      low = min(low, v);
      high = max(high, v);
    }
  }
  dmat4 inverse_a;
  if (!invert(a, inverse_a)) return;
  dmat3x4 c = inverse_a * f;

  dmat3x4 right = dmat3x4(0.0lf);
  dvec3 result = dvec3(0.0lf);
  for (int k = 0; k < 3; ++k) {
    dmat4 a_k = dmat4(0.0lf);
    dmat3x4 r_k = dmat3x4(0.0lf);
    for (int run = 0; run < 9; ++run) {
      uvec2 range = run_of(cell, run);
      for (uint j = range.x; j < range.y; ++j) {
        if (!is_neighbour(at, j, inverse_h, offset, q)) continue;
        dvec4 p = dvec4(1.0lf, offset);
        dmat3x4 misfit = outerProduct(p, dvec3(velocities[j].xyz) - p * c);
        double weight = 6.0lf * q * q * component(offset, k);
        a_k += weight * outerProduct(p, p);
        r_k += weight * misfit;
        if (k == 0) right += (-18.0lf * q * q + 24.0lf * q * dot(offset, offset)) * misfit;
      }
    }
    dmat3x4 c_k = inverse_a * r_k;
    right -= 2.0lf * (a_k * c_k);
    result += 2.0lf * dvec3(component(c_k[0].yzw, k), component(c_k[1].yzw, k), component(c_k[2].yzw, k));
  }
  dmat3x4 last = inverse_a * right;
  result += dvec3(last[0][0], last[1][0], last[2][0]);

  double dt = double(pass.step);
  double factor = double(pass.viscosity) * double(pass.inverse_square);
  dvec3 then = min(max(now + dt * factor * result, low), high);
  accelerations[i].xyz += vec3((then - now) / dt);
}
