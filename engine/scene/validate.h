// Checks a value against the table of keys and fills in what the author left out.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine/scene/keys.h"

namespace viscera {

/// What a table of keys can't know by itself.
struct ReadContext {
  std::map<std::string, std::vector<std::string>> vocabularies;  ///< an absent one isn't checked
  using Find = std::function<Result<std::string>(const std::string&)>;
  Find find_file, find_volume, find_neighbour;
  /// By list: names that this build lacks, and why; said where one is found.
  std::map<std::string, std::map<std::string, std::string>> left_out;
};

struct Mistake {
  std::string path;  ///< "organs/0/geometry/radius_mm"
  std::string text;  ///< "found -3, expected a number from 0.1 to 1000 [mm]"
};

/// Every mistake, in the order of the file. Afterwards `root` holds a value for each key that
/// applies and has a fallback, and found paths in the place of file names.
std::vector<Mistake> validate(Json& root, const ObjectSpec& spec, const ReadContext& context);

/// Whether a key of type kName takes it.
bool is_name(const std::string& text);

/// How a value reads in a message: `-3`, `the text "abc"`, `an array of 2`.
std::string describe(const Json& value);

}  // namespace viscera
