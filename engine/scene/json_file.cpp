#include "engine/scene/json_file.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/scene/spelling.h"
#include "kernels/base/input_file.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

// Where a byte (counted from 1) stands, and what stands there.
class TextPlace {
 public:
  TextPlace(const std::string& text, std::size_t byte)
      : text_(text), index_(std::min(byte == 0 ? 0 : byte - 1, text.size())) {}

  bool at_end() const { return index_ >= text_.size(); }

  std::string line_and_column() const {
    const auto before = std::string_view(text_).substr(0, index_);
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    const std::size_t newline = before.rfind('\n');
    const std::size_t column = newline == std::string_view::npos ? index_ + 1 : index_ - newline;
    return std::to_string(line) + ":" + std::to_string(column);
  }

  // The whole word around the place: of NaN the parser has read only the N.
  std::string word() const {
    const auto is_word = [this](std::size_t i) {
      return std::isalnum(static_cast<unsigned char>(text_[i])) || text_[i] == '_' ||
             text_[i] == '.' || text_[i] == '+' || text_[i] == '-';
    };
    if (at_end() || !is_word(index_)) return {};
    std::size_t first = index_, last = index_;
    while (first > 0 && is_word(first - 1)) --first;
    while (last + 1 < text_.size() && is_word(last + 1)) ++last;
    return text_.substr(first, last - first + 1);
  }

 private:
  const std::string& text_;
  std::size_t index_;
};

std::string printable(std::string text) {
  constexpr std::size_t kMost = 40;
  for (char& c : text)
    if (c < 0x20 || c > 0x7e) c = '?';
  if (text.size() > kMost) text = text.substr(0, kMost) + "...";
  return text;
}

// Builds the value and keeps the path of keys, for the mistakes that syntax alone doesn't show.
class Builder : public nlohmann::json_sax<Json> {
 public:
  Builder(const std::string& text, std::string source) : text_(text), source_(std::move(source)) {}

  Json take() { return std::move(root_); }
  Error& error() { return error_; }

  bool null() override { return put(nullptr) != nullptr; }
  bool boolean(bool value) override { return put(value) != nullptr; }
  bool number_integer(number_integer_t value) override { return put(value) != nullptr; }
  bool number_unsigned(number_unsigned_t value) override { return put(value) != nullptr; }
  bool number_float(number_float_t value, const string_t&) override {
    return put(value) != nullptr;
  }
  bool string(string_t& value) override { return put(std::move(value)) != nullptr; }
  bool binary(binary_t&) override { return false; }

  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    Json& object = *open_.back();
    if (object.contains(name)) {
      error_.messages.push_back(source_ + ": " + path_to(name) +
                                ": found the key twice, expected it once");
    }
    if (object.size() >= kMaxJsonMembers) {
      error_.messages.push_back(source_ + ": " + path_to(name) + ": found more than " +
                                std::to_string(kMaxJsonMembers) +
                                " keys in one object, expected fewer");
      return false;
    }
    key_ = name;
    return true;
  }

  bool parse_error(std::size_t byte, const std::string& token,
                   const nlohmann::detail::exception& exception) override {
    const TextPlace place(text_, byte);
    const std::string word = place.word();
    std::string what = exception.what();
    std::string found = "\"" + printable(word.empty() ? token : word) + "\"";
    std::string expected;
    constexpr std::array<std::string_view, 8> kNotFinite = {"NaN", "nan",  "Infinity", "-Infinity",
                                                            "inf", "-inf", "Inf",      "-Inf"};
    if (exception.id == 406 ||
        std::find(kNotFinite.begin(), kNotFinite.end(), word) != kNotFinite.end()) {
      expected = "a finite number";
    } else if (place.at_end()) {
      found = "the end of the file";
      expected = "more: the file looks truncated";
    } else if (const auto at = what.find("; expected "); at != std::string::npos) {
      expected = what.substr(at + 11);
    } else {
      const auto reason = what.find(" - ");
      if (reason != std::string::npos) what = what.substr(reason + 3);
      expected = "valid JSON: " + printable(what.substr(0, what.find(';')));
    }
    error_.messages.push_back(source_ + ":" + place.line_and_column() + ": found " + found +
                              ", expected " + expected);
    return false;
  }

 private:
  Json* put(Json value) {
    if (open_.empty()) {
      root_ = std::move(value);
      return &root_;
    }
    Json& parent = *open_.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    return &(parent[key_] = std::move(value));
  }

  bool open(Json container) {
    if (open_.size() >= kMaxJsonDepth) {
      error_.messages.push_back(source_ + ": " + path_to("") + ": found nesting deeper than " +
                                std::to_string(kMaxJsonDepth) + ", expected less");
      return false;
    }
    if (!open_.empty()) {
      const Json& parent = *open_.back();
      path_.push_back(parent.is_array() ? std::to_string(parent.size()) : key_);
    }
    open_.push_back(put(std::move(container)));
    return true;
  }

  bool close() {
    open_.pop_back();
    if (!path_.empty()) path_.pop_back();
    return true;
  }

  std::string path_to(const std::string& name) const {
    std::string path;
    for (const std::string& step : path_) path += step + "/";
    return path + name;
  }

  const std::string& text_;
  std::string source_;
  Json root_;
  std::vector<Json*> open_;        // containers that are being filled, outermost first
  std::vector<std::string> path_;  // keys that lead to the innermost of them
  std::string key_;
  Error error_;
};

std::vector<std::string> files_beside(const fs::path& file) {
  std::vector<std::string> names;
  std::error_code ignored;
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == ".json") names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

Result<Json> parse_json(const std::string& text, const std::string& source) {
  if (text.find('\0') != std::string::npos)
    return failure(source + ": found binary data, expected JSON text");
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    return failure(source + ": found an empty file, expected a JSON object");
  Builder builder(text, source);
  constexpr bool kStrict = true, kIgnoreComments = true;
  const bool whole =
      Json::sax_parse(text, &builder, Json::input_format_t::json, kStrict, kIgnoreComments);
  if (!whole || !builder.error().messages.empty()) return std::unexpected(builder.error());
  return builder.take();
}

Result<Json> read_json(const fs::path& file) {
  const auto text = read_input(file, "a JSON file", kMaxJsonBytes);
  if (text) return parse_json(*text, file.string());
  std::error_code ignored;
  Error error = text.error();
  if (!fs::exists(file, ignored))
    error.messages.front() += did_you_mean(file.filename().string(), files_beside(file));
  return std::unexpected(error);
}

}  // namespace viscera
