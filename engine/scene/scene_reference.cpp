#include "engine/scene/scene_reference.h"

#include "engine/scene/scene_keys.h"

namespace viscera {
namespace {

constexpr const char* kHead =
    "# Scene reference\n"
    "\n"
    "Every key that a scene file may have. This page is made from the table that the program "
    "checks\n"
    "scenes against. To change it, change the table (engine/scene/scene_keys.cpp, or the keys of "
    "a\n"
    "feature in engine/features), then run the test SceneReference with VISCERA_UPDATE_SCHEMA=1.\n"
    "[guide.md](guide.md) shows how scenes are written.\n"
    "\n"
    "A scene is JSON with comments. Every quantity has its unit at the end of its key. x goes to "
    "the\n"
    "patient's left, y to the head, z up. Headings are paths as `--set` takes them: NAME stands "
    "for a\n"
    "name in the list, N for a number from 0.\n";

std::string code(const std::string& text) {
  return "`" + text + "`";
}

/// Text that ends no cell of a table.
std::string cell(const std::string& text) {
  std::string escaped;
  for (const char letter : text) {
    if (letter == '|') escaped += '\\';
    escaped += letter == '\n' ? ' ' : letter;
  }
  return escaped;
}

std::string anchor(const std::string& path) {
  std::string name = "scene";
  for (const char letter : "/" + path) name += letter == '/' ? '-' : letter;
  return path.empty() ? "scene" : name;
}

bool nests(const KeySpec& key) {
  return key.object != nullptr;
}

/// Path of the object, or of one in the list or map.
std::string path_below(const std::string& path, const KeySpec& key) {
  std::string below = path.empty() ? key.name : path + "/" + key.name;
  if (key.type == KeyType::kMap || (key.type == KeyType::kList && key.unique == "name"))
    below += "/NAME";
  else if (key.type == KeyType::kList)
    below += "/N";
  return below;
}

std::string meaning(const KeySpec& key) {
  std::string words = key.description;
  std::string where = where_applies(key);
  if (where.empty()) return words;
  where[0] = 'O';  // "only where ...", as a sentence
  return words + (words.empty() ? "" : " ") + where + ".";
}

std::string expected(const KeySpec& key, const std::string& below) {
  std::string words = expected_value(key);
  if (nests(key)) words = "[" + words + "](#" + anchor(below) + ")";
  if (!key.unique.empty()) words += ", no two with the same " + code(key.unique);
  if (!key.ascending.empty()) words += ", " + code(key.ascending) + " ascending";
  return words;
}

std::string fallback(const KeySpec& key) {
  if (key.required) return where_applies(key).empty() ? "needed" : "needed there";
  if (key.fallback.is_null()) return "none";
  if (key.fallback.is_object() && key.fallback.empty()) return "the defaults of its keys";
  return code(key.fallback.dump());
}

std::string listed(const std::vector<std::string>& keys) {
  std::string words;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (i > 0) words += i + 1 == keys.size() ? " and " : ", ";
    words += code(keys[i]);
  }
  return words;
}

void add_section(const ObjectSpec& spec, const std::string& path, int depth, std::string& text) {
  text += "\n<a id=\"" + anchor(path) + "\"></a>\n\n";
  text += (depth < 2 ? "## " : "### ") + (path.empty() ? "The scene" : code(path)) + "\n\n";
  if (!spec.description.empty()) text += spec.description + "\n\n";
  if (!spec.exactly_one_of.empty())
    text += "Exactly one of " + listed(spec.exactly_one_of) + ".\n\n";
  text += "| key | meaning | expected | default |\n| --- | --- | --- | --- |\n";
  for (const KeySpec& key : spec.keys)
    text += "| " + code(key.name) + " | " + cell(meaning(key)) + " | " +
            cell(expected(key, path_below(path, key))) + " | " + cell(fallback(key)) + " |\n";
  for (const KeySpec& key : spec.keys)
    if (nests(key)) add_section(*key.object, path_below(path, key), depth + 1, text);
}

}  // namespace

std::string scene_reference(const std::vector<FeatureKeys>& features) {
  std::string text = kHead;
  add_section(scene_keys(features), "", 0, text);
  return text;
}

}  // namespace viscera
