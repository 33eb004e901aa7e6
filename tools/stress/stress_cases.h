// Random bodies for `viscera stress`: clouds and surfaces that a scene might have, good and bad.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/random.h"
#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// What is unusual about a case's body. A body has one material today, so that a jump of stiffness
/// inside a body can't be built: `stiffness_jump` is two bodies of one shape and cloud, the second
/// one 1,000 times as stiff, under the same tools.
enum class StressKind {
  kPlaced,      ///< an ordinary cloud, for comparison
  kGraded,      ///< spacing from h to h/6
  kLattice,     ///< a regular grid, its outermost layer on the surface: every symmetry there is
  kScattered,   ///< nodes drawn without regard for each other
  kCoincident,  ///< some nodes twice at the same place
  kNearlyCoincident,  ///< some nodes twice, 1e-10 to 0.5 of a spacing apart
  kClustered,         ///< a crowd of nodes within a small ball
  kSliverTriangles,   ///< needles among the triangles, down to 1e-6 of the body wide
  kSliverBody,        ///< a wedge that runs out to a thin edge
  kThinWall,          ///< a wall one or two nodes thick, or all of its nodes in one plane
  kDisconnected,      ///< two pieces a gap apart, one or both of them held
  kStiffnessJump,     ///< two bodies, 1 : 1,000
};
inline constexpr int kStressKinds = 12;
std::string_view stress_kind_name(StressKind kind);

/// Draws in a row from one stream: seed and case number fix them all.
class Draws {
 public:
  Draws(std::uint64_t seed, std::uint64_t stream) : random_(seed, stream) {}
  double uniform() { return random_.uniform(next_++); }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double log_uniform(double low, double high);
  bool chance(double probability) { return uniform() < probability; }
  /// 0 to count - 1.
  int below(int count) { return static_cast<int>(uniform() * count); }
  Vec3 direction() { return random_.direction(next_++); }

 private:
  Random random_;
  std::uint64_t next_ = 0;
};

/// A body in its own frame turned and moved at random. Where `base_is_plane`, the held part lies in
/// the plane through `origin` across `up`, and the whole body above it.
struct StressBody {
  StressKind kind = StressKind::kPlaced;
  std::string formulation;
  std::string description;  ///< one line for the person who looks into it
  TriangleSurface surface;
  PointCloud cloud;
  IsotropicMaterial material;
  double size = 0.0;       ///< greatest edge [m]
  double thickness = 0.0;  ///< smallest edge [m]
  bool base_is_plane = false;
  Vec3 up = Vec3::UnitZ(), origin = Vec3::Zero();
  std::function<bool(const Vec3&)> is_fixed, is_touchable;
  /// Of a second body that differs by this alone; 1: there is none.
  double second_stiffness = 1.0;
  std::string refused;  ///< why node placement declined; empty: it did not
  /// Made so that nobody could answer: nodes at one place, a plane of nodes, a ratio beyond what
  /// the formulation takes.
  bool to_be_refused = false;
};

/// The body of this case. The kind goes round with the number, so that few cases have all of them;
/// everything else is drawn: 60 to some 300 nodes, size 1 mm to 1 m, Young's modulus 10 Pa to
/// 10 MPa, Poisson's ratio 0 to 0.499 with both ends often, every formulation that there is.
StressBody make_stress_body(std::uint64_t seed, int number);

}  // namespace viscera
