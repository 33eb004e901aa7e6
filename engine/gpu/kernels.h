// The text of the compute kernels, put into the program when it is built.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/gpu/program.h"

namespace viscera {

/// Written by embed_shaders.cmake.
std::span<const ShaderFile> embedded_kernels();

/// Compiles the named embedded files, one after another, as one compute kernel.
Result<Program> load_kernel(const std::vector<std::string>& files,
                            const std::vector<std::string>& definitions = {});

/// Compiles kernels that share definitions, and keeps what each was refused for.
class KernelLoader {
 public:
  explicit KernelLoader(std::vector<std::string> definitions)
      : definitions_(std::move(definitions)) {}

  /// `pass`: a definition of this one's own.
  void load(Program& program, const std::vector<std::string>& files, const char* pass = nullptr);
  Result<void> result() const;

 private:
  std::vector<std::string> definitions_;
  Error error_;
};

}  // namespace viscera
