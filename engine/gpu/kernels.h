// The text of the compute kernels, put into the program when it is built.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/gpu/program.h"

namespace viscera {

/// Written by embed_shaders.cmake.
std::span<const ShaderFile> embedded_kernels();

/// Compiles the named embedded files, one after another, as one compute kernel.
Result<Program> load_kernel(const std::vector<std::string>& files,
                            const std::vector<std::string>& definitions = {});

}  // namespace viscera
