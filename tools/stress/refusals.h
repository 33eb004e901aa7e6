// Why cases of `viscera stress` are refused: of what kind, how many, and how many at most.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace viscera {

enum class RefusalKind {
  kNodesTooNear,  ///< two at one place, or nearly
  kSpacingJumps,  ///< a crowd among nodes far apart
  kTooFewNodes,   ///< that reach a place: they determine no field there
  kNoNormal,      ///< of the surface at a node (strong forms)
  kRatioTooHigh,  ///< Poisson's, for a formulation that can't
  kNotPositive,   ///< the compliance would give energy away
  kPieceNotHeld,  ///< one of two pieces, which nothing joins
  kOther,
};
inline constexpr int kRefusalKinds = 8;
std::string_view refusal_kind_name(RefusalKind kind);

/// By the words of the reason.
RefusalKind refusal_kind(const std::string& reason);

/// What refusals of one sort share: the first line of the reason with # for its numbers.
std::string refusal_sort(const std::string& reason);

/// Refused cases of a run, of all formulations or of one.
struct Refusals {
  int cases = 0;  ///< that were run
  int meant = 0;  ///< bodies made so that nobody could answer
  std::array<int, kRefusalKinds> of_kind{};

  int all() const;
  /// Of this kind at most, with what chance may add (three standard deviations) to a run as short
  /// as this one. What the shares are beside those measured: docs/verification.md.
  int ceiling(RefusalKind kind, bool galerkin) const;
  /// Kinds that have more, one message each.
  std::vector<std::string> over(bool galerkin) const;
};

}  // namespace viscera
