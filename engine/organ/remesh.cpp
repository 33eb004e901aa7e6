// Isotropic remeshing [Botsch2004].
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "engine/organ/mesh_editor.h"

namespace viscera {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

using Edge = MeshEditor::Edge;

std::vector<Edge> by_length(const MeshEditor& mesh, bool shortest_first, double least,
                            double greatest) {
  std::vector<std::pair<double, Edge>> measured;
  for (const Edge& edge : mesh.edges()) {
    const double length = mesh.length(edge);
    if (length > least && length < greatest) measured.emplace_back(length, edge);
  }
  std::sort(measured.begin(), measured.end(), [shortest_first](const auto& a, const auto& b) {
    if (a.first != b.first) return shortest_first ? a.first < b.first : a.first > b.first;
    return a.second < b.second;
  });
  std::vector<Edge> edges;
  for (const auto& [length, edge] : measured) edges.push_back(edge);
  return edges;
}

}  // namespace

void settle(MeshEditor& mesh, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    mesh.relax();
    for (int pass = 0; pass < 4 && mesh.flip_edges(MeshEditor::Goal::kDelaunay) > 0; ++pass) {
    }
  }
}

void remesh(MeshEditor& mesh, double edge, int rounds) {
  // 4/5 and 4/3 of the wanted length are the thresholds that neither undo each other.
  const double longest = 4.0 / 3.0 * edge, shortest = 4.0 / 5.0 * edge;
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds; ++round) {
    for (const Edge& e : by_length(mesh, false, longest, kNoLimit)) mesh.split(e);
    // A collapse moves its neighbourhood: the length is asked again, and lists made once more.
    for (int pass = 0; pass < 6; ++pass) {
      int collapses = 0;
      for (const Edge& e : by_length(mesh, true, -1.0, shortest)) {
        if (mesh.length(e) < shortest) collapses += mesh.collapse(e, longest, 10.0 * kDegree);
      }
      if (collapses * 200 < mesh.triangle_count()) break;
    }
    mesh.flip_edges(MeshEditor::Goal::kValence);
    mesh.relax();
  }
  settle(mesh, 3);
  // What is left of folds in the first triangulation, at rims that are sharper than an edge is
  // long.
  for (int pass = 0; pass < 3; ++pass) {
    int collapses = 0;
    for (const Edge& e : by_length(mesh, true, -1.0, 0.4 * edge)) {
      if (mesh.length(e) < 0.4 * edge) collapses += mesh.collapse(e, kNoLimit, 0.0);
    }
    settle(mesh, 1);
    if (collapses == 0) break;
  }
}

bool reach_triangle_count(MeshEditor& mesh, int triangles) {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  // A part of the way at a time, so that the surplus is taken evenly from the whole surface.
  int stuck = 0;
  while (mesh.triangle_count() != triangles) {
    const int surplus = (mesh.triangle_count() - triangles) / 2;
    const int wanted = std::max(1, std::abs(surplus) / 3);
    const int before = mesh.triangle_count();
    int made = 0;
    for (const Edge& e : by_length(mesh, surplus > 0, -1.0, kNoLimit)) {
      if (made == wanted) break;
      // Once every careful collapse is refused, any that keeps the surface sound will do.
      const double least = stuck > 0 ? 1.0 * kDegree : 25.0 * kDegree;
      made += surplus > 0 ? mesh.collapse(e, kNoLimit, least) : mesh.split(e);
    }
    settle(mesh, 2);
    stuck = mesh.triangle_count() == before ? stuck + 1 : 0;
    if (stuck > 2) return false;
  }
  settle(mesh, 6);
  return true;
}

}  // namespace viscera
