#include "kernels/paff/true_neighbours.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/base/disjoint_sets.h"
#include "kernels/base/parallel.h"
#include "kernels/paff/local_spacing.h"
#include "kernels/paff/shape_functions.h"
#include "kernels/points/closed_pieces.h"

namespace viscera {
namespace {

/// A node none of whose ways is longer than this against the straight one sees all: chosen by eye,
/// above the 1.16 of a crease of 120 degrees.
constexpr double kLongerWay = 1.2;
/// Nor one that loses no more than this of its weight, which is 1 at the node, where there is a
/// way.
constexpr double kLeastLost = 0.05;
/// Walls are looked for a little farther than fields reach, so that none that they touch is missed.
constexpr double kBeyond = 1.05;
/// Ways up to the first count as straight, which takes up that bends lie a little below the
/// surface; from the second on they count as they are.
constexpr double kStraightUpTo = 1.03, kAsItIsFrom = 1.10;
/// CUTTING's bounds: what is deep in shadow, and the least share of a node's integral for a twin.
constexpr double kDeep = 0.5, kLeastTwin = 1e-2;
/// A node farther than the first outside the tissue lies in air, not on the surface; its ways begin
/// the second below the wall; in spacings.
constexpr double kInAir = 1e-7, kBelowWall = 1e-3;
/// Places of a deep shadow that see each other across this many spacings are of one part.
constexpr double kOnePart = 0.8;

/// The way that weighs: `straight`, `way` and between the two bounds a smooth passage.
double weighing_way(double straight, double way, double& slope_straight, double& slope_way) {
  slope_straight = 0.0;
  slope_way = 1.0;
  if (way >= kAsItIsFrom * straight) return way;
  const double t = (way / straight - kStraightUpTo) / (kAsItIsFrom - kStraightUpTo);
  if (t <= 0.0) {
    slope_straight = 1.0;
    slope_way = 0.0;
    return straight;
  }
  const double passed = t * t * (3.0 - 2.0 * t);
  const double rate = 6.0 * t * (1.0 - t) / (kAsItIsFrom - kStraightUpTo);
  slope_way = passed + (way - straight) * rate / straight;
  slope_straight = 1.0 - passed - (way - straight) * rate * way / (straight * straight);
  return straight + passed * (way - straight);
}

}  // namespace

std::shared_ptr<const TrueNeighbours> TrueNeighbours::find(const TriangleSurface& surface,
                                                           const PointCloud& cloud,
                                                           double support_factor) {
  std::shared_ptr<TrueNeighbours> found(new TrueNeighbours(surface, cloud, support_factor));
  if (found->paths_.in_pieces())
    for (const TriangleSurface& piece : closed_pieces(surface))
      found->walls_of_pieces_.emplace_back(with_used_vertices(piece));
  return found->find_blocked() ? found : nullptr;
}

bool TrueNeighbours::reaches_other_piece(std::size_t node, const Vec3& from) const {
  if (!paths_.in_pieces()) return false;
  const auto own = static_cast<std::size_t>(paths_.piece_at(from));
  for (std::size_t p = 0; p < walls_of_pieces_.size(); ++p)
    if (p != own &&
        walls_of_pieces_[p].closest(cloud_.positions[node]).distance < kBeyond * radius(node))
      return true;
  return false;
}

void TrueNeighbours::View::take(const TrueNeighbours& body, const Vec3& place) {
  constexpr std::uint32_t kLooks = std::uint32_t{1} << 31;
  if (++look_ == kLooks) {
    bends_.clear();
    points_.clear();
    look_ = 1;
  }
  paths_ = &body.paths_;
  place_ = place;
  piece_ = body.paths_.piece_at(place);
}

bool TrueNeighbours::View::found(Answers& known, int number, const Vec3& position,
                                 bool from_there) {
  const auto i = static_cast<std::size_t>(number);
  if (i >= known.size()) known.resize(std::max(i + 1, 2 * known.size()), 0);
  if (known[i] >> 1 != look_) {
    const bool seen =
        from_there ? paths_->straight(position, place_) : paths_->straight(place_, position);
    known[i] = look_ << 1 | static_cast<std::uint32_t>(seen);
  }
  return (known[i] & 1) != 0;
}

Vec3 TrueNeighbours::beginning(std::size_t node) const {
  const Vec3& place = cloud_.positions[node];
  const double h = cloud_.spacings[node];
  if (!(paths_.tree().signed_distance(place) > kInAir * h)) return place;
  const SurfaceTree::Closest wall = paths_.tree().closest(place);
  return wall.position + kBelowWall * h / wall.distance * (wall.position - place);
}

bool TrueNeighbours::find_blocked() {
  const std::size_t n = cloud_.size();
  std::vector<Vec3> from = cloud_.positions;
  std::vector<char> reaches_others(n, 0), has_walls(n, 0);
  parallel_for_each_index(n, 32, [&](std::size_t i) {
    const auto are_walls = [&] {
      return paths_.any_wall_beyond_air(from[i], kBeyond * radius(i),
                                        [](const Vec3&) { return true; });
    };
    bool some = are_walls();
    if (!some && !paths_.in_pieces()) return;
    from[i] = beginning(i);
    if (from[i] != cloud_.positions[i]) some = are_walls();
    reaches_others[i] = reaches_other_piece(i, from[i]);
    has_walls[i] = some || reaches_others[i];
  });
  std::vector<std::size_t> nodes;  // that have some
  std::vector<Vec3> beginnings;    // theirs
  for (std::size_t i = 0; i < n; ++i) {
    if (!has_walls[i]) continue;
    nodes.push_back(i);
    beginnings.push_back(from[i]);
  }
  if (nodes.empty()) return false;

  const LocalSpacing spacing(cloud_);
  std::vector<Blocked> blocked = ways_around(nodes, beginnings, spacing);
  // Ways that are longer than the support are none; so few can be told from those that are only a
  // little longer than the straight one.
  std::vector<char> keeps(nodes.size(), 0), severed(nodes.size(), 0);
  parallel_for_each_index(nodes.size(), 4, [&](std::size_t k) {
    const Vec3& place = cloud_.positions[nodes[k]];
    thread_local View view;
    const auto loses_it = [&](const Vec3& to) {
      view.take(*this, to);
      if (view.piece() != blocked[k].piece) {
        severed[k] = 1;
        return true;
      }
      const double r = radius(nodes[k]), straight = (to - place).norm();
      Shadow shadow;
      if (!way_through(blocked[k], place, kLongerWay * r, view, shadow)) return false;
      severed[k] = severed[k] || shadow.way >= kLongerWay * r;
      return severed[k] ||
             (shadow.way > kLongerWay * straight &&
              quartic_weight(straight / r) - quartic_weight(shadow.way / r) > kLeastLost);
    };
    severed[k] = reaches_others[nodes[k]];
    keeps[k] = severed[k] ||
               paths_.any_wall_beyond_air(beginnings[k], kBeyond * radius(nodes[k]), loses_it);
    std::erase_if(blocked[k].bends,
                  [&](const auto& bend) { return bend.length >= radius(nodes[k]); });
  });
  if (std::none_of(keeps.begin(), keeps.end(), [](char one) { return one; })) return false;

  // What lies in shadow of those, by the points of the volume.
  const Result<VolumeQuadrature> volume =
      background_quadrature(paths_.surface(), spacing, 1, &paths_);
  if (!volume) return false;  // no closed surface: preparing the body says so
  find_shadows(nodes, keeps, *volume, blocked);

  // Slight shadows alone change less than the nodes' own disorder: the body is taken as it is.
  const auto has_twin = [](const Blocked& one) {
    return std::any_of(one.twins.begin(), one.twins.end(), [](int twin) { return twin >= 0; });
  };
  if (std::none_of(severed.begin(), severed.end(), [](char one) { return one; }) &&
      std::none_of(blocked.begin(), blocked.end(), has_twin))
    return false;

  blocked_of_.assign(n, -1);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (!keeps[k]) continue;
    Blocked& one = blocked[k];
    blocked_of_[nodes[k]] = static_cast<int>(blocked_.size());
    // find_parts numbered the twins from 0.
    const int count =
        one.twins.empty() ? 0 : 1 + *std::max_element(one.twins.begin(), one.twins.end());
    for (int& twin : one.twins)
      if (twin >= 0) twin += static_cast<int>(cloud_.size());
    for (int t = 0; t < count; ++t) {
      places_.push_back(nearest_place(one, static_cast<int>(cloud_.size()), nodes[k]));
      parents_.push_back(static_cast<int>(nodes[k]));
      cloud_.positions.push_back(Vec3(cloud_.positions[nodes[k]]));
      cloud_.spacings.push_back(double(cloud_.spacings[nodes[k]]));
    }
    blocked_.push_back(std::move(one));
  }
  return !blocked_.empty();
}

/// Of those in deep shadow that the twin carries: the one where most of the node's field is.
Vec3 TrueNeighbours::nearest_place(const Blocked& blocked, int twin, std::size_t node) const {
  const Vec3& from = cloud_.positions[node];
  const Vec3* nearest = nullptr;
  for (std::size_t p = 0; p < blocked.places.size(); ++p)
    if (blocked.twins[p] == twin &&
        (!nearest || (blocked.places[p] - from).norm() < (*nearest - from).norm()))
      nearest = &blocked.places[p];
  return *nearest;
}

/// Shortest ways from each of these nodes to the bends about it, up to kLongerWay of its support.
std::vector<TrueNeighbours::Blocked> TrueNeighbours::ways_around(
    const std::vector<std::size_t>& nodes, const std::vector<Vec3>& beginnings,
    const LocalSpacing& spacing) const {
  std::vector<double> about;
  for (const std::size_t i : nodes) about.push_back(kLongerWay * radius(i));
  const InfluenceGrid near_nodes(beginnings, about);
  const auto wanted = [&](const Vec3& x) {
    thread_local std::vector<int> found;
    near_nodes.reaching(x, found);
    return !found.empty();
  };
  const TissueBends bends(paths_, wanted, [&](const Vec3& x) { return spacing(x); });
  std::vector<Blocked> blocked(nodes.size());
  parallel_for_each_index(nodes.size(), 4, [&](std::size_t k) {
    blocked[k].from = beginnings[k];
    blocked[k].piece = paths_.piece_at(beginnings[k]);
    blocked[k].bends = bends.reached(beginnings[k], about[k]);
  });
  return blocked;
}

/// Finds the parts of the shadows of those that are kept.
void TrueNeighbours::find_shadows(const std::vector<std::size_t>& nodes,
                                  const std::vector<char>& keeps, const VolumeQuadrature& volume,
                                  std::vector<Blocked>& blocked) const {
  std::vector<Vec3> centres;
  std::vector<double> about;
  for (const std::size_t i : nodes) {
    centres.push_back(cloud_.positions[i]);
    about.push_back(radius(i));
  }
  const InfluenceGrid grid(centres, about);
  // Point by point, for what one sees serves all nodes about it.
  struct InReach {
    std::size_t node;  // of `nodes`
    PointInReach point;
  };
  std::vector<std::vector<InReach>> about_points(volume.size());
  parallel_for_each_index(volume.size(), 16, [&](std::size_t q) {
    thread_local std::vector<int> near;
    thread_local View view;
    grid.reaching(volume.positions[q], near);
    if (std::ranges::none_of(near, [&](int k) { return keeps[static_cast<std::size_t>(k)]; }))
      return;
    view.take(*this, volume.positions[q]);
    for (const int one : near) {
      const auto k = static_cast<std::size_t>(one);
      if (!keeps[k]) continue;
      const double r = about[k];
      const double full = quartic_weight((view.place() - centres[k]).norm() / r);
      Shadow shadow;
      shadow.way = r;
      const bool seen =
          view.piece() == blocked[k].piece && !way_through(blocked[k], centres[k], r, view, shadow);
      about_points[q].push_back(
          {k, {q, full, seen ? full : quartic_weight(shadow.way / r), view.piece()}});
    }
  });
  std::vector<std::vector<PointInReach>> points(nodes.size());
  for (const std::vector<InReach>& about_point : about_points)
    for (const InReach& one : about_point) points[one.node].push_back(one.point);
  parallel_for_each_index(nodes.size(), 4, [&](std::size_t k) {
    if (keeps[k]) find_parts(nodes[k], volume, points[k], blocked[k]);
  });
}

/// Parts of the deep shadow among these points of the volume, those with a twin numbered from 0.
void TrueNeighbours::find_parts(std::size_t node, const VolumeQuadrature& volume,
                                const std::vector<PointInReach>& points, Blocked& blocked) const {
  double whole = 0.0;
  std::vector<double> lost;  // of the places in deep shadow
  for (const PointInReach& one : points) {
    whole += volume.weights[one.point] * one.full;
    if (one.kept >= kDeep * one.full) continue;
    if (paths_.in_pieces()) blocked.pieces.push_back(one.piece);
    blocked.places.push_back(volume.positions[one.point]);
    blocked.points.push_back(static_cast<int>(one.point));
    lost.push_back(volume.weights[one.point] * (one.full - one.kept));
  }
  const std::size_t count = blocked.places.size();
  DisjointSets sets(count);
  const double apart = kOnePart * cloud_.spacings[node];
  const auto root = [&](std::size_t place) {
    return static_cast<std::size_t>(sets.root(static_cast<int>(place)));
  };
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = a + 1; b < count; ++b) {
      if (root(a) == root(b)) continue;
      if (!blocked.pieces.empty() && blocked.pieces[a] != blocked.pieces[b]) continue;
      const Vec3 &x = blocked.places[a], &y = blocked.places[b];
      if ((x - y).squaredNorm() < apart * apart && paths_.straight(x, y))
        sets.join(static_cast<int>(a), static_cast<int>(b));
    }
  std::vector<double> integral(count, 0.0);
  for (std::size_t a = 0; a < count; ++a) integral[root(a)] += lost[a];
  std::vector<int> number(count, -1);
  int twins = 0;
  for (std::size_t a = 0; a < count; ++a) {
    if (root(a) == a && integral[a] >= kLeastTwin * whole) number[a] = twins++;
    blocked.twins.push_back(number[root(a)]);
  }
  blocked.divided = std::any_of(blocked.twins.begin(), blocked.twins.end(),
                                [&](int twin) { return twin != blocked.twins.front(); });
}

/// The weighing way from a node to a place, at most `longest`; false where they see each other, or
/// nearly.
bool TrueNeighbours::way_through(const Blocked& blocked, const Vec3& node, double longest,
                                 View& view, Shadow& out) const {
  const Vec3 &from = blocked.from, &place = view.place();
  if (paths_.straight(from, place)) return false;
  struct Candidate {
    double length;
    int bend;
    /// The shortest is the greatest, on top of the heap.
    bool operator<(const Candidate& other) const {
      return length > other.length || (length == other.length && bend > other.bend);
    }
  };
  thread_local std::vector<Candidate> candidates;
  candidates.clear();
  for (std::size_t b = 0; b < blocked.bends.size(); ++b) {
    const double length = blocked.bends[b].length + (place - blocked.bends[b].position).norm();
    if (length < longest) candidates.push_back({length, static_cast<int>(b)});
  }
  // Most often one of the first few will do.
  std::make_heap(candidates.begin(), candidates.end());
  out.way = longest;
  out.gradient = Vec3::Zero();
  for (auto end = candidates.end(); end != candidates.begin(); --end) {
    std::pop_heap(candidates.begin(), end);
    const Candidate& one = *(end - 1);
    const TissuePaths::Bend& bend = blocked.bends[static_cast<std::size_t>(one.bend)];
    if (!view.sees_bend(bend.number, bend.position)) continue;
    const Vec3 last = place - bend.position, direct = place - from;
    const double straight = direct.norm();
    double slope_straight = 0.0, slope_way = 1.0;
    out.way = weighing_way(straight, one.length, slope_straight, slope_way);
    if (slope_way == 0.0) return false;
    out.gradient = slope_way * last.normalized() + slope_straight * direct.normalized();
    // From a node in air the same share of its weight is left as from where its ways begin.
    const Vec3 whole = place - node;
    if (from != node && whole.norm() > 0.0) {
      const double share = whole.norm() / straight;
      out.gradient = share * out.gradient +
                     out.way / straight * (whole.normalized() - share * direct.normalized());
      out.way *= share;
    }
    break;
  }
  return true;
}

bool TrueNeighbours::shadow(int node, View& view, Shadow& out) const {
  const auto i = static_cast<std::size_t>(node);
  if (blocked_of_[i] < 0) return false;
  const Blocked& blocked = blocked_[static_cast<std::size_t>(blocked_of_[i])];
  const Vec3& place = view.place();
  const int piece = view.piece();
  if (piece != blocked.piece) {
    out.way = radius(i);
    out.gradient = Vec3::Zero();
  } else if (!way_through(blocked, cloud_.positions[i], radius(i), view, out)) {
    return false;
  }
  out.twin = -1;
  const bool several = paths_.in_pieces();
  if (blocked.twins.empty() && !several) return true;
  if (!blocked.divided && !several) {
    out.twin = blocked.twins.front();
    return true;
  }
  // The part of the nearest place in deep shadow that it sees, or of the nearest.
  constexpr std::size_t kAtOnce = 12;
  thread_local std::vector<std::pair<double, std::size_t>> near;
  near.clear();
  for (std::size_t p = 0; p < blocked.places.size(); ++p)
    if (!several || blocked.pieces[p] == piece)
      near.emplace_back((blocked.places[p] - place).squaredNorm(), p);
  // Hidden from a node of its own piece, without a way, by a wall's dent: it sees it all the same.
  if (near.empty()) return piece != blocked.piece || out.way < radius(i);
  for (std::size_t sorted = 0, k = 0; k < near.size(); ++k) {
    if (k == sorted) {
      const auto begin = near.begin() + static_cast<std::ptrdiff_t>(sorted);
      sorted = std::min(sorted + kAtOnce, near.size());
      std::partial_sort(begin, near.begin() + static_cast<std::ptrdiff_t>(sorted), near.end());
    }
    const std::size_t p = near[k].second;
    if (k == 0) out.twin = blocked.twins[p];
    if (!view.sees_point(blocked.points[p], blocked.places[p])) continue;
    out.twin = blocked.twins[p];
    break;
  }
  return true;
}

}  // namespace viscera
