// The text of engine/render/shaders/*, put into the program when it is built.
#pragma once

#include <span>

#include "engine/gpu/program.h"

namespace viscera {

/// Written by embed_shaders.cmake.
std::span<const ShaderFile> embedded_shaders();

/// Compiles a program from embedded files; `vertex` and `fragment` are preceded by the common files
/// frame.glsl, noise.glsl and light.glsl.
Result<Program> load_program(const char* vertex, const char* fragment,
                             const std::vector<std::string>& definitions = {});

}  // namespace viscera
