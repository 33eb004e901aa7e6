// collide (collide.h), a thread a particle: only those in cells with triangles or capsules do more
// than look their cell up. What touching particles leave is not summed here: the CPU compares masses.
#include "kernels/smoke/smoke_passes.glsl"

layout(std140, binding = 0) uniform Pass { CollideParameters pass; };

layout(std430, binding = 0) readonly buffer CellBegin { uint cell_begin[]; };
layout(std430, binding = 1) readonly buffer Entries { uint entries[]; };
layout(std430, binding = 2) readonly buffer Triangles { SurfaceTriangle triangles[]; };
layout(std430, binding = 3) readonly buffer Near { uint capsules_near[]; };
layout(std430, binding = 4) readonly buffer Capsules { SmokeCapsule capsules[]; };
layout(std430, binding = 5) buffer Positions { vec4 positions[]; };
layout(std430, binding = 6) buffer Velocities { vec4 velocities[]; };
layout(std430, binding = 7) buffer Masses { float masses[]; };
layout(std430, binding = 8) buffer Fates { uint fates[]; };
layout(std430, binding = 9) buffer Counters { uint counters[]; };

const float FARTHEST = 3.402823466e38;

/// The nearest point of a triangle by its corners' weights; `feature` counts its pseudo-normals.
/// [Ericson2005] 5.1.5.
vec3 nearest_on(uint triangle, vec3 p, out int feature) {
  vec3 a = triangles[triangle].corners[0].xyz;
  vec3 b = triangles[triangle].corners[1].xyz;
  vec3 c = triangles[triangle].corners[2].xyz;
  vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  float d1 = dot(ab, ap), d2 = dot(ac, ap);
  feature = 4;
  if (d1 <= 0.0 && d2 <= 0.0) return vec3(1.0, 0.0, 0.0);
  float d3 = dot(ab, bp), d4 = dot(ac, bp);
  feature = 5;
  if (d3 >= 0.0 && d4 <= d3) return vec3(0.0, 1.0, 0.0);
  float vc = d1 * d4 - d3 * d2;
  feature = 1;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    float v = d1 / (d1 - d3);
    return vec3(1.0 - v, v, 0.0);
  }
  float d5 = dot(ab, cp), d6 = dot(ac, cp);
  feature = 6;
  if (d6 >= 0.0 && d5 <= d6) return vec3(0.0, 0.0, 1.0);
  float vb = d5 * d2 - d1 * d6;
  feature = 3;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    float w = d2 / (d2 - d6);
    return vec3(1.0 - w, 0.0, w);
  }
  float va = d3 * d6 - d5 * d4;
  feature = 2;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return vec3(0.0, 1.0 - w, w);
  }
  float scale = 1.0 / (va + vb + vc);
  float v = vb * scale, w = vc * scale;
  feature = 0;
  return vec3(1.0 - v - w, v, w);
}

vec3 corner_blend(uint t, vec3 weights) {
  return weights.x * triangles[t].corners[0].xyz + weights.y * triangles[t].corners[1].xyz +
         weights.z * triangles[t].corners[2].xyz;
}

/// Where something solid is nearest.
struct Place {
  vec3 point, outward, motion;
  float far;  // negative inside
};

Place place_on_triangle(uint t, vec3 weights, int feature, vec3 p) {
  Place place;
  place.point = corner_blend(t, weights);
  place.motion = weights.x * triangles[t].motion[0].xyz + weights.y * triangles[t].motion[1].xyz +
                 weights.z * triangles[t].motion[2].xyz;
  vec3 normal = triangles[t].normals[feature].xyz;
  vec3 away = p - place.point;
  float far = length(away);
  place.far = dot(away, normal) < 0.0 ? -far : far;
  if (far > 1e-7) {
    place.outward = away / place.far;
  } else {
    float size = length(normal);
    place.outward = size > 0.0 ? normal / size : normal;
  }
  return place;
}

/// Eigen's unitOrthogonal: where a particle on the axis is put.
vec3 across(vec3 way) {
  if (abs(way.x) > 1e-5 * abs(way.z) || abs(way.y) > 1e-5 * abs(way.z)) {
    return vec3(-way.y, way.x, 0.0) / sqrt(way.x * way.x + way.y * way.y);
  }
  return vec3(0.0, -way.z, way.y) / sqrt(way.y * way.y + way.z * way.z);
}

Place place_on_capsule(SmokeCapsule capsule, vec3 p) {
  vec3 from = capsule.from.xyz, way = capsule.to.xyz - from;
  float square = dot(way, way);
  float at = square > 0.0 ? clamp(dot(way, p - from) / square, 0.0, 1.0) : 0.0;
  vec3 axis = from + at * way;
  vec3 away = p - axis;
  float far = length(away);
  Place place;
  place.outward = far > 1e-7 ? away / far : square > 0.0 ? across(way) : vec3(1.0, 0.0, 0.0);
  place.point = axis + capsule.from.w * place.outward;
  place.motion = (1.0 - at) * capsule.from_motion.xyz + at * capsule.to_motion.xyz;
  place.far = far - capsule.from.w;
  return place;
}

vec3 position, velocity;
bool touched = false, moved = false, inside = false;

void meet(Place place) {
  if (!(place.far < pass.touch)) return;
  float along = dot(velocity - place.motion, place.outward);
  if (!touched) {
    velocity -= pass.friction * (velocity - place.motion - along * place.outward);
  }
  touched = true;
  if (!(place.far < kGapSlack * pass.gap)) return;
  inside = inside || place.far < 0.0;
  moved = true;
  position = place.point + pass.gap * place.outward;
  if (along < 0.0) velocity -= along * place.outward;
}

void meet_side(int axis, float at, float inward) {
  Place place;
  place.point = position;
  place.point[axis] = at;
  place.outward = vec3(0.0);
  place.outward[axis] = inward;
  place.motion = vec3(0.0);
  place.far = inward * (position[axis] - at);
  meet(place);
}

/// Once round all that is near: of each surface, whose triangles follow each other, the nearest.
void meet_all(uint begin, uint end, uint near) {
  for (uint e = begin; e < end;) {
    float surface = triangles[entries[e]].corners[0].w;
    float least = FARTHEST, least_far = 1e18;
    uint best = entries[e];
    vec3 best_weights = vec3(0.0);
    int best_feature = 0;
    for (; e < end && triangles[entries[e]].corners[0].w == surface; ++e) {
      // Farther by its bounding ball than the nearest so far.
      vec3 apart = (triangles[entries[e]].corners[0].xyz + triangles[entries[e]].corners[1].xyz +
                    triangles[entries[e]].corners[2].xyz) / 3.0 - position;
      float reach = least_far + triangles[entries[e]].corners[1].w;
      if (dot(apart, apart) > reach * reach) continue;
      int feature;
      vec3 weights = nearest_on(entries[e], position, feature);
      vec3 away = corner_blend(entries[e], weights) - position;
      float square = dot(away, away);
      if (square < least) {
        least = square;
        least_far = 1.0001 * sqrt(square);
        best = entries[e];
        best_weights = weights;
        best_feature = feature;
      }
    }
    if (least < FARTHEST) meet(place_on_triangle(best, best_weights, best_feature, position));
  }
  for (uint bits = near; bits != 0u; bits &= bits - 1u) {
    for (uint c = uint(findLSB(bits)); c < pass.capsules; c += 32u) {
      meet(place_on_capsule(capsules[c], position));
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    if ((pass.open_sides & kOpenLowX << 2 * axis) == 0u && position[axis] < 0.0) {
      meet_side(axis, 0.0, 1.0);
    } else if ((pass.open_sides & kOpenHighX << 2 * axis) == 0u &&
               position[axis] > pass.extent[axis]) {
      meet_side(axis, pass.extent[axis], -1.0);
    }
  }
}

void main() {
  uint i = thread_index();
  if (i >= pass.particles) return;
  position = positions[i].xyz;
  uint cell = cell_number(position, pass.origin.xyz, pass.inverse_cell, pass.size.xyz);
  uint begin = cell_begin[cell], end = cell_begin[cell + 1u], near = capsules_near[cell];
  if (begin == end && near == 0u) return;
  if (fates[i] != kAirborne) return;
  atomicAdd(counters[kTestedWord], 1u);
  velocity = velocities[i].xyz;
  for (uint r = 0u; r < pass.rounds; ++r) {
    moved = false;
    inside = false;
    meet_all(begin, end, near);
    if (!moved) break;
  }
  if (!touched) return;
  atomicAdd(counters[kTouchingWord], 1u);
  if (inside) {
    atomicAdd(counters[kTrappedWord], 1u);
    fates[i] = kDeposited;
    return;
  }
  positions[i].xyz = position;
  velocities[i].xyz = velocity;
  masses[i] *= pass.kept;
}
