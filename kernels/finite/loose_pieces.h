// Pieces of a body that nothing holds: all of one that is free, or what a cut has taken off. Each
// moves and turns by itself, and may go farther than tissue stretches.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/finite/finite_body.h"
#include "kernels/finite/finite_state.h"

namespace viscera {

class LoosePieces {
 public:
  LoosePieces() = default;  ///< there are none
  /// `piece_of`: of each node the number of its piece, from 0; -1: something holds it. Empty: there
  /// are none. With the nodes' places at rest [m] and masses [kg].                            (N)
  LoosePieces(std::span<const int> piece_of, std::span<const Vec3> positions,
              std::span<const double> masses);
  /// Nothing holds any of a body, whose scene watches where it goes.
  static LoosePieces of_free_body(std::span<const Vec3> positions, std::span<const double> masses);

  bool empty() const { return pieces_.empty(); }
  bool whole() const { return whole_; }  ///< it is a free body
  /// Nodes of each piece, ascending.
  const std::vector<std::vector<int>>& pieces() const { return pieces_; }
  bool has(std::size_t node) const { return !empty() && piece_of_[node] >= 0; }
  /// The number of the piece that has this node; -1: something holds it.
  int piece_of(std::size_t node) const { return empty() ? -1 : piece_of_[node]; }
  double mass(int piece) const;  ///< [kg]

  /// u after a way: pieces turn as one on it. `rigidly`: they do nothing else.                (3 N)
  VectorX gone_by(const VectorX& u, const VectorX& way, bool rigidly = false) const;
  /// u where each piece has its shape at rest again, about where it lies and as it has turned.
  VectorX as_at_rest(const VectorX& u) const;
  /// Of each piece of a body that is displaced so.                                       (pieces)
  std::vector<Mat3> rotations(const FiniteBody& body, const VectorX& u) const;
  /// Gives all nodes of each piece its own.
  void set(std::span<const Mat3> of_pieces, NodalRotations& rotations) const;
  /// Whether tissue of theirs has swelled or shrunk as none does (kMostSwelled).
  bool any_swollen(const FiniteBody& body, const VectorX& u) const;
  /// Nodes of pieces all of which have fallen farther than anybody looks (kInView); never of a
  /// whole body, which its scene watches.
  std::vector<int> out_of_view(const VectorX& u) const;
  /// Finite, and nowhere farther than tissue goes that something holds, or that nothing does.
  bool is_tissue(const VectorX& u) const;

 private:
  std::vector<int> piece_of_;
  std::vector<std::vector<int>> pieces_;
  std::vector<Vec3> positions_;
  std::vector<double> masses_;
  bool whole_ = false;
};

}  // namespace viscera
