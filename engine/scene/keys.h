// The keys that a file may have, as a table: one source for validation, for default values and for
// the published schema.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/scene/json_file.h"

namespace viscera {

struct ObjectSpec;

enum class KeyType {
  kText,  ///< one line of text
  kName,  ///< [a-z0-9_]+
  kNumber,
  kInteger,
  kBoolean,
  kVector,     ///< three numbers
  kTexts,      ///< as many lines of text as least_items says
  kFile,       ///< a file that ReadContext::find_file knows; replaced by the path that it found
  kVolume,     ///< the same of ReadContext::find_volume
  kNeighbour,  ///< a file in the scene's folder (ReadContext::find_neighbour), there or not;
               ///< likewise
  kObject,
  kList,  ///< of objects
  kMap,   ///< names of the author's choice to objects
};

/// "only where the sibling `key` has one of these values".
struct Condition {
  std::string key;
  std::vector<std::string> values;
};

/// Whether it is a text and one of those words.
bool is_among(const std::vector<std::string>& words, const Json& value);

struct KeySpec {
  std::string name;  ///< with its unit: "radius_mm"
  KeyType type = KeyType::kText;
  std::string description;
  bool required = false;  ///< where it applies at all (see `beside`, `condition`)
  Json fallback;          ///< value where the key is absent; null: none
  double least = -std::numeric_limits<double>::infinity();  ///< of numbers and of components
  double greatest = std::numeric_limits<double>::infinity();
  bool below_greatest = false;         ///< `greatest` itself is refused
  std::vector<Json> choices;           ///< the only values; empty: any
  std::string vocabulary;              ///< a list of ReadContext that the text must be in, "tissue"
  std::string beside;                  ///< applies only where this sibling stands
  std::optional<Condition> condition;  ///< applies only where this holds
  std::shared_ptr<const ObjectSpec> object;  ///< of an object, list or map
  std::size_t least_items = 0, most_items = 100000;
  std::string unique;     ///< key of the list's objects that no two may share
  std::string ascending;  ///< key of the list's objects that must grow strictly

  KeySpec& needed() {
    required = true;
    return *this;
  }
  KeySpec& otherwise(Json value) {
    fallback = std::move(value);
    return *this;
  }
  KeySpec& between(double low, double high) {
    least = low;
    greatest = high;
    return *this;
  }
  KeySpec& from_to_below(double low, double high) {
    below_greatest = true;
    return between(low, high);
  }
  KeySpec& one_of(std::vector<Json> values) {
    choices = std::move(values);
    return *this;
  }
  KeySpec& known_as(std::string list) {
    vocabulary = std::move(list);
    return *this;
  }
  KeySpec& only_beside(std::string key) {
    beside = std::move(key);
    return *this;
  }
  KeySpec& only_where(std::string key, std::vector<std::string> values) {
    condition = Condition{std::move(key), std::move(values)};
    return *this;
  }
  KeySpec& items(std::size_t low, std::size_t high) {
    least_items = low;
    most_items = high;
    return *this;
  }
  KeySpec& unique_by(std::string key) {
    unique = std::move(key);
    return *this;
  }
  KeySpec& ascending_by(std::string key) {
    ascending = std::move(key);
    return *this;
  }
};

/// A mistake that shows only when several keys are seen together.
struct ObjectCheck {
  std::vector<std::string> needs;  ///< asked only when these stand there and are free of mistakes
  /// The path below the object and "found X, expected Y", or nothing.
  std::function<std::optional<std::pair<std::string, std::string>>(const Json&)> find;
  Json schema;  ///< the same in JSON Schema, where that can say it; else null
};

struct ObjectSpec {
  std::string description;
  std::vector<KeySpec> keys;
  std::vector<std::string> exactly_one_of;
  std::vector<ObjectCheck> checks;
  /// Keys of earlier versions, and what to write instead: a key, then why.
  std::vector<std::pair<std::string, std::string>> replaced = {};

  const KeySpec* find(std::string_view name) const;
};

KeySpec text(std::string name, std::string description);
KeySpec name_key(std::string description);
KeySpec number(std::string name, std::string description);
KeySpec integer(std::string name, std::string description);
KeySpec boolean(std::string name, std::string description);
KeySpec vector(std::string name, std::string description);
/// Exactly `count` texts.
KeySpec texts(std::string name, std::string description, std::size_t count);
KeySpec file_key(std::string name, std::string description);
KeySpec volume_key(std::string name, std::string description);
KeySpec neighbour_key(std::string name, std::string description);
KeySpec object(std::string name, std::string description, ObjectSpec spec);
KeySpec list(std::string name, std::string description, ObjectSpec spec);
KeySpec map(std::string name, std::string description, ObjectSpec spec);

/// Whether the key has a meaning beside its siblings; looks at fallbacks for absent ones.
bool applies(const KeySpec& key, const Json& siblings, const ObjectSpec& spec);

/// "only where recipe is \"sphere\" or \"hemisphere\""; "" for a key that always applies.
std::string where_applies(const KeySpec& key);

/// What a value of this key must be: "a number from 0.1 to 1000 [mm]".
std::string expected_value(const KeySpec& key);

/// JSON Schema (2020-12) of one object.
Json json_schema(const ObjectSpec& spec);

}  // namespace viscera
