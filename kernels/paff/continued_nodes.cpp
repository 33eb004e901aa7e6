#include "kernels/paff/continued_nodes.h"

#include <span>

#include "kernels/paff/true_neighbours.h"
#include "kernels/points/kd_tree.h"

namespace viscera {
namespace {

/// A node farther than this outside of the tissue lies in air, not on its surface; in spacings.
constexpr double kOutside = 1e-6;

/// Who carried a node's field at this place, the node or a twin of its own; -1: neither did.
int carrier_before(const TrueNeighbours* was, int node, const Vec3& place) {
  if (!was) return node;
  thread_local TrueNeighbours::View view;
  TrueNeighbours::Shadow shadow;
  view.take(*was, place);
  return was->shadow(node, view, shadow) ? shadow.twin : node;
}

/// The node that has most of this place; `otherwise` where none has any.
int most_of(const ShapeFunctions& fields, const Vec3& place, int otherwise) {
  ShapeValues values;
  const int strongest = fields.evaluate(place, false, values) ? values.strongest() : -1;
  return strongest < 0 ? otherwise : strongest;
}

}  // namespace

std::size_t own_nodes(const ShapeFunctions& fields) {
  const TrueNeighbours* split = fields.true_neighbours().get();
  return fields.cloud().size() - (split ? split->twins() : 0);
}

std::vector<int> continued_nodes(const ShapeFunctions& before, const ShapeFunctions& now) {
  const TrueNeighbours* split = now.true_neighbours().get();
  const TrueNeighbours* was = before.true_neighbours().get();
  const std::size_t twins = split ? split->twins() : 0, own = own_nodes(now);
  std::vector<int> continued;
  for (std::size_t node = 0; node < own; ++node) continued.push_back(static_cast<int>(node));
  for (std::size_t twin = 0; twin < twins; ++twin) {
    const int parent = split->parent(twin);
    const int carrier = carrier_before(was, parent, split->place_of_twin(twin));
    continued.push_back(carrier >= 0 ? carrier : parent);
  }
  return continued;
}

std::vector<int> continued_beside_gone_pieces(const ShapeFunctions& before,
                                              const ShapeFunctions& now, const SurfaceTree& left) {
  const TrueNeighbours* split = now.true_neighbours().get();
  const TrueNeighbours* was = before.true_neighbours().get();
  const std::size_t twins = split ? split->twins() : 0, own = own_nodes(now);
  const KdTree nodes_before(std::span(before.cloud().positions).first(own_nodes(before)));
  std::vector<KdTree::Found> found;
  std::vector<int> same, continued;
  for (std::size_t node = 0; node < own; ++node) {
    const Vec3& at = now.cloud().positions[node];
    nodes_before.nearest(at, 1, -1, found);
    same.push_back(found.front().index);
    continued.push_back(same.back());
    if (!(left.signed_distance(at) > kOutside * now.cloud().spacings[node])) continue;
    const Vec3 place = left.closest(at).position;
    const int carrier = carrier_before(was, same.back(), place);
    continued.back() = carrier >= 0 ? carrier : most_of(before, place, same.back());
  }
  for (std::size_t twin = 0; twin < twins; ++twin) {
    const int parent = same[static_cast<std::size_t>(split->parent(twin))];
    const Vec3& place = split->place_of_twin(twin);
    const int carrier = carrier_before(was, parent, place);
    continued.push_back(carrier >= 0 ? carrier : most_of(before, place, parent));
  }
  return continued;
}

}  // namespace viscera
