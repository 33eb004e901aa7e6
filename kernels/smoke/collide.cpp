#include "kernels/smoke/collide.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "kernels/base/parallel.h"
#include "kernels/smoke/bin.h"

namespace viscera {
namespace {

constexpr std::size_t kChunk = 64;

/// The nearest point of a triangle, and which of the triangle's pseudo-normals holds there.
struct Nearest {
  Vec3f weights;  // of the corners
  int feature;    // 0 face, 1 to 3 edges 01, 12, 20, 4 to 6 corners
};

// [Ericson2005] 5.1.5.
Nearest nearest_on_triangle(const SurfaceTriangle& triangle, const Vec3f& p) {
  const Vec3f a = triangle.corners[0].xyz(), b = triangle.corners[1].xyz(),
              c = triangle.corners[2].xyz();
  const Vec3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0f && d2 <= 0.0f) return {{1.0f, 0.0f, 0.0f}, 4};
  const Vec3f bp = p - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0f && d4 <= d3) return {{0.0f, 1.0f, 0.0f}, 5};
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f) {
    const float v = d1 / (d1 - d3);
    return {{1.0f - v, v, 0.0f}, 1};
  }
  const Vec3f cp = p - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0f && d5 <= d6) return {{0.0f, 0.0f, 1.0f}, 6};
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f) {
    const float w = d2 / (d2 - d6);
    return {{1.0f - w, 0.0f, w}, 3};
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0.0f && d4 - d3 >= 0.0f && d5 - d6 >= 0.0f) {
    const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {{0.0f, 1.0f - w, w}, 2};
  }
  const float scale = 1.0f / (va + vb + vc);
  const float v = vb * scale, w = vc * scale;
  return {{1.0f - v - w, v, w}, 0};
}

Vec3f blend(const std::array<Float4, 3>& values, const Vec3f& weights) {
  return weights[0] * values[0].xyz() + weights[1] * values[1].xyz() + weights[2] * values[2].xyz();
}

/// Where something solid is nearest.
struct Place {
  Vec3f point, outward, motion;
  float distance;  // negative inside
};

Place place_on(const SurfaceTriangle& triangle, const Nearest& nearest, const Vec3f& p) {
  Place place;
  place.point = blend(triangle.corners, nearest.weights);
  place.motion = blend(triangle.motion, nearest.weights);
  const Vec3f normal = triangle.normals[nearest.feature].xyz();
  const Vec3f away = p - place.point;
  const float distance = away.norm();
  const bool inside = away.dot(normal) < 0.0f;
  place.distance = inside ? -distance : distance;
  // On the surface itself the way out is the normal's.
  place.outward = distance > 1e-7f ? Vec3f(away / place.distance) : Vec3f(normal.normalized());
  return place;
}

Place place_on(const SmokeCapsule& capsule, const Vec3f& p) {
  const Vec3f from = capsule.from.xyz(), way = capsule.to.xyz() - from;
  const float square = way.squaredNorm();
  const float at = square > 0.0f ? std::clamp(way.dot(p - from) / square, 0.0f, 1.0f) : 0.0f;
  const Vec3f axis = from + at * way;
  const Vec3f away = p - axis;
  const float distance = away.norm();
  Place place;
  place.outward = distance > 1e-7f ? Vec3f(away / distance) : Vec3f(way.unitOrthogonal());
  place.point = axis + capsule.from.w * place.outward;
  place.motion = (1.0f - at) * capsule.from_motion.xyz() + at * capsule.to_motion.xyz();
  place.distance = distance - capsule.from.w;
  return place;
}

/// A side of the domain, where something has pushed a particle out.
Place side(const Vec3f& p, int axis, float at, float inward) {
  Place place;
  place.point = p;
  place.point[axis] = at;
  place.outward = inward * Vec3f::Unit(axis);
  place.motion = Vec3f::Zero();
  place.distance = inward * (p[axis] - at);
  return place;
}

/// One particle against what is near its cell.
struct Contact {
  const CollideParameters& parameters;
  Vec3f position, velocity;
  bool touched = false, moved = false, inside = false;

  void meet(const Place& place) {
    if (!(place.distance < parameters.touch)) return;
    const float along = (velocity - place.motion).dot(place.outward);
    if (!touched) {
      const Vec3f tangential = velocity - place.motion - along * place.outward;
      velocity -= parameters.friction * tangential;
    }
    touched = true;
    if (!(place.distance < kGapSlack * parameters.gap)) return;
    inside = inside || place.distance < 0.0f;
    moved = true;
    position = place.point + parameters.gap * place.outward;
    if (along < 0.0f) velocity -= along * place.outward;
  }
};

}  // namespace

CollideCounts collide(std::span<Float4> positions, std::span<Float4> velocities,
                      std::span<float> masses, const SurfaceCells& cells,
                      std::span<const SmokeCapsule> capsules, const CollideParameters& parameters,
                      std::span<SmokeFate> fates) {
  if (cells.empty()) return {};
  BinParameters grid;
  grid.origin = parameters.origin;
  grid.size = parameters.size;
  grid.inverse_cell = parameters.inverse_cell;
  const std::span<const SurfaceTriangle> triangles = cells.triangles();
  const std::span<const Float4> balls = cells.balls();
  const std::span<const std::uint32_t> owners = cells.owners();
  const std::span<const std::uint32_t> entries = cells.entries();

  // The places of one round: the nearest of each surface, whose triangles follow each other.
  const auto round = [&](Contact& contact, std::uint32_t begin, std::uint32_t end,
                         std::uint32_t near_capsules) {
    for (std::uint32_t e = begin; e < end;) {
      const std::uint32_t surface = owners[entries[e]];
      // The mean of its corners belongs to a triangle: none farther than the nearest of those
      // counts.
      std::uint32_t last = e;
      float reach = 1e18f;
      for (; last < end && owners[entries[last]] == surface; ++last) {
        reach = std::min(reach, (balls[entries[last]].xyz() - contact.position).squaredNorm());
      }
      reach = 1.0001f * std::sqrt(reach);
      float least = std::numeric_limits<float>::max();
      std::uint32_t best = entries[e];
      Nearest best_place = {};
      for (; e < last; ++e) {
        const Float4& ball = balls[entries[e]];
        const float within = reach + ball.w;
        if ((ball.xyz() - contact.position).squaredNorm() > within * within) continue;
        const SurfaceTriangle& triangle = triangles[entries[e]];
        const Nearest nearest = nearest_on_triangle(triangle, contact.position);
        const float square =
            (blend(triangle.corners, nearest.weights) - contact.position).squaredNorm();
        if (!(square < least)) continue;
        least = square;
        reach = std::min(reach, 1.0001f * std::sqrt(square));
        best = entries[e];
        best_place = nearest;
      }
      // Without any only where all triangles are degenerate.
      if (least < std::numeric_limits<float>::max()) {
        contact.meet(place_on(triangles[best], best_place, contact.position));
      }
    }
    for (std::uint32_t bits = near_capsules; bits != 0; bits &= bits - 1) {
      for (std::size_t c = std::countr_zero(bits); c < capsules.size(); c += 32) {
        contact.meet(place_on(capsules[c], contact.position));
      }
    }
    const Vec3f extent = parameters.extent.xyz();
    for (int axis = 0; axis < 3; ++axis) {
      const float at = contact.position[axis];
      if (!(parameters.open_sides & kOpenLowX << 2 * axis) && at < 0.0f) {
        contact.meet(side(contact.position, axis, 0.0f, 1.0f));
      } else if (!(parameters.open_sides & kOpenHighX << 2 * axis) && at > extent[axis]) {
        contact.meet(side(contact.position, axis, extent[axis], -1.0f));
      }
    }
  };

  const std::size_t chunks = (positions.size() + kChunk - 1) / kChunk;
  std::vector<CollideCounts> counts(chunks);
  parallel_chunks(positions.size(), kChunk, [&](std::size_t first, std::size_t last) {
    CollideCounts& count = counts[first / kChunk];
    for (std::size_t i = first; i < last; ++i) {
      const std::uint32_t cell = cell_number(grid, cell_of(grid, positions[i]));
      const std::uint32_t begin = cells.cell_begin()[cell], end = cells.cell_begin()[cell + 1];
      const std::uint32_t near_capsules = cells.capsules_near()[cell];
      if (begin == end && near_capsules == 0) continue;
      if (fates[i] != SmokeFate::kAirborne) continue;
      ++count.tested;
      Contact contact{parameters, positions[i].xyz(), velocities[i].xyz()};
      for (std::uint32_t r = 0; r < parameters.rounds; ++r) {
        contact.moved = contact.inside = false;
        round(contact, begin, end, near_capsules);
        if (!contact.moved) break;
      }
      if (!contact.touched) continue;
      ++count.touching;
      const float mass = masses[i];
      if (contact.inside) {
        ++count.trapped;
        fates[i] = SmokeFate::kDeposited;
        continue;
      }
      positions[i].set_xyz(contact.position);
      velocities[i].set_xyz(contact.velocity);
      masses[i] = mass * parameters.kept;
      count.deposited += static_cast<double>(mass) - static_cast<double>(masses[i]);
    }
  });
  CollideCounts all;
  for (const CollideCounts& count : counts) {
    all.tested += count.tested;
    all.touching += count.touching;
    all.trapped += count.trapped;
    all.deposited += count.deposited;
  }
  return all;
}

}  // namespace viscera
