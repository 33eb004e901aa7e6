#include "engine/gpu/twin_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace viscera {
namespace {

/// Types whose names differ, and those that both languages have.
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kTypes = {{
    {"float", "float"},
    {"double", "double"},
    {"int", "int"},
    {"std::int32_t", "int"},
    {"std::uint32_t", "uint"},
    {"Float4", "vec4"},
    {"Int4", "ivec4"},
    {"Eigen::Vector4f", "vec4"},
    {"Eigen::Matrix4f", "mat4"},
}};

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}
bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

struct Token {
  std::string_view text;  // empty: the end
  std::size_t at = 0;

  std::size_t end() const { return at + text.size(); }
  bool is_name() const { return !text.empty() && is_word(text[0]) && !is_digit(text[0]); }
  bool is_number() const { return !text.empty() && (is_digit(text[0]) || text[0] == '.'); }
};

/// What stands in the place of a stretch of the text.
struct Edit {
  std::size_t begin, end;
  std::string text;
};

class HeaderReader {
 public:
  explicit HeaderReader(const ShaderFile& header) : name_(header.name), text_(header.text) {}

  Result<ShaderFile> read() {
    split();
    while (more()) {
      if (is("namespace")) {
        open_namespace();
      } else if (is("}") && depth_ > 0) {
        --depth_;
        drop(next());
      } else if (is("struct")) {
        read_struct();
      } else if (is("enum")) {
        read_enum();
      } else if (is("inline") || is("constexpr")) {
        read_constant();
      } else if (is("static_assert")) {
        drop_statement();
      } else {
        refuse("a struct, an enum, a constexpr or a static_assert");
      }
    }
    if (!complaint_.empty()) return failure(complaint_);
    return ShaderFile{name_, edited()};
  }

 private:
  /// Comments stay where they are; directives go.
  void split() {
    for (std::size_t i = 0; i < text_.size();) {
      const std::string_view rest = std::string_view(text_).substr(i);
      if (std::isspace(static_cast<unsigned char>(rest[0])) != 0) {
        ++i;
      } else if (rest.starts_with("//")) {
        i = std::min(text_.find('\n', i), text_.size());
      } else if (rest.starts_with("/*")) {
        i = std::min(text_.find("*/", i), text_.size() - 2) + 2;
      } else if (rest.starts_with("#")) {
        const std::size_t end = std::min(text_.find('\n', i), text_.size());
        if (!rest.starts_with("#pragma once") && !rest.starts_with("#include")) {
          tokens_.push_back({rest.substr(0, end - i), i});  // nobody expects it
        } else {
          drop(i, end);
        }
        i = end;
      } else {
        tokens_.push_back({rest.substr(0, length_of(rest)), i});
        i = tokens_.back().end();
      }
    }
  }

  static std::size_t length_of(std::string_view rest) {
    std::size_t n = 1;
    if (is_digit(rest[0]) || (rest[0] == '.' && rest.size() > 1 && is_digit(rest[1]))) {
      const auto goes_on = [&] {
        const bool sign = rest[n] == '+' || rest[n] == '-';
        const bool exponent = sign && (rest[n - 1] == 'e' || rest[n - 1] == 'p');
        return is_word(rest[n]) || rest[n] == '.' || rest[n] == '\'' || exponent;
      };
      while (n < rest.size() && goes_on()) ++n;
    } else if (is_word(rest[0])) {
      while (n < rest.size() && (is_word(rest[n]) || rest.substr(n).starts_with("::") ||
                                 (rest[n] == ':' && rest[n - 1] == ':'))) {
        ++n;
      }
    }
    return n;
  }

  bool more() const { return complaint_.empty() && now_ < tokens_.size(); }
  Token peek(std::size_t ahead = 0) const {
    if (!complaint_.empty() || now_ + ahead >= tokens_.size()) return {{}, text_.size()};
    return tokens_[now_ + ahead];
  }
  bool is(std::string_view text) const { return peek().text == text; }
  Token next() {
    const Token token = peek();
    if (more()) ++now_;
    return token;
  }
  bool take(std::string_view text) {
    if (!is(text)) return false;
    ++now_;
    return true;
  }
  Token expect(std::string_view text) {
    if (!is(text)) refuse("'" + std::string(text) + "'");
    return next();
  }
  Token name() {
    if (!peek().is_name()) refuse("a name");
    return next();
  }
  /// The first complaint ends the reading.
  void refuse(const std::string& expected) {
    if (!complaint_.empty()) return;
    const Token token = peek();
    const auto line =
        1 + std::count(text_.begin(), text_.begin() + static_cast<long>(token.at), '\n');
    const std::string found = token.text.empty() ? "the end" : "'" + std::string(token.text) + "'";
    complaint_ = name_ + ":" + std::to_string(line) + ": found " + found + ", expected " + expected;
  }

  void insert(std::size_t at, std::string text) { edits_.push_back({at, at, std::move(text)}); }
  void drop(std::size_t begin, std::size_t end) {
    const auto lines = std::count(text_.begin() + static_cast<long>(begin),
                                  text_.begin() + static_cast<long>(end), '\n');
    edits_.push_back({begin, end, std::string(static_cast<std::size_t>(lines), '\n')});
  }
  void drop(const Token& token) { drop(token.at, token.end()); }
  /// Up to one of the characters outside of any brackets; it stays to be read.
  void skip_to(std::string_view ends) {
    int inside = 0;
    for (; more(); ++now_) {
      const char c = peek().text[0];
      if (inside == 0 && ends.find(c) != std::string_view::npos) return;
      inside += c == '(' || c == '{' || c == '[' ? 1 : c == ')' || c == '}' || c == ']' ? -1 : 0;
    }
    refuse("'" + std::string(ends.substr(0, 1)) + "'");
  }
  void drop_statement() {
    const std::size_t begin = peek().at;
    skip_to(";");
    drop(begin, expect(";").end());
  }

  void drop_function() {
    const std::size_t begin = peek().at;
    skip_to("{");
    next();
    skip_to("}");
    drop(begin, expect("}").end());
  }

  void open_namespace() {
    const std::size_t begin = next().at;
    name();
    drop(begin, expect("{").end());
    ++depth_;
  }

  std::string type() {
    const std::string_view found = peek().text;
    for (const auto& [cpp, glsl] : kTypes) {
      if (found == cpp) return ++now_, std::string(glsl);
    }
    if (enums_.contains(found)) return ++now_, "uint";
    const bool own = peek().is_name() && std::isupper(static_cast<unsigned char>(found[0])) != 0 &&
                     found.find(':') == std::string_view::npos;
    if (!own) refuse("a type that GLSL has too");
    return std::string(next().text);
  }

  void read_struct() {
    next();
    if (is("alignas")) {
      const std::size_t begin = next().at;
      expect("("), next();
      drop(begin, expect(")").end());
    }
    name();
    expect("{");
    while (more() && !is("}")) read_member();
    expect("}"), expect(";");
  }

  void read_member() {
    if (is("bool") && peek(1).text == "operator") return drop_statement();
    if (is("static")) return drop_function();
    const std::size_t begin = peek().at;
    std::string extent;
    if (take("std::array")) {
      expect("<");
      const std::string element = type();
      const std::size_t from = expect(",").end();
      while (more() && !is(">")) next();
      const Token close = expect(">");
      edits_.push_back({begin, close.end(), element});
      extent = "[" + text_.substr(from, close.at - from) + "]";
    } else {
      std::string glsl = type();
      edits_.push_back({begin, last_end(), std::move(glsl)});
    }
    do {
      insert(name().end(), extent);
      while (take("[")) skip_to("]"), expect("]");
      if (is("=") || is("{")) {
        const std::size_t from = peek().at;
        skip_to(",;");
        drop(from, last_end());
      }
    } while (take(","));
    expect(";");
  }

  void read_enum() {
    const std::size_t begin = next().at;
    if (!take("class")) take("struct");
    if (!is(":") && !is("{")) enums_.insert(name().text);
    if (take(":")) name();
    drop(begin, expect("{").end());
    std::string before;
    while (more() && !is("}")) {
      const Token enumerator = name();
      insert(enumerator.at, "const uint ");
      if (take("=")) {
        insert(peek().at, "uint(");
        expression(",}");
        insert(last_end(), ")");
      } else {
        insert(enumerator.end(), before.empty() ? " = 0u" : " = " + before + " + 1u");
      }
      insert(last_end(), ";");
      before = enumerator.text;
      if (is(",")) drop(next());
    }
    drop(expect("}"));
    drop(expect(";"));
  }

  void read_constant() {
    const std::size_t begin = peek().at;
    take("inline");
    expect("constexpr");
    const bool is_double = is("double");
    std::string glsl = take("std::size_t") ? "uint" : type();
    edits_.push_back({begin, last_end(), "const " + glsl});
    name();
    expect("=");
    expression(";", is_double);
    expect(";");
  }

  /// Numbers, names, brackets and operators up to one of `ends`: the same in both languages, but
  /// that numbers without a suffix are of single precision in GLSL.
  void expression(std::string_view ends, bool is_double = false) {
    if (peek().text.empty() || ends.find(peek().text[0]) != std::string_view::npos) {
      return refuse("a value");
    }
    const std::size_t first = now_;
    skip_to(ends);
    const std::size_t last = now_;
    for (now_ = first; more() && now_ < last; ++now_) {
      const Token token = peek();
      const bool hexadecimal = token.text.starts_with("0x");
      const bool split = token.text.find('\'') != std::string_view::npos;
      if (token.text.find("::") != std::string_view::npos || token.text == "static_cast" ||
          (token.is_number() &&
           (split || (hexadecimal && token.text.find('p') != token.text.npos)))) {
        return refuse("a value as GLSL writes it");
      }
      const bool real = !hexadecimal && token.text.find_first_of(".e") != token.text.npos;
      if (is_double && token.is_number() && real) insert(token.end(), "lf");
    }
  }

  std::size_t last_end() const { return now_ > 0 ? tokens_[now_ - 1].end() : 0; }

  std::string edited() {
    std::ranges::stable_sort(edits_, {}, &Edit::begin);
    std::string text;
    std::size_t at = 0;
    for (const Edit& edit : edits_) {
      text.append(text_, at, edit.begin - at).append(edit.text);
      at = edit.end;
    }
    return text.append(text_, at);
  }

  const std::string& name_;
  const std::string& text_;
  std::vector<Token> tokens_;
  std::size_t now_ = 0;
  int depth_ = 0;
  std::set<std::string_view> enums_;
  std::vector<Edit> edits_;
  std::string complaint_;
};

}  // namespace

Result<ShaderFile> glsl_of_header(const ShaderFile& header) {
  return HeaderReader(header).read();
}

}  // namespace viscera
