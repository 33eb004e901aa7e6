#include "engine/gpu/kernels.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <sstream>
#include <string_view>
#include <utility>

#include "engine/gpu/shader_text.h"

namespace viscera {
namespace {

constexpr std::string_view kPasses = "#pragma passes ";

}  // namespace

std::vector<std::string> passes_of(const ShaderFile& kernel) {
  std::istringstream stream(kernel.text);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(kPasses)) continue;
    std::istringstream names(line.substr(kPasses.size()));
    std::vector<std::string> passes;
    for (std::string name; names >> name;) passes.push_back(name);
    return passes;
  }
  return {{}};
}

Result<Program> load_kernel(const std::string& file, const std::string& pass) {
  ShaderText text(embedded_kernels(), "kernel", "engine/gpu/CMakeLists.txt");
  if (const Result<void> added = text.add(file); !added) return std::unexpected(added.error());
  ShaderStage stage;
  stage.kind = GL_COMPUTE_SHADER;
  stage.files = text.take();
  const std::vector<std::string> passes = passes_of(stage.files.back());
  if (std::ranges::find(passes, pass) == passes.end()) {
    std::string expected;
    for (const std::string& one : passes) expected += " '" + one + "'";
    return failure("kernel " + file + ": pass '" + pass + "', expected one of" + expected);
  }
  if (!pass.empty()) stage.definitions.push_back(pass);
  return Program::create({stage});
}

void KernelLoader::load(Program& program, const std::string& file, const std::string& pass) {
  Result<Program> loaded = load_kernel(file, pass);
  if (loaded) {
    program = *std::move(loaded);
  } else {
    error_.messages.insert(error_.messages.end(), loaded.error().messages.begin(),
                           loaded.error().messages.end());
  }
}

Result<void> KernelLoader::result() const {
  if (!error_.messages.empty()) return std::unexpected(error_);
  return {};
}

}  // namespace viscera
