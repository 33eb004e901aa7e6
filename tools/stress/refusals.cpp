#include "tools/stress/refusals.h"

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <regex>
#include <utility>

namespace viscera {
namespace {

struct Kind {
  std::string_view name;
  /// Of all cases, of those by galerkin, which are a quarter of all.
  double most, most_of_galerkin;
};
constexpr std::array<Kind, kRefusalKinds> kKinds = {{
    {"nodes too near", 0.18, 0.18},
    {"spacing jumps", 0.06, 0.06},
    {"too few nodes", 0.11, 0.09},
    {"no normal", 0.05, 0.0},
    {"ratio too high", 0.09, 0.0},
    {"not positive", 0.10, 0.0},
    {"piece not held", 0.02, 0.05},
    {"other", 0.01, 0.02},
}};

constexpr std::array kWords = {
    std::pair{" apart, with a spacing of ", RefusalKind::kNodesTooNear},
    std::pair{" a known answer comes back wrong by ", RefusalKind::kNodesTooNear},
    std::pair{" the spacing changes at once ", RefusalKind::kSpacingJumps},
    std::pair{" nodes reach ", RefusalKind::kTooFewNodes},
    std::pair{" determine no ", RefusalKind::kTooFewNodes},
    std::pair{" has no patch of surface with a normal", RefusalKind::kNoNormal},
    std::pair{"Poisson's ratio is ", RefusalKind::kRatioTooHigh},
    std::pair{"its smallest eigenvalue is ", RefusalKind::kNotPositive},
    std::pair{" separate pieces ", RefusalKind::kPieceNotHeld},
};

}  // namespace

std::string refusal_sort(const std::string& reason) {
  static const std::regex kNumber(R"([-+]?[0-9]+(\.[0-9]*)?(e[-+]?[0-9]+)?)");
  static const std::regex kPlace(R"(\(\s*#(,?\s+#)*\s*\))");
  const std::string plain = std::regex_replace(reason.substr(0, reason.find('\n')), kNumber, "#");
  return std::regex_replace(plain, kPlace, "(#)");
}

std::string_view refusal_kind_name(RefusalKind kind) {
  return kKinds[static_cast<std::size_t>(kind)].name;
}

RefusalKind refusal_kind(const std::string& reason) {
  for (const auto& [words, kind] : kWords)
    if (reason.find(words) != std::string::npos) return kind;
  return RefusalKind::kOther;
}

int Refusals::all() const {
  return std::accumulate(of_kind.begin(), of_kind.end(), 0);
}

int Refusals::ceiling(RefusalKind kind, bool galerkin) const {
  const Kind& one = kKinds[static_cast<std::size_t>(kind)];
  const double expected = cases * (galerkin ? one.most_of_galerkin : one.most);
  return static_cast<int>(expected + 3.0 * std::sqrt(expected));
}

std::vector<std::string> Refusals::over(bool galerkin) const {
  std::vector<std::string> messages;
  for (int k = 0; k < kRefusalKinds; ++k) {
    const auto kind = static_cast<RefusalKind>(k);
    const int found = of_kind[static_cast<std::size_t>(k)], most = ceiling(kind, galerkin);
    if (found > most)
      messages.push_back(
          fmt::format("refused because of \"{}\": {} of {} cases{}, expected at "
                      "most {}",
                      refusal_kind_name(kind), found, cases, galerkin ? " by galerkin" : "", most));
  }
  return messages;
}

}  // namespace viscera
