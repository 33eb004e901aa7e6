#include <epoxy/gl.h>

#include "engine/render/shaders.h"

namespace viscera {

namespace {

Result<ShaderFile> find_shader(const std::string& name) {
  for (const ShaderFile& file : embedded_shaders()) {
    if (file.name == name) return file;
  }
  return failure("shader " + name +
                 ": not in the program; expected in engine/render/CMakeLists.txt");
}

Result<ShaderStage> make_stage(unsigned kind, std::vector<std::string> names,
                               const std::vector<std::string>& definitions) {
  ShaderStage stage;
  stage.kind = kind;
  stage.definitions = definitions;
  for (const std::string& name : names) {
    Result<ShaderFile> file = find_shader(name);
    if (!file) return std::unexpected(file.error());
    stage.files.push_back(*std::move(file));
  }
  return stage;
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
  Result<ShaderStage> second = make_stage(GL_FRAGMENT_SHADER, std::move(files), definitions);
  if (!second) return std::unexpected(second.error());
  return Program::create({*std::move(first), *std::move(second)});
}

Result<Program> load_compute(const char* name, const std::vector<std::string>& definitions,
                             const std::vector<std::string>& libraries) {
  std::vector<std::string> files = {"frame.glsl"};
  files.insert(files.end(), libraries.begin(), libraries.end());
  files.emplace_back(name);
  Result<ShaderStage> stage = make_stage(GL_COMPUTE_SHADER, std::move(files), definitions);
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
