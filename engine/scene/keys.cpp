#include "engine/scene/keys.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/scene/spelling.h"

namespace viscera {
namespace {

KeySpec key(std::string name, KeyType type, std::string description) {
  KeySpec spec;
  spec.name = std::move(name);
  spec.type = type;
  spec.description = std::move(description);
  return spec;
}

KeySpec nested(std::string name, KeyType type, std::string description, ObjectSpec object) {
  KeySpec spec = key(std::move(name), type, std::move(description));
  spec.object = std::make_shared<const ObjectSpec>(std::move(object));
  return spec;
}

std::string digits(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.15g", value);
  return buffer;
}

std::string range(const KeySpec& key) {
  std::string words;
  if (std::isfinite(key.least)) words += " from " + digits(key.least);
  if (std::isfinite(key.greatest))
    words += (key.below_greatest ? " to below " : " to ") + digits(key.greatest);
  const std::string unit = split_unit(key.name).unit;
  if (!unit.empty()) words += " [" + unit + "]";
  return words;
}

std::string alternatives(const std::vector<Json>& values) {
  std::string words;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) words += i + 1 == values.size() ? " or " : ", ";
    words += values[i].dump();
  }
  return words;
}

}  // namespace

KeySpec text(std::string name, std::string description) {
  return key(std::move(name), KeyType::kText, std::move(description));
}
KeySpec name_key(std::string description) {
  return key("name", KeyType::kName, std::move(description)).needed();
}
KeySpec number(std::string name, std::string description) {
  return key(std::move(name), KeyType::kNumber, std::move(description));
}
KeySpec integer(std::string name, std::string description) {
  return key(std::move(name), KeyType::kInteger, std::move(description));
}
KeySpec boolean(std::string name, std::string description) {
  return key(std::move(name), KeyType::kBoolean, std::move(description));
}
KeySpec vector(std::string name, std::string description) {
  return key(std::move(name), KeyType::kVector, std::move(description));
}
KeySpec texts(std::string name, std::string description, std::size_t count) {
  return key(std::move(name), KeyType::kTexts, std::move(description)).items(count, count);
}
KeySpec file_key(std::string name, std::string description) {
  return key(std::move(name), KeyType::kFile, std::move(description));
}
KeySpec volume_key(std::string name, std::string description) {
  return key(std::move(name), KeyType::kVolume, std::move(description));
}
KeySpec neighbour_key(std::string name, std::string description) {
  return key(std::move(name), KeyType::kNeighbour, std::move(description));
}
KeySpec object(std::string name, std::string description, ObjectSpec spec) {
  return nested(std::move(name), KeyType::kObject, std::move(description), std::move(spec));
}
KeySpec list(std::string name, std::string description, ObjectSpec spec) {
  return nested(std::move(name), KeyType::kList, std::move(description), std::move(spec));
}
KeySpec map(std::string name, std::string description, ObjectSpec spec) {
  return nested(std::move(name), KeyType::kMap, std::move(description), std::move(spec));
}

const KeySpec* ObjectSpec::find(std::string_view name) const {
  const auto at = std::find_if(keys.begin(), keys.end(),
                               [name](const KeySpec& key) { return key.name == name; });
  return at == keys.end() ? nullptr : &*at;
}

bool is_among(const std::vector<std::string>& words, const Json& value) {
  return value.is_string() &&
         std::find(words.begin(), words.end(), value.get_ref<const std::string&>()) != words.end();
}

bool applies(const KeySpec& key, const Json& siblings, const ObjectSpec& spec) {
  if (!key.beside.empty() && !siblings.contains(key.beside)) return false;
  if (!key.condition) return true;
  const auto at = siblings.find(key.condition->key);
  const KeySpec* sibling = spec.find(key.condition->key);
  return is_among(key.condition->values, at != siblings.end() ? *at : sibling->fallback);
}

std::string where_applies(const KeySpec& key) {
  if (key.condition) {
    return "only where " + key.condition->key + " is " +
           alternatives({key.condition->values.begin(), key.condition->values.end()});
  }
  return key.beside.empty() ? std::string() : "only beside " + key.beside;
}

std::string expected_value(const KeySpec& key) {
  if (!key.choices.empty())
    return alternatives(key.choices) + (key.choices.size() > 1 ? "" : " (the only value)");
  if (key.type == KeyType::kTexts)
    return "an array of " + std::to_string(key.least_items) +
           (key.vocabulary.empty() ? " texts" : " names of " + key.vocabulary + "s");
  if (!key.vocabulary.empty())
    return (key.vocabulary.starts_with('o') ? "the name of an " : "the name of a ") +
           key.vocabulary;
  switch (key.type) {
    case KeyType::kText:
      return "text of at most 200 characters";
    case KeyType::kName:
      return "a name of a-z, 0-9 and _";
    case KeyType::kNumber:
      return "a number" + range(key);
    case KeyType::kInteger:
      return "a whole number" + range(key);
    case KeyType::kBoolean:
      return "true or false";
    case KeyType::kVector:
      return "an array of three numbers" + range(key);
    case KeyType::kFile:
      return "the name of a geometry file";
    case KeyType::kVolume:
      return "the name of a label map's file";
    case KeyType::kNeighbour:
      return "the name of a file in the scene's folder";
    case KeyType::kObject:
    case KeyType::kMap:
      return "an object";
    case KeyType::kTexts:
    case KeyType::kList:
      break;
  }
  const std::string most = std::to_string(key.most_items) + " objects";
  if (key.least_items > 0) return "an array of " + std::to_string(key.least_items) + " to " + most;
  return "an array of at most " + most;
}

}  // namespace viscera
