#include "engine/scene/overrides.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "engine/scene/spelling.h"
#include "engine/scene/validate.h"

namespace viscera {
namespace {

std::vector<std::string> steps_of(const std::string& path) {
  std::vector<std::string> steps;
  std::size_t first = 0;
  while (first <= path.size()) {
    const std::size_t end = std::min(path.find('/', first), path.size());
    if (end > first) steps.push_back(path.substr(first, end - first));
    first = end + 1;
  }
  return steps;
}

std::optional<std::size_t> index_in(const Json& list, const std::string& step) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    const bool named = list[i].is_object() && list[i].contains("name") && list[i]["name"] == step;
    if (named) return i;
  }
  std::size_t index = 0;
  const auto [end, failed] = std::from_chars(step.data(), step.data() + step.size(), index);
  if (failed != std::errc() || end != step.data() + step.size() || index >= list.size())
    return std::nullopt;
  return index;
}

std::vector<std::string> names_in(const Json& list) {
  std::vector<std::string> names;
  for (const Json& item : list) {
    if (item.is_object() && item.contains("name") && item["name"].is_string())
      names.push_back(item["name"]);
  }
  return names;
}

/// Json takes any bytes as a text, and throws where it is to be written.
bool is_utf8(const std::string& text) {
  try {
    (void)Json(text).dump();
    return true;
  } catch (const Json::exception&) {
    return false;
  }
}

}  // namespace

Result<std::string> apply_override(Json& root, const std::string& path, const std::string& value) {
  const std::string option = "--set " + path + "=" + value + ": ";
  if (!is_utf8(path) || !is_utf8(value))
    return failure("--set: found bytes that are no text in UTF-8, expected KEY/PATH=VALUE");
  const std::vector<std::string> steps = steps_of(path);
  if (steps.empty()) return failure(option + "found no key, expected KEY/PATH=VALUE");

  Json* at = &root;
  std::string resolved;
  for (const std::string& step : steps) {
    if (!resolved.empty()) resolved += '/';
    if (at->is_array()) {
      const std::optional<std::size_t> index = index_in(*at, step);
      if (!index) {
        const std::vector<std::string> names = names_in(*at);
        return failure(option + "found \"" + step + "\", expected an index below " +
                       std::to_string(at->size()) +
                       (names.empty() ? "" : " or a name: " + joined(names)) +
                       did_you_mean(step, names));
      }
      at = &(*at)[*index];
      resolved += std::to_string(*index);
    } else if (at->is_object() || at->is_null()) {
      at = &(*at)[step];
      resolved += step;
    } else {
      return failure(option + "found " + describe(*at) + " before \"" + step +
                     "\", expected an object or a list");
    }
  }
  const Result<Json> parsed = parse_json(value, option);
  *at = parsed ? *parsed : Json(value);
  return resolved;
}

}  // namespace viscera
