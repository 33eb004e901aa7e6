#include "engine/organ/mesh_editor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

const double kCrease = std::cos(50.0 * std::numbers::pi / 180.0);

// A triangle may turn by up to this much when a vertex moves.
const double kGreatestTurn = std::cos(60.0 * std::numbers::pi / 180.0);

// A triangle whose height is less than this share of its longest edge is a needle: which way it
// faces is chance, and mustn't hinder its removal.
constexpr double kNeedle = 0.05;

// The angle at b of the triangle a b c.
double angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = a - b, v = c - b;
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

}  // namespace

double least_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  return std::min({angle(a, b, c), angle(b, c, a), angle(c, a, b)});
}

MeshEditor::MeshEditor(const TriangleSurface& surface, Projection projection, bool creases)
    : projection_(std::move(projection)),
      at_(surface.vertices),
      triangles_(surface.triangles),
      around_(surface.vertices.size()),
      locked_(surface.vertices.size(), 0),
      triangle_count_(static_cast<int>(surface.triangles.size())) {
  for (int t = 0; t < triangle_count_; ++t) {
    for (const int v : triangles_[t]) around_[v].push_back(t);
  }
  if (!creases) return;
  for (const Edge& edge : edges()) {
    int left, right;
    wings(edge, left, right);
    if (turns(left, right)) locked_[edge.first] = locked_[edge.second] = 1;
  }
}

std::vector<MeshEditor::Edge> MeshEditor::edges() const {
  std::vector<Edge> found;
  found.reserve(3 * triangle_count_ / 2);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    if (!alive(static_cast<int>(t))) continue;
    for (int i = 0; i < 3; ++i) {
      const int a = triangles_[t][i], b = triangles_[t][(i + 1) % 3];
      if (a < b) found.emplace_back(a, b);  // its other triangle runs from b to a
    }
  }
  return found;
}

// The corners opposite the edge: of the triangle that runs from first to second (`left`), and of
// the other; -1 where the edge is no more.
std::pair<int, int> MeshEditor::wings(const Edge& edge, int& left, int& right) const {
  const auto [a, b] = edge;
  left = right = -1;
  std::pair<int, int> found(-1, -1);
  for (const int t : around_[a]) {
    for (int i = 0; i < 3; ++i) {
      if (triangles_[t][i] != a) continue;
      if (triangles_[t][(i + 1) % 3] == b) left = t, found.first = triangles_[t][(i + 2) % 3];
      if (triangles_[t][(i + 2) % 3] == b) right = t, found.second = triangles_[t][(i + 1) % 3];
    }
  }
  return found;
}

std::vector<int> MeshEditor::neighbours(int vertex) const {
  std::vector<int> found;
  for (const int t : around_[vertex]) {
    for (int i = 0; i < 3; ++i) {
      if (triangles_[t][i] == vertex) found.push_back(triangles_[t][(i + 1) % 3]);
    }
  }
  return found;
}

bool MeshEditor::adjacent(int a, int b) const {
  return std::any_of(around_[a].begin(), around_[a].end(), [&](int t) {
    return triangles_[t][0] == b || triangles_[t][1] == b || triangles_[t][2] == b;
  });
}

Vec3 MeshEditor::normal(const Triangle& t) const {
  return (at_[t[1]] - at_[t[0]]).cross(at_[t[2]] - at_[t[0]]);
}

bool MeshEditor::is_crease(const Edge& edge) const {
  if (!locked_[edge.first] || !locked_[edge.second]) return false;
  int left, right;
  const auto [c, d] = wings(edge, left, right);
  return c >= 0 && d >= 0 && turns(left, right);
}

bool MeshEditor::turns(int left, int right) const {
  const Vec3 one = normal(triangles_[left]), other = normal(triangles_[right]);
  return one.dot(other) < kCrease * one.norm() * other.norm();
}

// Whether a triangle around `vertex` would turn over if the vertex moved; those that hold the
// vertex `without` aren't asked (they go away).
bool MeshEditor::folds(int vertex, const Vec3& to, int without) const {
  for (const int t : around_[vertex]) {
    const Triangle& corners = triangles_[t];
    if (std::find(corners.begin(), corners.end(), without) != corners.end()) continue;
    const Vec3 before = normal(corners);
    const double longest2 = std::max({(at_[corners[0]] - at_[corners[1]]).squaredNorm(),
                                      (at_[corners[1]] - at_[corners[2]]).squaredNorm(),
                                      (at_[corners[2]] - at_[corners[0]]).squaredNorm()});
    if (before.norm() < kNeedle * longest2) continue;
    std::array<Vec3, 3> moved;
    for (int i = 0; i < 3; ++i) moved[i] = corners[i] == vertex ? to : at_[corners[i]];
    const Vec3 after = (moved[1] - moved[0]).cross(moved[2] - moved[0]);
    if (!(before.dot(after) > kGreatestTurn * before.norm() * after.norm())) return true;
  }
  return false;
}

void MeshEditor::replace(int triangle, const Triangle& corners) {
  for (const int v : triangles_[triangle]) std::erase(around_[v], triangle);
  triangles_[triangle] = corners;
  for (const int v : corners) around_[v].push_back(triangle);
}

void MeshEditor::remove(int triangle) {
  for (const int v : triangles_[triangle]) std::erase(around_[v], triangle);
  triangles_[triangle][0] = -1;
  --triangle_count_;
}

bool MeshEditor::split(const Edge& edge) {
  if (is_crease(edge)) return false;
  const auto [a, b] = edge;
  int left, right;
  const auto [c, d] = wings(edge, left, right);
  if (c < 0 || d < 0) return false;
  const Vec3 middle = 0.5 * (at_[a] + at_[b]);
  Vec3 place = projection_(middle);
  // Across a thin rim the nearest surface may be the wrong side of it.
  if ((place - middle).norm() > 0.3 * length(edge)) place = middle;
  const int m = static_cast<int>(at_.size());
  at_.push_back(place);
  locked_.push_back(0);
  around_.emplace_back();
  replace(left, {a, m, c});
  replace(right, {a, d, m});
  for (const Triangle& corners : {Triangle{m, b, c}, Triangle{m, d, b}}) {
    const int t = static_cast<int>(triangles_.size());
    triangles_.push_back(corners);
    for (const int v : corners) around_[v].push_back(t);
    ++triangle_count_;
  }
  return true;
}

bool MeshEditor::collapse(const Edge& edge, double longest, double least) {
  auto [kept, gone] = edge;
  if (locked_[gone]) std::swap(kept, gone);
  if (locked_[gone]) return false;
  int left, right;
  const auto [c, d] = wings({kept, gone}, left, right);
  if (c < 0 || d < 0 || around_[c].size() <= 3 || around_[d].size() <= 3) return false;

  // The link condition: the two ends share no neighbours but the two wings.
  std::vector<int> ring = neighbours(kept), other = neighbours(gone);
  std::sort(ring.begin(), ring.end());
  const auto shared = std::count_if(other.begin(), other.end(), [&](int v) {
    return std::binary_search(ring.begin(), ring.end(), v);
  });
  if (shared != 2) return false;

  // The middle of a short edge is near enough to the surface until the next relaxation.
  Vec3 to = locked_[kept] ? at_[kept] : Vec3(0.5 * (at_[kept] + at_[gone]));
  if (!locked_[kept] && !(length({kept, gone}) < 0.4 * longest && std::isfinite(longest))) {
    to = projection_(to);
  }
  const double limit2 = longest * longest;
  for (const auto* vertices : {&ring, &other}) {
    for (const int v : *vertices) {
      if (v != kept && v != gone && (at_[v] - to).squaredNorm() > limit2) return false;
    }
  }
  if (folds(gone, to, kept) || folds(kept, to, gone)) return false;
  for (const int vertex : {kept, gone}) {
    const int without = vertex == kept ? gone : kept;
    for (const int t : around_[vertex]) {
      const Triangle& corners = triangles_[t];
      if (std::find(corners.begin(), corners.end(), without) != corners.end()) continue;
      std::array<Vec3, 3> x;
      for (int i = 0; i < 3; ++i) x[i] = corners[i] == vertex ? to : at_[corners[i]];
      const double after = least_angle(x[0], x[1], x[2]);
      if (after >= least) continue;
      if (after < least_angle(at_[corners[0]], at_[corners[1]], at_[corners[2]])) return false;
    }
  }

  remove(left);
  remove(right);
  const std::vector<int> inherited = around_[gone];
  for (const int t : inherited) {
    Triangle corners = triangles_[t];
    std::replace(corners.begin(), corners.end(), gone, kept);
    replace(t, corners);
  }
  at_[kept] = to;
  return true;
}

bool MeshEditor::flip(const Edge& edge, Goal goal) {
  if (is_crease(edge)) return false;
  const auto [a, b] = edge;
  int left, right;
  const auto [c, d] = wings(edge, left, right);
  if (c < 0 || d < 0 || c == d || adjacent(c, d)) return false;
  const double before =
      std::min(least_angle(at_[a], at_[b], at_[c]), least_angle(at_[b], at_[a], at_[d]));
  const double after =
      std::min(least_angle(at_[a], at_[d], at_[c]), least_angle(at_[d], at_[b], at_[c]));
  if (goal == Goal::kValence) {
    const auto excess = [this](int v, int change) {
      const int off = static_cast<int>(around_[v].size()) + change - 6;
      return off * off;
    };
    const int now = excess(a, 0) + excess(b, 0) + excess(c, 0) + excess(d, 0);
    const int then = excess(a, -1) + excess(b, -1) + excess(c, 1) + excess(d, 1);
    if (then >= now || after < 0.5 * before) return false;
  } else if (after <= before + 1e-9) {
    return false;
  }
  if (around_[a].size() <= 3 || around_[b].size() <= 3) return false;

  // The two new triangles must lie along the two old ones: on a ridge a flip would cut it off.
  const Vec3 old_left = normal(triangles_[left]).normalized();
  const Vec3 old_right = normal(triangles_[right]).normalized();
  const Triangle new_left{a, d, c}, new_right{d, b, c};
  const Vec3 one = normal(new_left).normalized(), two = normal(new_right).normalized();
  const double bend = old_left.dot(old_right);
  if (!(one.dot(two) > std::min(bend, 0.95) - 0.05)) return false;
  const Vec3 mean = old_left + old_right;
  if (!(one.dot(mean) > 0.0) || !(two.dot(mean) > 0.0)) return false;
  replace(left, new_left);
  replace(right, new_right);
  return true;
}

int MeshEditor::flip_edges(Goal goal) {
  int flips = 0;
  for (const Edge& edge : edges()) flips += flip(edge, goal);
  return flips;
}

void MeshEditor::relax() {
  // New places from the old ones, in parallel (the field is what costs time); then made one by one
  // against the places as they are by then, so that neighbours can't fold a triangle together.
  std::vector<Vec3> places = at_;
  parallel_for_each_index(at_.size(), 64, [&](std::size_t i) {
    if (locked_[i] || around_[i].empty()) return;
    Vec3 sum = Vec3::Zero(), normal_sum = Vec3::Zero();
    double weights = 0.0;
    for (const int t : around_[i]) {
      const Triangle& corners = triangles_[t];
      const Vec3 area = normal(corners);
      const double weight = area.norm();
      sum += weight / 3.0 * (at_[corners[0]] + at_[corners[1]] + at_[corners[2]]);
      weights += weight;
      normal_sum += area;
    }
    if (!(weights > 0.0)) return;
    const Vec3 out = normal_sum.normalized();
    Vec3 step = sum / weights - at_[i];
    step -= out * out.dot(step);
    places[i] = projection_(at_[i] + step);
  });
  for (std::size_t i = 0; i < at_.size(); ++i) {
    const int vertex = static_cast<int>(i);
    if (!around_[i].empty() && !folds(vertex, places[i], -1)) at_[i] = places[i];
  }
}

void MeshEditor::project_all() {
  std::vector<Vec3> places = at_;
  parallel_for_each_index(at_.size(), 64, [&](std::size_t i) {
    if (!locked_[i] && !around_[i].empty()) places[i] = projection_(at_[i]);
  });
  at_ = std::move(places);
}

TriangleSurface MeshEditor::surface() const {
  TriangleSurface all{at_, {}};
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    if (alive(static_cast<int>(t))) all.triangles.push_back(triangles_[t]);
  return with_used_vertices(all);
}

}  // namespace viscera
