// The text of the compute kernels, put into the program when it is built.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/gpu/program.h"

namespace viscera {

/// Written by embed_shaders.cmake: kernels (.comp), what they include (.glsl), and twin headers.
std::span<const ShaderFile> embedded_kernels();

/// The passes of a kernel, as its line `#pragma passes COUNT SCATTER` names them; one without a
/// name where it has no such line.
std::vector<std::string> passes_of(const ShaderFile& kernel);

/// Compiles one pass of an embedded kernel, that is the file with the pass's name defined, after
/// what it includes.
Result<Program> load_kernel(const std::string& file, const std::string& pass = {});

/// Compiles kernels, and keeps what each was refused for.
class KernelLoader {
 public:
  void load(Program& program, const std::string& file, const std::string& pass = {});
  Result<void> result() const;

 private:
  Error error_;
};

}  // namespace viscera
