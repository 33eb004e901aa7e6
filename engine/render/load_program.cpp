#include <epoxy/gl.h>

#include "engine/gpu/shader_text.h"
#include "engine/render/shaders.h"

namespace viscera {

namespace {

Result<ShaderStage> make_stage(unsigned kind, const std::vector<std::string>& names,
                               const std::vector<std::string>& definitions) {
  ShaderText text(embedded_shaders(), "shader", "engine/render/CMakeLists.txt");
  for (const std::string& name : names) {
    if (const Result<void> added = text.add(name); !added) return std::unexpected(added.error());
  }
  return ShaderStage{kind, text.take(), definitions};
}

}  // namespace

Result<Program> load_program(const char* vertex, const char* fragment,
                             const std::vector<std::string>& definitions,
                             const std::vector<std::string>& libraries) {
  Result<ShaderStage> first = make_stage(GL_VERTEX_SHADER, {"frame.glsl", vertex}, definitions);
  if (!first) return std::unexpected(first.error());
  std::vector<std::string> files = {"frame.glsl", "noise.glsl", "light.glsl"};
  files.insert(files.end(), libraries.begin(), libraries.end());
  files.emplace_back(fragment);
  Result<ShaderStage> second = make_stage(GL_FRAGMENT_SHADER, files, definitions);
  if (!second) return std::unexpected(second.error());
  return Program::create({*std::move(first), *std::move(second)});
}

Result<Program> load_compute(const char* name, const std::vector<std::string>& definitions,
                             const std::vector<std::string>& libraries) {
  std::vector<std::string> files = {"frame.glsl"};
  files.insert(files.end(), libraries.begin(), libraries.end());
  files.emplace_back(name);
  Result<ShaderStage> stage = make_stage(GL_COMPUTE_SHADER, files, definitions);
  if (!stage) return std::unexpected(stage.error());
  return Program::create({*std::move(stage)});
}

void ProgramLoader::operator()(Program& program, const char* vertex, const char* fragment,
                               const std::vector<std::string>& definitions,
                               const std::vector<std::string>& libraries) {
  Result<Program> loaded = load_program(vertex, fragment, definitions, libraries);
  if (loaded) {
    program = *std::move(loaded);
  } else {
    error_.messages.insert(error_.messages.end(), loaded.error().messages.begin(),
                           loaded.error().messages.end());
  }
}

}  // namespace viscera
