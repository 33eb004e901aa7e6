// Places of C++ sources where a small mistake might stand, and sources with such mistakes planted,
// each to be switched on by its number (mutant_switch.h). For tools/mutate.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace viscera {

enum class MutantKind {
  kSign,        ///< + for - and the other way round, += and -= too
  kFactor,      ///< a product or quotient doubled
  kNumber,      ///< a decimal number of the source changed
  kComparison,  ///< < for >, == for !=; of whole numbers < for <=
  kExtreme,     ///< std::max for std::min
};
std::string_view mutant_kind_name(MutantKind kind);

struct MutantSite {
  std::size_t begin = 0, end = 0;  ///< of the text that is replaced
  int line = 0;                    ///< from 1
  MutantKind kind = MutantKind::kSign;
  std::string token;  ///< what stands there: "-", "std::max", "0.5"
};

/// All sites of a source, in their order: by the signs of its text, outside comments, strings and
/// the preprocessor's lines. The source is expected to be formatted (tools/check_format): operators
/// of two sides stand between blanks, signs and templates' brackets don't.
std::vector<MutantSite> mutant_sites(std::string_view source);

struct PickedMutant {
  int number = 0;    ///< place in the order in which they were drawn
  std::size_t file;  ///< of the list
  MutantSite site;
};

/// `count` of the sites of these sources, drawn by the seed, at most one a line; all where there
/// are fewer. More of them with the same seed begin with the same ones.
std::vector<PickedMutant> pick_mutants(const std::vector<std::string>& sources, std::uint64_t seed,
                                       int count);

/// The source with these planted, its lines where they were. Numbers that are constants of the
/// compiler (`constexpr double`) become constants of the program, so that they can be switched.
std::string plant_mutants(const std::string& source, const std::vector<PickedMutant>& mutants);

}  // namespace viscera
