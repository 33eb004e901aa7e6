#include "engine/features/touching/edge_samples.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "engine/features/touching/chosen_places.h"

namespace viscera {
namespace {

/// An edge of the surface is tried at places so many times nearer than samples lie, at most so
/// many.
constexpr double kTriedPerPitch = 4.0;
constexpr int kMostTried = 400;

/// On a triangle, a share of the way between two of its corners.
SurfacePoint point_between(const TriangleSurface& surface, int triangle,
                           const std::array<int, 2>& vertices, double share) {
  SurfacePoint point{triangle, Vec3::Zero()};
  const auto& corners = surface.triangles[static_cast<std::size_t>(triangle)];
  for (std::size_t c = 0; c < 3; ++c) {
    if (corners[c] == vertices[0]) point.weights[static_cast<Eigen::Index>(c)] = 1.0 - share;
    if (corners[c] == vertices[1]) point.weights[static_cast<Eigen::Index>(c)] = share;
  }
  return point;
}

/// Where edges meet in a vertex otherwise than as one that goes on.
bool is_corner(const TriangleSurface& surface, const std::vector<const SharpEdge*>& meeting,
               int vertex) {
  if (meeting.size() != 2) return true;
  const auto away = [&](const SharpEdge& edge) {
    const int far = edge.vertices[0] == vertex ? edge.vertices[1] : edge.vertices[0];
    return Vec3((surface.vertices[static_cast<std::size_t>(far)] -
                 surface.vertices[static_cast<std::size_t>(vertex)])
                    .stableNormalized());
  };
  return away(*meeting[0]).dot(away(*meeting[1])) > -kSameFace;
}

/// Up to three that face different ways.
EdgeSamples::Faces faces_at(const TriangleSurface& surface,
                            const std::vector<const SharpEdge*>& meeting) {
  std::vector<int> found;
  for (const SharpEdge* edge : meeting)
    for (const int face : edge->faces) {
      const Vec3 normal = face_normal(surface, face);
      if (found.size() < 3 && std::ranges::none_of(found, [&](int other) {
            return face_normal(surface, other).dot(normal) > kSameFace;
          }))
        found.push_back(face);
    }
  while (found.size() < 3) found.push_back(found.back());
  return {found[0], found[1], found[2]};
}

/// How many faces they are.
std::size_t count(const EdgeSamples::Faces& faces) {
  return faces[2] == faces[1] ? 2 : 3;
}

SurfacePatch place_at(const TriangleSurface& surface, const SurfacePoint& point,
                      const EdgeSamples::Faces& faces, double pitch) {
  Vec3 normal = Vec3::Zero();
  for (std::size_t f = 0; f < count(faces); ++f) normal += face_normal(surface, faces[f]);
  return {point, position(surface, point), normal.stableNormalized(), pitch * pitch, 0.0};
}

}  // namespace

std::vector<SharpEdge> sharp_edges(const TriangleSurface& surface) {
  std::map<std::pair<int, int>, int> beside;  // an edge as its triangle goes along it
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c)
      beside.emplace(std::pair(surface.triangles[t][c], surface.triangles[t][(c + 1) % 3]),
                     static_cast<int>(t));
  std::vector<SharpEdge> edges;
  for (const auto& [way, one] : beside) {
    const auto back = beside.find({way.second, way.first});
    if (way.first > way.second || back == beside.end()) continue;
    const int other = back->second;
    const Vec3 own = face_normal(surface, one), next = face_normal(surface, other);
    if (own.dot(next) > kSameFace) continue;
    const Vec3 from = surface.vertices[static_cast<std::size_t>(way.first)];
    const Vec3 along = surface.vertices[static_cast<std::size_t>(way.second)] - from;
    // Triangles go counter-clockwise: seen along its own way, one's inside is to the left.
    if (!(own.cross(next).dot(along) > 0.0)) continue;
    edges.push_back({{way.first, way.second}, {one, other}, (own + next).stableNormalized()});
  }
  return edges;
}

EdgeSamples edge_samples(const TriangleSurface& surface, const std::vector<SharpEdge>& edges,
                         double pitch) {
  std::map<int, std::vector<const SharpEdge*>> at;  // by vertex
  for (const SharpEdge& edge : edges)
    for (const int vertex : edge.vertices) at[vertex].push_back(&edge);
  EdgeSamples samples;
  ChosenPlaces chosen(pitch);
  const auto add = [&](const SurfacePoint& point, const EdgeSamples::Faces& faces) {
    samples.places.push_back(place_at(surface, point, faces, pitch));
    samples.faces.push_back(faces);
    return static_cast<int>(samples.places.size()) - 1;
  };
  for (const auto& [vertex, meeting] : at) {
    if (!is_corner(surface, meeting, vertex)) continue;
    const SharpEdge& first = *meeting.front();
    const Vec3& place = surface.vertices[static_cast<std::size_t>(vertex)];
    if (chosen.nearest(place, first.normal, 0.5 * pitch) >= 0) continue;
    const int index = add(point_between(surface, first.faces[0], first.vertices,
                                        first.vertices[0] == vertex ? 0.0 : 1.0),
                          faces_at(surface, meeting));
    for (const SharpEdge* edge : meeting) chosen.add(place, edge->normal, index);
  }
  for (const SharpEdge& edge : edges) {
    const auto end = [&](std::size_t e) {
      return surface.vertices[static_cast<std::size_t>(edge.vertices[e])];
    };
    const int parts =
        std::clamp(static_cast<int>(std::ceil(kTriedPerPitch * (end(1) - end(0)).norm() / pitch)),
                   1, kMostTried);
    for (int i = 0; i <= parts; ++i) {
      const double share = static_cast<double>(i) / parts;
      const Vec3 place = (1.0 - share) * end(0) + share * end(1);
      if (chosen.nearest(place, edge.normal, pitch) >= 0) continue;
      const int index = add(point_between(surface, edge.faces[0], edge.vertices, share),
                            {edge.faces[0], edge.faces[1], edge.faces[1]});
      chosen.add(place, edge.normal, index);
    }
  }
  return samples;
}

bool edge_faces(const DrawnOrgan& organ, const EdgeSamples::Faces& faces, const Vec3& normal,
                double cosine) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t f = 0; f < count(faces); ++f) {
    const Vec3 own = organ.normal(faces[f]);
    if (own.dot(normal) < cosine) return true;
    sum += own;
  }
  return sum.stableNormalized().dot(normal) < cosine;
}

}  // namespace viscera
