// Parts of a prepared organ as the cache keeps them: arrays by name, and back.
#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "engine/io/response_cache.h"
#include "kernels/paff/elastic_region.h"

namespace viscera {

using CacheArrays = std::map<std::string, CacheData::Array>;

std::vector<double> flat(std::span<const Vec3> vectors);
std::vector<Vec3> vectors(std::span<const double> numbers);

/// Takes arrays out, each under `prefix` and its name; knows whether all were there.
class TakenArrays {
 public:
  TakenArrays(CacheArrays& arrays, std::string prefix)
      : arrays_(arrays), prefix_(std::move(prefix)) {}
  template <class Into>
  void take(const std::string& name, Into& into) {
    const auto found = arrays_.find(prefix_ + name);
    auto* values = found == arrays_.end() ? nullptr : std::get_if<Into>(&found->second);
    if (values) into = std::move(*values);
    whole_ = whole_ && values;
  }
  /// Where it isn't there, `into` stays as it was.
  template <class Into>
  void take_if_there(const std::string& name, Into& into) {
    if (arrays_.contains(prefix_ + name)) take(name, into);
  }
  void expect(bool holds) { whole_ = whole_ && holds; }
  bool whole() const { return whole_; }

 private:
  CacheArrays& arrays_;
  std::string prefix_;
  bool whole_ = true;
};

/// What every region has: moduli, nodes, and its points' weights, fields and cells.
void keep_points(const ElasticRegion& region, const std::string& prefix, CacheArrays& arrays);
/// Whether they fit each other is the caller's to check; vectors come whole or not at all.
void take_points(TakenArrays& arrays, ElasticRegion& region);

}  // namespace viscera
