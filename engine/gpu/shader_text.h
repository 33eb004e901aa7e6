// The files of a shader with what they include.
#pragma once

#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/gpu/program.h"
#include "kernels/base/result.h"

namespace viscera {

/// Collects the files of one stage: each after the files that it includes, and none twice.
/// `#include "kernels/smoke/smoke_passes.h"` means the embedded file of that name, whatever the
/// folder. A header (.h) is a twin header (twin_header.h), made GLSL of; what it includes and isn't
/// embedded is C++'s own.
class ShaderText {
 public:
  /// `what` the files are, and `listed_in` which CMake file, are for the error's words.
  ShaderText(std::span<const ShaderFile> embedded, std::string what, std::string listed_in)
      : embedded_(embedded), what_(std::move(what)), listed_in_(std::move(listed_in)) {}

  /// Errors: a file that isn't embedded; a header that isn't a twin header.
  Result<void> add(const std::string& name);
  std::vector<ShaderFile> take() { return std::move(files_); }

 private:
  const ShaderFile* find(const std::string& name) const;

  std::span<const ShaderFile> embedded_;
  std::string what_, listed_in_;
  std::set<std::string> seen_;
  std::vector<ShaderFile> files_;
};

}  // namespace viscera
