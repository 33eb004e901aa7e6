// The text of engine/render/shaders/*, put into the program when it is built.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/gpu/program.h"

namespace viscera {

/// Written by embed_shaders.cmake.
std::span<const ShaderFile> embedded_shaders();

/// Compiles a program from embedded files. The fragment shader is `fragment` after `libraries`, and
/// both shaders follow what every one may use: frame.glsl, and noise.glsl and light.glsl for
/// fragments.
Result<Program> load_program(const char* vertex, const char* fragment,
                             const std::vector<std::string>& definitions = {},
                             const std::vector<std::string>& libraries = {});

/// The same for a compute shader after `libraries`; of the rest it has frame.glsl alone.
Result<Program> load_compute(const char* name, const std::vector<std::string>& definitions = {},
                             const std::vector<std::string>& libraries = {});

/// Loads a pass's programs one after another and collects every complaint.
class ProgramLoader {
 public:
  void operator()(Program& program, const char* vertex, const char* fragment,
                  const std::vector<std::string>& definitions = {},
                  const std::vector<std::string>& libraries = {});
  /// The pass, or what its shaders' compiler said.
  template <class Pass>
  Result<Pass> give(Pass pass) {
    if (!error_.messages.empty()) return std::unexpected(error_);
    return pass;
  }

 private:
  Error error_;
};

}  // namespace viscera
