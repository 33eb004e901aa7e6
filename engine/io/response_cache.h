// The cache of prepared organs: what took minutes to compute, one file a key.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "engine/io/cache_file.h"
#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"
#include "kernels/points/cloud.h"

namespace viscera {

/// Everything that preparing one organ gives.
struct PreparedResponse {
  PointCloud cloud;
  SurfaceCompliance compliance;
  PreparationFigures figures;
  std::map<std::string, CacheData::Array> extra;  ///< whatever else its owner keeps, by name
};

/// What the cache's files hold; fails where its arrays don't fit together.
Result<PreparedResponse> response_of(CacheData data);

/// What a look into the cache gave: nothing and no warning when there is no such file, nothing and
/// a warning ("rebuilt because ...") when there is one that can't be used.
struct CachedResponse {
  std::optional<PreparedResponse> response;
  std::string warning;
};

class ResponseCache {
 public:
  /// The folder is created by the first save.
  explicit ResponseCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// $VISCERA_CACHE, else $XDG_CACHE_HOME/viscera, else ~/.cache/viscera, else the folder for
  /// temporary files.
  static std::filesystem::path default_folder();

  /// `key` is the hexadecimal hash of everything that went into the response.
  std::filesystem::path file(const std::string& key) const;
  CachedResponse load(const std::string& key) const;
  Result<void> save(const std::string& key, const PreparedResponse& response) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace viscera
