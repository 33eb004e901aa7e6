#include "engine/gpu/kernels.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace viscera {

Result<Program> load_kernel(const std::vector<std::string>& files,
                            const std::vector<std::string>& definitions) {
  ShaderStage stage;
  stage.kind = GL_COMPUTE_SHADER;
  stage.definitions = definitions;
  const std::span<const ShaderFile> all = embedded_kernels();
  for (const std::string& name : files) {
    const auto file = std::find_if(all.begin(), all.end(),
                                   [&](const ShaderFile& one) { return one.name == name; });
    if (file == all.end()) {
      return failure("kernel " + name +
                     ": not in the program; expected in engine/gpu/CMakeLists.txt");
    }
    stage.files.push_back(*file);
  }
  return Program::create({stage});
}

void KernelLoader::load(Program& program, const std::vector<std::string>& files, const char* pass) {
  std::vector<std::string> definitions = definitions_;
  if (pass != nullptr) definitions.emplace_back(pass);
  Result<Program> loaded = load_kernel(files, definitions);
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
