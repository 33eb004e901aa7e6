#include "kernels/paff/tissue_pieces.h"

#include <algorithm>
#include <sstream>

#include "kernels/base/disjoint_sets.h"

namespace viscera {

std::vector<TissuePiece> tissue_pieces(std::size_t node_count, const PointFields& volume,
                                       const PointFields& fixed) {
  DisjointSets sets(node_count);
  std::vector<char> reaches(node_count, 0);
  for (std::size_t q = 0; q < volume.points(); ++q)
    for (std::size_t e = volume.begin[q]; e < volume.begin[q + 1]; ++e) {
      reaches[static_cast<std::size_t>(volume.nodes[e])] = 1;
      sets.join(volume.nodes[volume.begin[q]], volume.nodes[e]);
    }
  std::vector<char> held(node_count, 0);
  for (const int node : fixed.nodes) held[static_cast<std::size_t>(sets.root(node))] = 1;

  std::vector<TissuePiece> pieces;
  std::vector<int> number(node_count, -1);
  for (std::size_t node = 0; node < node_count; ++node) {
    if (!reaches[node]) continue;
    const auto first = static_cast<std::size_t>(sets.root(static_cast<int>(node)));
    if (number[first] < 0) {
      number[first] = static_cast<int>(pieces.size());
      pieces.push_back({{}, held[first] != 0});
    }
    pieces[static_cast<std::size_t>(number[first])].nodes.push_back(static_cast<int>(node));
  }
  return pieces;
}

std::vector<int> loose_pieces(const std::vector<TissuePiece>& pieces, std::size_t node_count) {
  std::vector<int> number(node_count, -1);
  int count = 0;
  for (const TissuePiece& piece : pieces) {
    if (piece.held) continue;
    for (const int node : piece.nodes) number[static_cast<std::size_t>(node)] = count;
    ++count;
  }
  return number;
}

std::string free_pieces_text(const std::vector<TissuePiece>& pieces, const PointCloud& cloud,
                             std::size_t own) {
  std::vector<const TissuePiece*> free;
  for (const TissuePiece& piece : pieces)
    if (!piece.held) free.push_back(&piece);
  if (free.empty()) return {};
  const auto largest = std::max_element(free.begin(), free.end(), [](const auto* a, const auto* b) {
    return a->nodes.size() < b->nodes.size();
  });
  std::vector<int> nodes = (*largest)->nodes;
  if (static_cast<std::size_t>(nodes.front()) < own)
    std::erase_if(nodes, [&](int node) { return static_cast<std::size_t>(node) >= own; });
  Vec3 centre = Vec3::Zero();
  for (const int node : nodes)
    centre += cloud.positions[static_cast<std::size_t>(node)] / static_cast<double>(nodes.size());
  std::ostringstream text;
  text.precision(3);
  text << "fixed region: of the body's " << pieces.size() << " separate pieces " << free.size()
       << (free.size() == 1 ? " isn't held, with " : " aren't held, the largest with ")
       << nodes.size() << " nodes about (" << 1e3 * centre.transpose()
       << ") mm; expected every piece to be held somewhere: hold it too, join it to the rest, or "
          "leave it out";
  return text.str();
}

}  // namespace viscera
