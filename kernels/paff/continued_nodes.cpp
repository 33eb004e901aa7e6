#include "kernels/paff/continued_nodes.h"

#include "kernels/paff/true_neighbours.h"

namespace viscera {

std::vector<int> continued_nodes(const ShapeFunctions& before, const ShapeFunctions& now) {
  const TrueNeighbours* split = now.true_neighbours().get();
  const TrueNeighbours* was = before.true_neighbours().get();
  const std::size_t twins = split ? split->twins() : 0, own = now.cloud().size() - twins;
  std::vector<int> continued;
  for (std::size_t node = 0; node < own; ++node) continued.push_back(static_cast<int>(node));
  for (std::size_t twin = 0; twin < twins; ++twin) {
    const int parent = split->parent(twin);
    const Vec3& place = split->place_of_twin(twin);
    TrueNeighbours::Shadow shadow;
    const bool had_one =
        was && was->shadow(parent, place, was->piece_at(place), shadow) && shadow.twin >= 0;
    continued.push_back(had_one ? shadow.twin : parent);
  }
  return continued;
}

}  // namespace viscera
