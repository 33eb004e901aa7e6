#include "tools/mutation/mutant_sites.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>
#include <regex>

#include "kernels/base/random.h"

namespace viscera {
namespace {

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
}

/// The source with blanks for everything that isn't code; as long.
std::string code_of(std::string_view source) {
  std::string code(source);
  const auto blank = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < std::min(end, code.size()); ++i)
      if (code[i] != '\n') code[i] = ' ';
    return end;
  };
  const auto after = [&](std::string_view what, std::size_t from) {
    const std::size_t at = source.find(what, from);
    return at == std::string_view::npos ? source.size() : at + what.size();
  };
  bool line_begins = true;
  for (std::size_t i = 0; i < source.size();) {
    const std::string_view rest = source.substr(i);
    if (rest.starts_with("//") || (line_begins && rest.front() == '#')) {
      i = blank(i, after("\n", i) - 1);
    } else if (rest.starts_with("/*")) {
      i = blank(i, after("*/", i));
    } else if (rest.starts_with("R\"") && (i == 0 || !is_word(source[i - 1]))) {
      const std::size_t open = source.find('(', i);
      const std::string close = ")" + std::string(source.substr(i + 2, open - i - 2)) + "\"";
      i = blank(i, after(close, open));
    } else if (rest.front() == '"' ||
               (rest.front() == '\'' && (i == 0 || !is_word(source[i - 1])))) {
      std::size_t end = i + 1;
      while (end < source.size() && source[end] != rest.front()) end += source[end] == '\\' ? 2 : 1;
      i = blank(i, end + 1);
    } else {
      line_begins = rest.front() == '\n' || (line_begins && rest.front() == ' ');
      ++i;
    }
  }
  return code;
}

/// End of the decimal number that begins here; `at` where none does.
std::size_t decimal_end(const std::string& code, std::size_t at) {
  const auto digit = [&](std::size_t i) {
    return i < code.size() && std::isdigit(static_cast<unsigned char>(code[i]));
  };
  if (!digit(at) || (at > 0 && (is_word(code[at - 1]) || code[at - 1] == '.'))) return at;
  std::size_t end = at;
  bool decimal = false;
  while (digit(end)) ++end;
  if (end < code.size() && code[end] == '.') {
    decimal = true;
    ++end;
    while (digit(end)) ++end;
  }
  if (end < code.size() && code[end] == 'e') {
    const std::size_t sign = end + 1 < code.size() && (code[end + 1] == '-') ? 2 : 1;
    if (digit(end + sign)) {
      decimal = true;
      end += sign;
      while (digit(end)) ++end;
    }
  }
  if (end < code.size() && code[end] == 'f' && decimal) ++end;
  if (end < code.size() && is_word(code[end])) return at;
  return decimal ? end : at;
}

struct Operator {
  std::string_view text;
  MutantKind kind;
};
constexpr std::array kOperators = {
    Operator{"+", MutantKind::kSign},        Operator{"-", MutantKind::kSign},
    Operator{"+=", MutantKind::kSign},       Operator{"-=", MutantKind::kSign},
    Operator{"*", MutantKind::kFactor},      Operator{"/", MutantKind::kFactor},
    Operator{"<", MutantKind::kComparison},  Operator{"<=", MutantKind::kComparison},
    Operator{">", MutantKind::kComparison},  Operator{">=", MutantKind::kComparison},
    Operator{"==", MutantKind::kComparison}, Operator{"!=", MutantKind::kComparison},
};

/// What takes the token's place.
std::string switched(const PickedMutant& mutant) {
  const std::string& token = mutant.site.token;
  const int n = mutant.number;
  const auto relation = [&](std::string_view name) {
    return fmt::format("<viscera_mutant::compare<viscera_mutant::Relation::k{}>({})>", name, n);
  };
  switch (mutant.site.kind) {
    case MutantKind::kSign:
      return fmt::format("{} viscera_mutant::sign({}) *", token, n);
    case MutantKind::kFactor:
      return fmt::format("* viscera_mutant::factor({}) {}", n, token);
    case MutantKind::kNumber:
      return fmt::format("viscera_mutant::number({}, {})", n, token);
    case MutantKind::kExtreme:
      return fmt::format("viscera_mutant::{}({})", token == "std::max" ? "greatest" : "least", n);
    case MutantKind::kComparison:
      break;
  }
  if (token == "<") return relation("Less");
  if (token == "<=") return relation("LessEqual");
  if (token == ">") return relation("Greater");
  if (token == ">=") return relation("GreaterEqual");
  return relation(token == "==" ? "Equal" : "Unequal");
}

}  // namespace

std::string_view mutant_kind_name(MutantKind kind) {
  static constexpr std::array<std::string_view, 5> kNames = {"sign", "factor", "number",
                                                             "comparison", "extreme"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::vector<MutantSite> mutant_sites(std::string_view source) {
  const std::string code = code_of(source);
  std::vector<MutantSite> sites;
  int line = 1;
  for (std::size_t i = 0; i < code.size(); ++i) {
    if (code[i] == '\n') ++line;
    const auto add = [&](std::size_t length, MutantKind kind) {
      sites.push_back({i, i + length, line, kind, std::string(source.substr(i, length))});
    };
    if (const std::size_t end = decimal_end(code, i); end > i) {
      add(end - i, MutantKind::kNumber);
      i = end - 1;
      continue;
    }
    for (const std::string_view extreme : {"std::max(", "std::min("})
      if (std::string_view(code).substr(i).starts_with(extreme))
        add(extreme.size() - 1, MutantKind::kExtreme);
    if (i == 0 || code[i - 1] != ' ') continue;
    const std::size_t end = code.find_first_of(" \n", i);
    if (end == std::string::npos) continue;
    const std::string_view word = std::string_view(code).substr(i, end - i);
    for (const Operator& one : kOperators)
      if (one.text == word) add(word.size(), one.kind);
  }
  return sites;
}

std::vector<PickedMutant> pick_mutants(const std::vector<std::string>& sources, std::uint64_t seed,
                                       int count) {
  std::vector<PickedMutant> all;
  for (std::size_t f = 0; f < sources.size(); ++f)
    for (MutantSite& site : mutant_sites(sources[f])) all.push_back({0, f, std::move(site)});
  const Random random(seed, 0);
  std::vector<double> draws(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) draws[i] = random.uniform(i);
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return std::pair(draws[i], i); });
  std::vector<PickedMutant> picked;
  std::set<std::pair<std::size_t, int>> lines;
  for (const std::size_t i : order) {
    if (static_cast<int>(picked.size()) >= count) break;
    if (!lines.emplace(all[i].file, all[i].site.line).second) continue;
    picked.push_back(std::move(all[i]));
    picked.back().number = static_cast<int>(picked.size()) - 1;
  }
  return picked;
}

std::string plant_mutants(const std::string& source, const std::vector<PickedMutant>& mutants) {
  std::vector<const PickedMutant*> backwards;
  for (const PickedMutant& mutant : mutants) backwards.push_back(&mutant);
  std::ranges::sort(backwards, std::greater(),
                    [](const PickedMutant* one) { return one->site.begin; });
  std::string planted = source;
  for (const PickedMutant* mutant : backwards)
    planted.replace(mutant->site.begin, mutant->site.end - mutant->site.begin, switched(*mutant));
  static const std::regex kConstant(R"((static )?constexpr (double|float) )");
  planted = std::regex_replace(planted, kConstant, "$1const $2 ");
  return "#include \"tools/mutation/mutant_switch.h\"\n#line 1\n" + planted;
}

}  // namespace viscera
