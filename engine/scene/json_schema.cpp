// The published form of the table of keys.
#include <algorithm>
#include <cmath>

#include "engine/scene/keys.h"

namespace viscera {
namespace {

void add_range(const KeySpec& key, Json& schema) {
  const auto bound = [&key](double value) {
    return key.type == KeyType::kInteger ? Json(static_cast<std::int64_t>(value)) : Json(value);
  };
  if (std::isfinite(key.least)) schema["minimum"] = bound(key.least);
  if (std::isfinite(key.greatest))
    schema[key.below_greatest ? "exclusiveMaximum" : "maximum"] = bound(key.greatest);
}

void add_type(const KeySpec& key, Json& schema) {
  switch (key.type) {
    case KeyType::kText:
      schema["type"] = "string";
      schema["maxLength"] = 200;
      break;
    case KeyType::kName:
      schema["type"] = "string";
      schema["pattern"] = "^[a-z0-9_]{1,64}$";
      break;
    case KeyType::kNumber:
      schema["type"] = "number";
      add_range(key, schema);
      break;
    case KeyType::kInteger:
      schema["type"] = "integer";
      add_range(key, schema);
      break;
    case KeyType::kBoolean:
      schema["type"] = "boolean";
      break;
    case KeyType::kVector: {
      Json component = {{"type", "number"}};
      add_range(key, component);
      schema["type"] = "array";
      schema["items"] = component;
      schema["minItems"] = 3;
      schema["maxItems"] = 3;
      break;
    }
    case KeyType::kTexts:
      schema["type"] = "array";
      schema["items"] = {{"type", "string"}, {"maxLength", 200}};
      schema["minItems"] = key.least_items;
      schema["maxItems"] = key.most_items;
      break;
    case KeyType::kFile:
    case KeyType::kVolume:
    case KeyType::kNeighbour:
      schema["type"] = "string";
      schema["minLength"] = 1;
      break;
    case KeyType::kObject:
      schema.update(json_schema(*key.object));
      schema["description"] = key.description;
      break;
    case KeyType::kList:
      schema["type"] = "array";
      schema["items"] = json_schema(*key.object);
      if (key.least_items > 0) schema["minItems"] = key.least_items;
      schema["maxItems"] = key.most_items;
      break;
    case KeyType::kMap:
      schema["type"] = "object";
      schema["propertyNames"] = {{"pattern", "^[a-z0-9_]{1,64}$"}};
      schema["additionalProperties"] = json_schema(*key.object);
      break;
  }
}

Json key_schema(const KeySpec& key) {
  Json schema = {{"description", key.description}};
  add_type(key, schema);
  if (key.choices.size() == 1) schema["const"] = key.choices.front();
  if (key.choices.size() > 1) schema["enum"] = key.choices;
  if (!key.fallback.is_null()) schema["default"] = key.fallback;
  return schema;
}

// if the sibling has one of the values then the key may (or must) stand, else it must not.
Json conditional(const KeySpec& key, const ObjectSpec& spec) {
  const Condition& condition = *key.condition;
  const bool holds_by_default = is_among(condition.values, spec.find(condition.key)->fallback);
  Json schema;
  schema["if"]["properties"][condition.key]["enum"] = condition.values;
  if (!holds_by_default) schema["if"]["required"] = Json::array({condition.key});
  if (key.required) schema["then"]["required"] = Json::array({key.name});
  schema["else"]["properties"][key.name] = false;
  return schema;
}

}  // namespace

Json json_schema(const ObjectSpec& spec) {
  Json schema = {{"type", "object"}};
  if (!spec.description.empty()) schema["description"] = spec.description;
  schema["properties"] = Json::object();
  schema["additionalProperties"] = false;
  for (const KeySpec& key : spec.keys) {
    schema["properties"][key.name] = key_schema(key);
    if (key.condition) {
      schema["allOf"].push_back(conditional(key, spec));
    } else if (!key.beside.empty()) {
      schema["dependentRequired"][key.name].push_back(key.beside);
      if (key.required) schema["dependentRequired"][key.beside].push_back(key.name);
    } else if (key.required) {
      schema["required"].push_back(key.name);
    }
  }
  for (const std::string& alternative : spec.exactly_one_of)
    schema["oneOf"].push_back({{"required", Json::array({alternative})}});
  for (const ObjectCheck& check : spec.checks)
    if (!check.schema.is_null()) schema["allOf"].push_back(check.schema);
  return schema;
}

}  // namespace viscera
