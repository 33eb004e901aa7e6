#include "engine/scene/validate.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "engine/scene/spelling.h"

namespace viscera {
namespace {

constexpr std::size_t kLongestName = 64;
constexpr std::size_t kLongestText = 200;
constexpr double kGreatestWhole = 9007199254740992.0;  // 2^53: every whole double below is exact

bool in_range(const KeySpec& key, const Json& value) {
  const double x = value.get<double>();
  return std::isfinite(x) && x >= key.least &&
         (key.below_greatest ? x < key.greatest : x <= key.greatest);
}

class Validator {
 public:
  explicit Validator(const ReadContext& context) : context_(context) {}

  std::vector<Mistake> take() { return std::move(mistakes_); }

  void check_object(Json& value, const ObjectSpec& spec, const std::string& path) {
    if (!value.is_object()) {
      add(path, "found " + describe(value) + ", expected an object");
      return;
    }
    std::set<std::string> meant;  // keys that a misspelt one stands for: not reported as missing
    for (const auto& [name, ignored] : value.items())
      if (!spec.find(name)) meant.insert(unknown_key(name, value, spec, path));
    const bool chosen = check_choice(value, spec, path, meant);

    std::set<std::string> faulty;
    for (const KeySpec& key : spec.keys) {
      const std::size_t before = mistakes_.size();
      // Where that which a key depends on is in doubt, whether it may or must stand can't be
      // judged.
      const bool judged = chosen && !(key.condition && faulty.contains(key.condition->key));
      check_key(key, value, spec, path, judged, meant.contains(key.name));
      if (mistakes_.size() > before) faulty.insert(key.name);
    }
    for (const ObjectCheck& check : spec.checks) run(check, value, path, faulty);
  }

 private:
  void add(std::string path, std::string text) {
    mistakes_.push_back({std::move(path), std::move(text)});
  }

  static std::string below(const std::string& path, const std::string& name) {
    return path.empty() || name.empty() ? path + name : path + "/" + name;
  }

  // Returns the key that was meant, or "".
  std::string unknown_key(const std::string& name, const Json& object, const ObjectSpec& spec,
                          const std::string& path) {
    for (const auto& [old, instead] : spec.replaced) {
      if (name != old) continue;
      add(below(path, name), "found a key of earlier versions, expected " + instead);
      return instead.substr(0, instead.find_first_of(" ,:"));
    }
    std::vector<std::string> known;
    for (const KeySpec& key : spec.keys)
      if (applies(key, object, spec)) known.push_back(key.name);
    const UnitSplit found = split_unit(name);
    for (const std::string& candidate : known) {
      const UnitSplit wanted = split_unit(candidate);
      if (found.stem != wanted.stem || found.unit == wanted.unit) continue;
      const auto unit = [](const std::string& u) {
        return u.empty() ? "no unit" : "the unit " + u;
      };
      add(below(path, name), "found " + unit(found.unit) + ", expected " + unit(wanted.unit) +
                                 " (did you mean \"" + candidate + "\"?)");
      return candidate;
    }
    const std::string nearest = nearest_spelling(name, known);
    add(below(path, name),
        "found an unknown key, expected one of " + joined(known) + did_you_mean(name, known));
    return nearest;
  }

  // Whether the object says which of its alternatives it is (or nearly so).
  bool check_choice(const Json& object, const ObjectSpec& spec, const std::string& path,
                    const std::set<std::string>& meant) {
    if (spec.exactly_one_of.empty()) return true;
    std::string found;
    int count = 0;
    for (const std::string& name : spec.exactly_one_of) {
      if (meant.contains(name)) return false;
      if (!object.contains(name)) continue;
      found += (count++ ? " and " : "") + name;
    }
    if (count == 1) return true;
    add(path, "found " + (count ? found : "none of them") + ", expected exactly one of " +
                  joined(spec.exactly_one_of));
    return false;
  }

  void check_key(const KeySpec& key, Json& object, const ObjectSpec& spec, const std::string& path,
                 bool judged, bool meant) {
    const bool present = object.contains(key.name);
    const std::string here = below(path, key.name);
    if (!applies(key, object, spec)) {
      if (present && judged)
        add(here,
            "found " + describe(object[key.name]) + ", expected this key " + where_applies(key));
      return;
    }
    if (!present && key.fallback.is_null()) {
      if (key.required && judged && !meant) add(here, "found nothing, expected " + wanted(key));
      return;
    }
    if (!present) object[key.name] = key.fallback;
    check_value(key, object[key.name], here);
  }

  std::string wanted(const KeySpec& key) const {
    const auto list = context_.vocabularies.find(key.vocabulary);
    std::string words = expected_value(key);
    if (list != context_.vocabularies.end()) words += ": one of " + joined(list->second);
    return words;
  }

  std::string why_left_out(const KeySpec& key, const std::string& name) const {
    const auto list = context_.left_out.find(key.vocabulary);
    if (list == context_.left_out.end()) return {};
    const auto at = list->second.find(name);
    return at == list->second.end() ? std::string() : at->second;
  }

  void refuse(const KeySpec& key, const Json& value, const std::string& path) {
    std::vector<std::string> candidates;
    for (const Json& choice : key.choices)
      if (choice.is_string()) candidates.push_back(choice);
    const auto list = context_.vocabularies.find(key.vocabulary);
    if (list != context_.vocabularies.end()) candidates = list->second;
    std::string text = "found " + describe(value) + ", expected " + wanted(key);
    if (value.is_string()) {
      const std::string why = why_left_out(key, value.get<std::string>());
      text += why.empty() ? did_you_mean(value.get<std::string>(), candidates) : ": " + why;
    }
    add(path, std::move(text));
  }

  bool acceptable(const KeySpec& key, Json& value) const {
    if (!key.choices.empty())
      return std::find(key.choices.begin(), key.choices.end(), value) != key.choices.end();
    switch (key.type) {
      case KeyType::kText:
        return value.is_string() && value.get<std::string>().size() <= kLongestText;
      case KeyType::kName:
        return value.is_string() && is_name(value);
      case KeyType::kNumber:
        return value.is_number() && in_range(key, value);
      case KeyType::kInteger:
        if (!value.is_number()) return false;
        if (value.is_number_float()) {  // 3.0 is a whole number, too
          const double x = value;
          if (x != std::floor(x) || std::abs(x) > kGreatestWhole) return false;
          value = static_cast<std::int64_t>(x);
        }
        return in_range(key, value);
      case KeyType::kBoolean:
        return value.is_boolean();
      case KeyType::kVector:
        return value.is_array() && value.size() == 3 &&
               std::all_of(value.begin(), value.end(), [&key](const Json& component) {
                 return component.is_number() && in_range(key, component);
               });
      case KeyType::kTexts:
        return value.is_array() && value.size() >= key.least_items &&
               value.size() <= key.most_items &&
               std::all_of(value.begin(), value.end(), [](const Json& item) {
                 return item.is_string() && item.get<std::string>().size() <= kLongestText;
               });
      case KeyType::kFile:
      case KeyType::kVolume:
      case KeyType::kNeighbour:
        return value.is_string() && !value.get<std::string>().empty();
      case KeyType::kObject:
      case KeyType::kMap:
        return value.is_object();
      case KeyType::kList:
        return value.is_array() && value.size() >= key.least_items &&
               value.size() <= key.most_items;
    }
    return false;
  }

  void check_value(const KeySpec& key, Json& value, const std::string& path) {
    if (!acceptable(key, value)) {
      refuse(key, value, path);
      return;
    }
    if (key.type == KeyType::kTexts)
      check_texts(key, value, path);
    else if (!is_known(key, value))
      refuse(key, value, path);
    if (key.type == KeyType::kObject) check_object(value, *key.object, path);
    if (key.type == KeyType::kMap) check_map(key, value, path);
    if (key.type == KeyType::kList) check_list(key, value, path);
    if (key.type == KeyType::kFile) find(context_.find_file, value, path);
    if (key.type == KeyType::kVolume) find(context_.find_volume, value, path);
    if (key.type == KeyType::kNeighbour) find(context_.find_neighbour, value, path);
  }

  void find(const ReadContext::Find& where, Json& value, const std::string& path) {
    if (!where) return;
    const Result<std::string> found = where(value);
    if (found)
      value = *found;
    else
      add(path, found.error().text());
  }

  bool is_known(const KeySpec& key, const Json& value) const {
    const auto list = context_.vocabularies.find(key.vocabulary);
    return list == context_.vocabularies.end() || is_among(list->second, value);
  }

  void check_texts(const KeySpec& key, const Json& value, const std::string& path) {
    KeySpec one = key;
    one.type = KeyType::kText;
    for (std::size_t i = 0; i < value.size(); ++i)
      if (!is_known(key, value[i])) refuse(one, value[i], below(path, std::to_string(i)));
  }

  void check_map(const KeySpec& key, Json& value, const std::string& path) {
    for (auto& [name, item] : value.items()) {
      if (!is_name(name))
        add(below(path, name), "found this key, expected a name of a-z, 0-9 and _");
      check_object(item, *key.object, below(path, name));
    }
  }

  void check_list(const KeySpec& key, Json& value, const std::string& path) {
    std::map<std::string, std::size_t> seen;
    const Json* previous = nullptr;
    for (std::size_t i = 0; i < value.size(); ++i) {
      Json& item = value[i];
      const std::string here = below(path, std::to_string(i));
      check_object(item, *key.object, here);
      if (!item.is_object()) continue;
      if (!key.unique.empty() && item.contains(key.unique) && item[key.unique].is_string()) {
        const auto [first, is_new] = seen.emplace(item[key.unique], i);
        if (!is_new)
          add(below(here, key.unique), "found " + describe(item[key.unique]) +
                                           " again, expected another than that of " +
                                           below(path, std::to_string(first->second)));
      }
      if (!key.ascending.empty() && item.contains(key.ascending) &&
          item[key.ascending].is_number()) {
        const Json& current = item[key.ascending];
        if (previous && current.get<double>() <= previous->get<double>())
          add(below(here, key.ascending), "found " + describe(current) + " after " +
                                              describe(*previous) +
                                              ", expected values that ascend");
        previous = &current;
      }
    }
  }

  void run(const ObjectCheck& check, const Json& object, const std::string& path,
           const std::set<std::string>& faulty) {
    for (const std::string& name : check.needs)
      if (!object.contains(name) || faulty.contains(name)) return;
    if (auto mistake = check.find(object)) add(below(path, mistake->first), mistake->second);
  }

  const ReadContext& context_;
  std::vector<Mistake> mistakes_;
};

}  // namespace

bool is_name(const std::string& text) {
  return !text.empty() && text.size() <= kLongestName &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
         });
}

std::string describe(const Json& value) {
  constexpr std::size_t kMost = 60;
  const auto shortened = [](std::string words) {
    return words.size() > kMost ? words.substr(0, kMost) + "..." : words;
  };
  if (value.is_null()) return "null";
  if (value.is_string()) return "the text \"" + shortened(value.get<std::string>()) + "\"";
  if (value.is_array()) {
    const bool flat = std::none_of(value.begin(), value.end(),
                                   [](const Json& item) { return item.is_structured(); });
    return flat && value.size() <= 4 ? shortened(value.dump())
                                     : "an array of " + std::to_string(value.size());
  }
  if (value.is_object()) return "an object";
  return shortened(value.dump());
}

std::vector<Mistake> validate(Json& root, const ObjectSpec& spec, const ReadContext& context) {
  Validator validator(context);
  validator.check_object(root, spec, "");
  return validator.take();
}

}  // namespace viscera
