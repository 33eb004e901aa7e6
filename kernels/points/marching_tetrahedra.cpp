#include "kernels/points/marching_tetrahedra.h"

#include <algorithm>

namespace viscera {
namespace {

/// Freudenthal's. Each is positively oriented.
constexpr std::array<std::array<std::size_t, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

constexpr double kFromEnds = 0.05;  // of an edge

/// By 20 bits a component, and three for the axes along which it goes.
std::uint64_t key_of(const MarchingTetrahedra::Index& from, const MarchingTetrahedra::Index& to) {
  constexpr std::uint64_t mask = (std::uint64_t{1} << 20) - 1;
  const auto bits = [](int value) { return static_cast<std::uint64_t>(value) & mask; };
  const MarchingTetrahedra::Index way = to - from;
  return bits(from.x()) | bits(from.y()) << 20 | bits(from.z()) << 40 | bits(way.x()) << 60 |
         bits(way.y()) << 61 | bits(way.z()) << 62;
}

}  // namespace

void MarchingTetrahedra::visit(const Index& first, const std::array<double, 8>& values) {
  std::array<Corner, 8> corners;
  int inside = 0;
  for (std::size_t c = 0; c < 8; ++c) {
    corners[c] = {corner(first, static_cast<int>(c)), values[c]};
    inside += values[c] < 0.0;
  }
  if (inside == 0 || inside == 8) return;
  for (const auto& [a, b, c, d] : kTetrahedra)
    tetrahedron({&corners[a], &corners[b], &corners[c], &corners[d]});
}

void MarchingTetrahedra::tetrahedron(std::array<const Corner*, 4> c) {
  // Bring the inside corners to the front by even permutations, which keep the orientation.
  const auto in = [&c](std::size_t i) { return c[i]->value < 0.0; };
  const int inside = in(0) + in(1) + in(2) + in(3);
  if (inside == 0 || inside == 4) return;
  const auto rotate = [&c](std::size_t i, std::size_t j, std::size_t k) {
    const Corner* first = c[i];
    c[i] = c[j];
    c[j] = c[k];
    c[k] = first;
  };
  if (inside == 1) {
    if (in(1))
      rotate(0, 1, 2);
    else if (in(2))
      rotate(0, 2, 1);
    else if (in(3))
      rotate(0, 3, 1);
    triangle(cut(c[0], c[1]), cut(c[0], c[2]), cut(c[0], c[3]));
  } else if (inside == 3) {
    if (!in(1))
      rotate(0, 1, 2);
    else if (!in(2))
      rotate(0, 2, 1);
    else if (!in(3))
      rotate(0, 3, 1);
    triangle(cut(c[0], c[1]), cut(c[0], c[3]), cut(c[0], c[2]));
  } else {
    if (in(0)) {
      if (in(2))
        rotate(1, 2, 3);
      else if (in(3))
        rotate(1, 3, 2);
    } else if (in(1)) {
      if (in(2))
        rotate(0, 1, 2);
      else
        rotate(0, 1, 3);
    } else {
      rotate(0, 2, 1);
      rotate(1, 3, 2);
    }
    const int p = cut(c[0], c[2]), q = cut(c[0], c[3]), r = cut(c[1], c[3]), s = cut(c[1], c[2]);
    triangle(p, q, r);
    triangle(p, r, s);
  }
}

int MarchingTetrahedra::cut(const Corner* a, const Corner* b) {
  if ((b->at - a->at).minCoeff() < 0) std::swap(a, b);
  const auto [entry, fresh] =
      cuts_.try_emplace(key_of(a->at, b->at), static_cast<int>(surface_.vertices.size()));
  if (fresh) {
    const double share = std::clamp(a->value / (a->value - b->value), kFromEnds, 1.0 - kFromEnds);
    surface_.vertices.push_back((1.0 - share) * place_(a->at) + share * place_(b->at));
  }
  return entry->second;
}

}  // namespace viscera
