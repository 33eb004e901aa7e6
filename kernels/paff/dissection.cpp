#include "kernels/paff/dissection.h"

#include <algorithm>
#include <numeric>

namespace viscera {
namespace {

/// Sets of this many nodes are eliminated as one.
constexpr std::size_t kLeaf = 48;

/// Both triangles of the pattern, without the diagonal.
struct Graph {
  std::vector<std::size_t> begin;
  std::vector<int> neighbours;

  explicit Graph(const SymmetricPattern& pattern) : begin(pattern.rows() + 1, 0) {
    const auto each_edge = [&](const auto& visit) {
      for (std::size_t row = 0; row < pattern.rows(); ++row) {
        for (std::size_t e = pattern.row_begin[row] + 1; e < pattern.row_begin[row + 1]; ++e) {
          visit(row, static_cast<std::size_t>(pattern.columns[e]));
        }
      }
    };
    each_edge([&](std::size_t i, std::size_t j) {
      ++begin[i + 1];
      ++begin[j + 1];
    });
    for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
    neighbours.resize(begin.back());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    each_edge([&](std::size_t i, std::size_t j) {
      neighbours[next[i]++] = static_cast<int>(j);
      neighbours[next[j]++] = static_cast<int>(i);
    });
  }

  std::span<const int> of(int node) const {
    const auto i = static_cast<std::size_t>(node);
    return {neighbours.data() + begin[i], begin[i + 1] - begin[i]};
  }
};

class Dissector {
 public:
  Dissector(std::span<const Vec3> positions, const Graph& graph, Dissection& out)
      : positions_(positions), graph_(graph), out_(out), side_(positions.size(), 0) {}

  /// Appends the fronts of a set of nodes; returns the last one, which holds its separator.
  int dissect(std::vector<int> nodes) {
    if (nodes.size() <= kLeaf) return append(nodes, {});
    Box box;
    for (const int node : nodes) box.extend(place(node));
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const auto before = [&](int a, int b) {
      return place(a)[axis] < place(b)[axis] || (place(a)[axis] == place(b)[axis] && a < b);
    };
    const auto middle = nodes.begin() + static_cast<std::ptrdiff_t>(nodes.size() / 2);
    std::nth_element(nodes.begin(), middle, nodes.end(), before);
    std::vector<int> low(nodes.begin(), middle), high(middle, nodes.end()), separator;
    for (const int node : low) side_[static_cast<std::size_t>(node)] = 1;
    for (const int node : high) side_[static_cast<std::size_t>(node)] = 2;
    // Nodes of the low side next to the high one separate; the other way round if those are fewer.
    std::vector<int> from_low = next_to(low, 2), from_high = next_to(high, 1);
    for (const int node : nodes) side_[static_cast<std::size_t>(node)] = 0;
    const bool low_separates = from_low.size() <= from_high.size();
    separator = low_separates ? std::move(from_low) : std::move(from_high);
    std::vector<int>& shrunk = low_separates ? low : high;
    for (const int node : separator) side_[static_cast<std::size_t>(node)] = 3;
    std::erase_if(shrunk, [&](int node) { return side_[static_cast<std::size_t>(node)] == 3; });
    for (const int node : separator) side_[static_cast<std::size_t>(node)] = 0;
    if (separator.empty() || low.empty() || high.empty()) {
      if (!separator.empty()) return append(nodes, {});  // all next to each other
    }
    std::vector<int> children;
    if (!low.empty()) children.push_back(dissect(std::move(low)));
    if (!high.empty()) children.push_back(dissect(std::move(high)));
    return append(separator, std::move(children));
  }

 private:
  const Vec3& place(int node) const { return positions_[static_cast<std::size_t>(node)]; }

  std::vector<int> next_to(const std::vector<int>& nodes, char other_side) const {
    std::vector<int> found;
    for (const int node : nodes) {
      const auto near = graph_.of(node);
      if (std::any_of(near.begin(), near.end(),
                      [&](int j) { return side_[static_cast<std::size_t>(j)] == other_side; })) {
        found.push_back(node);
      }
    }
    return found;
  }

  int append(const std::vector<int>& nodes, std::vector<int> children) {
    const int index = static_cast<int>(out_.fronts.size());
    Dissection::Front front;
    front.first = static_cast<int>(out_.order.size());
    out_.order.insert(out_.order.end(), nodes.begin(), nodes.end());
    front.last = static_cast<int>(out_.order.size());
    for (const int child : children) out_.fronts[static_cast<std::size_t>(child)].parent = index;
    front.children = std::move(children);
    out_.fronts.push_back(std::move(front));
    return index;
  }

  std::span<const Vec3> positions_;
  const Graph& graph_;
  Dissection& out_;
  std::vector<char> side_;
};

}  // namespace

std::size_t Dissection::factor_entries(int width) const {
  std::size_t blocks = 0;
  for (const Front& front : fronts) blocks += front.own() * front.size();
  return blocks * static_cast<std::size_t>(width * width);
}

Dissection dissect(std::span<const Vec3> positions, const SymmetricPattern& pattern) {
  const Graph graph(pattern);
  Dissection out;
  std::vector<int> all(positions.size());
  std::iota(all.begin(), all.end(), 0);
  Dissector(positions, graph, out).dissect(std::move(all));

  const std::size_t n = positions.size();
  out.position.resize(n);
  out.front_of.resize(n);
  for (std::size_t p = 0; p < n; ++p) {
    out.position[static_cast<std::size_t>(out.order[p])] = static_cast<int>(p);
  }
  std::vector<int> seen_by(n, -1);
  for (std::size_t f = 0; f < out.fronts.size(); ++f) {
    Dissection::Front& front = out.fronts[f];
    const auto see = [&](int p) {
      if (p < front.last || seen_by[static_cast<std::size_t>(p)] == static_cast<int>(f)) return;
      seen_by[static_cast<std::size_t>(p)] = static_cast<int>(f);
      front.border.push_back(p);
    };
    for (int p = front.first; p < front.last; ++p) {
      out.front_of[static_cast<std::size_t>(p)] = static_cast<int>(f);
      for (const int node : graph.of(out.order[static_cast<std::size_t>(p)])) {
        see(out.position[static_cast<std::size_t>(node)]);
      }
    }
    for (const int child : front.children) {
      for (const int p : out.fronts[static_cast<std::size_t>(child)].border) see(p);
    }
    std::sort(front.border.begin(), front.border.end());
  }
  return out;
}

}  // namespace viscera
