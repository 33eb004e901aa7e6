#include "engine/io/ply_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kernels/base/printable.h"

namespace viscera {
namespace {

/// Of one thing, as the header has it. More elements or properties than this are no surface's.
constexpr std::size_t kMostElements = 64, kMostProperties = 256;
constexpr std::size_t kLongestShown = 60;

struct Property {
  std::string_view name;
  std::size_t bytes = 0;        // of a number
  std::size_t count_bytes = 0;  // of what says how many there are; 0: it is one number
};

struct Element {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  bool has_number(std::string_view property) const {
    return std::ranges::any_of(properties, [&](const Property& one) {
      return one.name == property && one.count_bytes == 0;
    });
  }
};

enum class Form { kText, kLittleEndian, kBigEndian };

struct Header {
  Form form = Form::kText;
  std::vector<Element> elements;
  std::size_t bytes = 0;
};

std::string shown(std::string_view text) {
  return shortened(printable(text.substr(0, 4 * kLongestShown)), kLongestShown);
}

bool is_space(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

/// The next word; empty: the end.
std::string_view next_word(std::string_view& text) {
  const auto begin = std::ranges::find_if_not(text, is_space);
  const auto end = std::find_if(begin, text.end(), is_space);
  const std::string_view word(begin, end);
  text = std::string_view(end, text.end());
  return word;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::string_view word = next_word(line); !word.empty() && words.size() < 6;
       word = next_word(line))
    words.push_back(word);
  return words;
}

std::optional<std::uint64_t> count_of(std::string_view word) {
  std::uint64_t count = 0;
  const auto [end, failed] = std::from_chars(word.data(), word.data() + word.size(), count);
  if (failed != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return count;
}

/// Of the format's types: bytes, and whether they are whole numbers. 0 bytes: it is none of them.
std::pair<std::size_t, bool> type_of(std::string_view word) {
  struct Type {
    std::string_view name, other;
    std::size_t bytes;
    bool whole;
  };
  static constexpr std::array<Type, 8> kTypes = {{{"char", "int8", 1, true},
                                                  {"uchar", "uint8", 1, true},
                                                  {"short", "int16", 2, true},
                                                  {"ushort", "uint16", 2, true},
                                                  {"int", "int32", 4, true},
                                                  {"uint", "uint32", 4, true},
                                                  {"float", "float32", 4, false},
                                                  {"double", "float64", 8, false}}};
  for (const Type& type : kTypes)
    if (word == type.name || word == type.other) return {type.bytes, type.whole};
  return {0, false};
}

std::optional<Property> property_of(std::span<const std::string_view> words) {
  Property property;
  if (words.size() == 3) {
    property.bytes = type_of(words[1]).first;
    property.name = words[2];
  } else if (words.size() == 5 && words[1] == "list") {
    const auto [count_bytes, counts] = type_of(words[2]);
    property.bytes = type_of(words[3]).first;
    property.name = words[4];
    property.count_bytes = counts ? count_bytes : 0;
    if (!counts) return std::nullopt;
  }
  if (property.bytes == 0) return std::nullopt;
  return property;
}

class HeaderReader {
 public:
  HeaderReader(std::string_view name, std::string_view bytes) : name_(name), left_(bytes) {}

  Result<Header> read() {
    const std::size_t all = left_.size();
    for (bool ended = false; !ended;) {
      const auto line = next_line();
      if (!line) return failure(at_line("the end of the file", "end_header"));
      const std::vector<std::string_view> words = words_of(*line);
      if (number_ == 1) {
        if (words.size() != 1 || words[0] != "ply") return refused(*line, "ply");
        continue;
      }
      if (words.empty()) return refused(*line, kLines);
      ended = words[0] == "end_header" && words.size() == 1;
      if (ended || words[0] == "comment" || words[0] == "obj_info") continue;
      if (auto taken = take(*line, words); !taken) return std::unexpected(taken.error());
    }
    if (!has_form_) return failure(std::string(name_) + ": found no format in the header");
    header_.bytes = all - left_.size();
    for (const Element& element : header_.elements)
      if (element.count > 0 && element.properties.empty())
        return failure(fmt::format("{}: found {} of the element {} without a property", name_,
                                   element.count, shown(element.name)));
    return std::move(header_);
  }

 private:
  static constexpr std::string_view kLines = "format, comment, element, property or end_header";

  std::optional<std::string_view> next_line() {
    const std::size_t end = left_.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    std::string_view line = left_.substr(0, end);
    left_.remove_prefix(end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    ++number_;
    return line;
  }
  std::string at_line(std::string_view found, std::string_view expected) const {
    return fmt::format("{}: found {} on line {} of the header, expected {}", name_, found, number_,
                       expected);
  }
  std::unexpected<Error> refused(std::string_view line, std::string_view expected) const {
    return failure(at_line(fmt::format("\"{}\"", shown(line)), expected));
  }

  Result<void> take(std::string_view line, const std::vector<std::string_view>& words) {
    if (words[0] == "format") {
      static constexpr std::array<std::string_view, 3> kForms = {"ascii", "binary_little_endian",
                                                                 "binary_big_endian"};
      const auto form = words.size() == 3 ? std::ranges::find(kForms, words[1]) : kForms.end();
      if (has_form_ || form == kForms.end() || words[2] != "1.0")
        return refused(line, "one format: ascii, binary_little_endian or binary_big_endian 1.0");
      header_.form = static_cast<Form>(form - kForms.begin());
      has_form_ = true;
      return {};
    }
    if (words[0] == "element") {
      const auto count = words.size() == 3 ? count_of(words[2]) : std::nullopt;
      if (!count) return refused(line, "element, a name and how many there are");
      if (header_.elements.size() == kMostElements)
        return refused(line, fmt::format("at most {} elements", kMostElements));
      header_.elements.push_back({words[1], *count, {}});
      return {};
    }
    if (words[0] != "property") return refused(line, kLines);
    const auto property = property_of(words);
    if (!property || header_.elements.empty())
      return refused(line, "property, a type and a name, or property list, two types and a name");
    std::vector<Property>& properties = header_.elements.back().properties;
    if (properties.size() == kMostProperties)
      return refused(line, fmt::format("at most {} properties", kMostProperties));
    properties.push_back(*property);
    return {};
  }

  std::string_view name_, left_;
  std::size_t number_ = 0;
  bool has_form_ = false;
  Header header_;
};

/// Behind the header: what says where the file ends too soon, or whose list has no length.
class Rows {
 public:
  Rows(std::string_view name, Form form, std::string_view bytes)
      : name_(name), form_(form), left_(bytes) {}

  Result<void> pass(const Element& element) {
    const bool even = form_ != Form::kText &&
                      std::ranges::all_of(element.properties,
                                          [](const Property& one) { return one.count_bytes == 0; });
    if (even) {
      std::uint64_t row = 0;
      for (const Property& property : element.properties) row += property.bytes;
      if (element.count > 0 && left_.size() / row < element.count)
        return ends(element, left_.size() / row);
      left_.remove_prefix(static_cast<std::size_t>(row * element.count));
      return {};
    }
    for (std::uint64_t row = 0; row < element.count; ++row)
      for (const Property& property : element.properties) {
        std::uint64_t numbers = 1;
        if (property.count_bytes > 0) {
          const auto count = next_count(property.count_bytes);
          if (!count) return ends(element, row);
          numbers = *count;
        }
        if (!skip(numbers, property.bytes)) return ends(element, row);
      }
    return {};
  }

 private:
  std::unexpected<Error> ends(const Element& element, std::uint64_t row) const {
    return failure(fmt::format(
        "{}: found {} whole rows of the element {}, expected the {} of its header: the file is "
        "truncated, or the length of a list is no number",
        name_, row, shown(element.name), element.count));
  }
  std::optional<std::uint64_t> next_count(std::size_t bytes) {
    if (form_ == Form::kText) return count_of(next_word(left_));
    if (left_.size() < bytes) return std::nullopt;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      const std::size_t at = form_ == Form::kBigEndian ? bytes - 1 - i : i;
      count |= std::uint64_t{static_cast<unsigned char>(left_[at])} << (8 * i);
    }
    left_.remove_prefix(bytes);
    return count;
  }
  bool skip(std::uint64_t numbers, std::size_t bytes) {
    if (form_ != Form::kText) {
      if (left_.size() / bytes < numbers) return false;
      left_.remove_prefix(static_cast<std::size_t>(numbers) * bytes);
      return true;
    }
    for (; numbers > 0; --numbers)
      if (next_word(left_).empty()) return false;
    return true;
  }

  std::string_view name_;
  Form form_;
  std::string_view left_;
};

}  // namespace

Result<void> check_ply(std::string_view name, std::string_view bytes) {
  const auto header = HeaderReader(name, bytes).read();
  if (!header) return std::unexpected(header.error());
  const auto vertex = std::ranges::find(header->elements, "vertex", &Element::name);
  for (const std::string_view axis : {"x", "y", "z"})
    if (vertex == header->elements.end() || !vertex->has_number(axis))
      return failure(fmt::format("{}: found no {} of vertices in the header", name, axis));
  Rows rows(name, header->form, bytes.substr(header->bytes));
  for (const Element& element : header->elements)
    if (auto passed = rows.pass(element); !passed) return passed;
  return {};
}

}  // namespace viscera
