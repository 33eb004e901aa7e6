#include "engine/scene/spelling.h"

#include <algorithm>
#include <array>
#include <cctype>

namespace viscera {
namespace {

constexpr std::size_t kLongestWord = 64;

char lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

// Optimal string alignment: Levenshtein's distance with swaps of neighbours, three rows at a time.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::array<std::array<std::size_t, kLongestWord + 1>, 3> rows{};
  for (std::size_t j = 0; j <= b.size(); ++j) rows[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    auto& row = rows[i % 3];
    const auto& above = rows[(i + 2) % 3];
    const auto& two_above = rows[(i + 1) % 3];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (same ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                           lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) row[j] = std::min(row[j], two_above[j - 2] + 1);
    }
  }
  return rows[a.size() % 3][b.size()];
}

constexpr std::array kUnits = {"mg_per_kJ", "ug",       "mm",
                               "cm",        "m",        "um",
                               "nm",        "in",       "inch",
                               "ms",        "us",       "s",
                               "min",       "h",        "Pa",
                               "hPa",       "kPa",      "MPa",
                               "GPa",       "mmHg",     "bar",
                               "mbar",      "psi",      "deg",
                               "rad",       "C",        "K",
                               "F",         "W",        "mW",
                               "kW",        "N",        "mN",
                               "kN",        "g",        "mg",
                               "kg",        "J",        "kJ",
                               "Hz",        "kHz",      "m_per_s2",
                               "kg_m3",     "g_per_J",  "g_per_kJ",
                               "kg_per_J",  "mg_per_J", "N_per_m",
                               "J_per_m",   "J_per_m2", "N_per_m_per_mm",
                               "kPa_per_mm"};

}  // namespace

std::string nearest_spelling(std::string_view word, const std::vector<std::string>& candidates) {
  if (word.size() > kLongestWord) return {};
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    if (candidate.size() > kLongestWord) continue;
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string nearest = nearest_spelling(word, candidates);
  return nearest.empty() ? std::string() : " (did you mean \"" + nearest + "\"?)";
}

UnitSplit split_unit(std::string_view key) {
  std::string_view longest;
  for (const std::string_view unit : kUnits) {
    const bool ends = key.size() > unit.size() + 1 && key.ends_with(unit) &&
                      key[key.size() - unit.size() - 1] == '_';
    if (ends && unit.size() > longest.size()) longest = unit;
  }
  if (longest.empty()) return {std::string(key), ""};
  return {std::string(key.substr(0, key.size() - longest.size() - 1)), std::string(longest)};
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

}  // namespace viscera
