#include "engine/gpu/shader_text.h"

#include <algorithm>
#include <sstream>
#include <string_view>

#include "engine/gpu/twin_header.h"

namespace viscera {
namespace {

constexpr std::string_view kInclude = "#include \"";

/// The file that a line includes, without its folder; empty where it includes none.
std::string included_by(const std::string& line) {
  if (!line.starts_with(kInclude)) return {};
  const std::size_t end = line.find('"', kInclude.size());
  if (end == std::string::npos) return {};
  const std::string path = line.substr(kInclude.size(), end - kInclude.size());
  return path.substr(path.rfind('/') + 1);
}

}  // namespace

const ShaderFile* ShaderText::find(const std::string& name) const {
  const auto found = std::ranges::find(embedded_, name, &ShaderFile::name);
  return found != embedded_.end() ? &*found : nullptr;
}

Result<void> ShaderText::add(const std::string& name) {
  if (!seen_.insert(name).second) return {};
  const ShaderFile* found = find(name);
  if (found == nullptr) {
    return failure(what_ + " " + name + ": not in the program; expected in " + listed_in_);
  }
  const bool is_header = name.ends_with(".h");
  ShaderFile file{name, {}};
  std::istringstream stream(found->text);
  for (std::string line; std::getline(stream, line);) {
    const std::string other = included_by(line);
    if (!other.empty() && (!is_header || find(other) != nullptr)) {
      if (const Result<void> added = add(other); !added) return added;
    }
    // An empty line in its place: complaints go on to name the right ones.
    file.text += (other.empty() || is_header ? line : "") + "\n";
  }
  if (is_header) {
    Result<ShaderFile> glsl = glsl_of_header(file);
    if (!glsl) return std::unexpected(glsl.error());
    file = *std::move(glsl);
  }
  files_.push_back(std::move(file));
  return {};
}

}  // namespace viscera
