#include "kernels/paff/inverse_products.h"

#include <algorithm>
#include <iterator>

#include "kernels/base/parallel.h"
#include "kernels/paff/blas.h"

namespace viscera {
namespace {

constexpr std::size_t kTile = 512;  // rows and columns of a task

/// One entry of W at a front: the place, the position of its node, phi.
struct Entry {
  int place;
  int position;
  float value;
};

/// The entries of W by the front of their node.
std::vector<std::vector<Entry>> entries_by_front(const Dissection& dissection,
                                                 const SparseWeights& places) {
  std::vector<std::vector<Entry>> of_front(dissection.fronts.size());
  for (std::size_t p = 0; p < places.rows(); ++p) {
    for (int e = places.row_begin[p]; e < places.row_begin[p + 1]; ++e) {
      const auto entry = static_cast<std::size_t>(e);
      const int position = dissection.position[static_cast<std::size_t>(places.nodes[entry])];
      const int front = dissection.front_of[static_cast<std::size_t>(position)];
      of_front[static_cast<std::size_t>(front)].push_back(
          {static_cast<int>(p), position, places.values[entry]});
    }
  }
  return of_front;
}

/// Ascending union.
void merge_into(std::vector<int>& all, const std::vector<int>& more) {
  std::vector<int> merged;
  merged.reserve(all.size() + more.size());
  std::set_union(all.begin(), all.end(), more.begin(), more.end(), std::back_inserter(merged));
  all.swap(merged);
}

std::vector<int> places_of(const std::vector<Entry>& entries) {
  std::vector<int> places;
  for (const Entry& entry : entries) {
    if (places.empty() || places.back() != entry.place) places.push_back(entry.place);
  }
  return places;
}

/// Where the members of an ascending list stand in a longer one.
std::vector<std::size_t> indices_in(const std::vector<int>& all, const std::vector<int>& part) {
  std::vector<std::size_t> indices;
  indices.reserve(part.size());
  auto at = all.begin();
  for (const int member : part) {
    at = std::lower_bound(at, all.end(), member);
    indices.push_back(static_cast<std::size_t>(at - all.begin()));
  }
  return indices;
}

template <class Body>
void for_each_tile(std::size_t rows, std::size_t columns, const Body& body) {
  const std::size_t row_tiles = (rows + kTile - 1) / kTile;
  const std::size_t column_tiles = (columns + kTile - 1) / kTile;
  parallel_chunks(row_tiles * column_tiles, 1, [&](std::size_t at, std::size_t) {
    const std::size_t i = (at % row_tiles) * kTile, j = (at / row_tiles) * kTile;
    body(i, j, std::min(kTile, rows - i), std::min(kTile, columns - j));
  });
}

int integer(std::size_t n) {
  return static_cast<int>(n);
}

/// What a front hands to its parent.
template <class Real>
struct Part {
  std::vector<int> places;    // whose loads act in this part of the body, ascending
  std::vector<int> columns;   // those of them that have columns
  std::vector<Real> left;     // loads on the border: (w places) x (w border)
  std::vector<Real> product;  // Y^T Y_c of this part: (w places) x (w columns)
};

template <class Real>
class InverseProducts {
 public:
  InverseProducts(const FrontalCholesky<Real>& factor, const SparseWeights& places,
                  std::span<const int> columns)
      : factor_(factor),
        dissection_(factor.dissection()),
        w_(static_cast<std::size_t>(factor.width())),
        entries_(entries_by_front(dissection_, places)),
        has_column_(places.rows(), 0),
        lower_only_(columns.size() == places.rows()) {
    for (const int place : columns) has_column_[static_cast<std::size_t>(place)] = 1;
    all_.places.resize(places.rows());
    for (std::size_t p = 0; p < places.rows(); ++p) all_.places[p] = static_cast<int>(p);
    all_.columns.assign(columns.begin(), columns.end());
  }

  std::vector<Real> run() {
    std::vector<Part<Real>> roots;
    for (std::size_t f = 0; f < dissection_.fronts.size(); ++f) {
      if (dissection_.fronts[f].parent < 0) roots.push_back(climb(f));
    }
    if (roots.size() == 1 && roots[0].places.size() == all_.places.size()) {
      return std::move(roots[0].product);
    }
    take_products(roots, all_);
    return std::move(all_.product);
  }

 private:
  Part<Real> climb(std::size_t f) {
    const std::vector<int>& children = dissection_.fronts[f].children;
    std::vector<Part<Real>> below(children.size());
    parallel_for_each_index(children.size(), 1, [&](std::size_t c) {
      below[c] = climb(static_cast<std::size_t>(children[c]));
    });
    return eliminate(f, below);
  }

  /// Transposed columns of Y at a front: one row for each unit load, one column for each unknown.
  Part<Real> eliminate(std::size_t f, std::vector<Part<Real>>& below) {
    const Dissection::Front& front = dissection_.fronts[f];
    const std::size_t own = w_ * front.own(), size = w_ * front.size(), rest = size - own;
    Part<Real> part;
    part.places = places_of(entries_[f]);
    for (const Part<Real>& child : below) merge_into(part.places, child.places);
    for (const int place : part.places) {
      if (has_column_[static_cast<std::size_t>(place)]) part.columns.push_back(place);
    }
    if (part.places.empty()) return part;

    const std::size_t loads = w_ * part.places.size();
    std::vector<Real> solved(loads * own, Real(0));
    part.left.assign(loads * rest, Real(0));
    take_loads(f, below, part, solved);
    add_own_loads(f, part, solved);
    if (own > 0) {
      const Real* panel = factor_.panel(f);
      for_each_tile(loads, 1, [&](std::size_t i, std::size_t, std::size_t count, std::size_t) {
        blas::solve_right(true, integer(count), integer(own), panel, integer(size),
                          solved.data() + i, integer(loads));
      });
      for_each_tile(loads, rest, [&](std::size_t i, std::size_t j, std::size_t m, std::size_t n) {
        blas::multiply(true, integer(m), integer(n), integer(own), Real(-1), solved.data() + i,
                       integer(loads), panel + own + j, integer(size), Real(1),
                       part.left.data() + i + j * loads, integer(loads));
      });
    }
    take_products(below, part);
    add_product(part, solved, own);
    return part;
  }

  void take_loads(std::size_t f, std::vector<Part<Real>>& below, Part<Real>& part,
                  std::vector<Real>& solved) {
    const Dissection::Front& front = dissection_.fronts[f];
    const std::size_t loads = w_ * part.places.size();
    for (std::size_t c = 0; c < below.size(); ++c) {
      Part<Real>& child = below[c];
      const std::vector<std::size_t> to_row = indices_in(part.places, child.places);
      const std::vector<int>& border =
          dissection_.fronts[static_cast<std::size_t>(front.children[c])].border;
      const std::size_t child_loads = w_ * child.places.size();
      parallel_for_each_index(border.size(), 32, [&](std::size_t b) {
        const int position = border[b];
        Real* to = nullptr;
        if (position < front.last) {
          to = solved.data() + w_ * static_cast<std::size_t>(position - front.first) * loads;
        } else {
          const auto place = std::lower_bound(front.border.begin(), front.border.end(), position);
          to = part.left.data() +
               w_ * static_cast<std::size_t>(place - front.border.begin()) * loads;
        }
        const Real* from = child.left.data() + w_ * b * child_loads;
        for (std::size_t k = 0; k < w_; ++k) {
          for (std::size_t p = 0; p < to_row.size(); ++p) {
            for (std::size_t a = 0; a < w_; ++a) {
              to[k * loads + w_ * to_row[p] + a] += from[k * child_loads + w_ * p + a];
            }
          }
        }
      });
      std::vector<Real>().swap(child.left);  // = {} keeps its memory
    }
  }

  void add_own_loads(std::size_t f, const Part<Real>& part, std::vector<Real>& solved) {
    const std::size_t loads = w_ * part.places.size();
    std::size_t row = 0;
    for (const Entry& entry : entries_[f]) {
      while (part.places[row] != entry.place) ++row;
      const auto node = static_cast<std::size_t>(entry.position - dissection_.fronts[f].first);
      for (std::size_t k = 0; k < w_; ++k) {
        solved[w_ * row + k + (w_ * node + k) * loads] += static_cast<Real>(entry.value);
      }
    }
  }

  /// Sum of the products of the parts below. An only child of the same places hands its own on.
  void take_products(std::vector<Part<Real>>& below, Part<Real>& part) {
    for (Part<Real>& child : below) {
      if (part.product.empty() && child.places.size() == part.places.size()) {
        part.product = std::move(child.product);
      }
    }
    const std::size_t height = w_ * part.places.size();
    part.product.resize(height * w_ * part.columns.size(), Real(0));
    for (Part<Real>& child : below) {
      if (child.product.empty()) continue;
      const std::vector<std::size_t> to_row = indices_in(part.places, child.places);
      const std::vector<std::size_t> to_column = indices_in(part.columns, child.columns);
      const std::size_t child_height = w_ * child.places.size();
      parallel_for_each_index(w_ * child.columns.size(), 16, [&](std::size_t c) {
        Real* to = part.product.data() + (w_ * to_column[c / w_] + c % w_) * height;
        const Real* from = child.product.data() + c * child_height;
        for (std::size_t p = 0; p < to_row.size(); ++p) {
          for (std::size_t a = 0; a < w_; ++a) to[w_ * to_row[p] + a] += from[w_ * p + a];
        }
      });
      child = {};
    }
  }

  /// Adds the own unknowns' part of Y^T Y_c.
  void add_product(Part<Real>& part, const std::vector<Real>& solved, std::size_t own) {
    const std::size_t height = w_ * part.places.size(), count = w_ * part.columns.size();
    if (count == 0 || own == 0) return;
    const Real* right = solved.data();
    std::vector<Real> chosen;
    if (count != height) {
      const std::vector<std::size_t> row_of = indices_in(part.places, part.columns);
      chosen.resize(count * own);
      parallel_for_each_index(own, 64, [&](std::size_t u) {
        for (std::size_t c = 0; c < row_of.size(); ++c) {
          std::copy_n(solved.data() + w_ * row_of[c] + u * height, w_,
                      chosen.data() + w_ * c + u * count);
        }
      });
      right = chosen.data();
    }
    for_each_tile(height, count, [&](std::size_t i, std::size_t j, std::size_t m, std::size_t n) {
      if (lower_only_ && i < j) return;
      blas::multiply(true, integer(m), integer(n), integer(own), Real(1), solved.data() + i,
                     integer(height), right + j, integer(count), Real(1),
                     part.product.data() + i + j * height, integer(height));
    });
  }

  const FrontalCholesky<Real>& factor_;
  const Dissection& dissection_;
  std::size_t w_;
  std::vector<std::vector<Entry>> entries_;
  std::vector<char> has_column_;
  bool lower_only_;
  Part<Real> all_;
};

}  // namespace

template <class Real>
std::vector<Real> inverse_products(const FrontalCholesky<Real>& factor, const SparseWeights& places,
                                   std::span<const int> columns) {
  return InverseProducts<Real>(factor, places, columns).run();
}

template std::vector<float> inverse_products(const FrontalCholesky<float>&, const SparseWeights&,
                                             std::span<const int>);
template std::vector<double> inverse_products(const FrontalCholesky<double>&, const SparseWeights&,
                                              std::span<const int>);

double inverse_products_cost(const Dissection& dissection, int width, const SparseWeights& places,
                             std::span<const int> columns) {
  const std::vector<std::vector<Entry>> entries = entries_by_front(dissection, places);
  std::vector<char> has_column(places.rows(), 0);
  for (const int place : columns) has_column[static_cast<std::size_t>(place)] = 1;
  const double w3 = static_cast<double>(width) * width * width;
  double cost = 0.0;
  std::vector<std::vector<int>> active(dissection.fronts.size());
  for (std::size_t f = 0; f < dissection.fronts.size(); ++f) {  // children come before parents
    const Dissection::Front& front = dissection.fronts[f];
    merge_into(active[f], places_of(entries[f]));
    const auto own = static_cast<double>(front.own());
    const auto border = static_cast<double>(front.border.size());
    const auto height = static_cast<double>(active[f].size());
    const auto count =
        static_cast<double>(std::count_if(active[f].begin(), active[f].end(), [&](int p) {
          return has_column[static_cast<std::size_t>(p)] != 0;
        }));
    const double product = columns.size() == places.rows() ? 0.5 * height : height;
    cost += own * (height * (0.5 * own + border) + product * count);
    if (front.parent >= 0) merge_into(active[static_cast<std::size_t>(front.parent)], active[f]);
    std::vector<int>().swap(active[f]);
  }
  return w3 * cost;
}

}  // namespace viscera
