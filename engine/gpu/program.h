// Shader programs whose compile errors name file, line and source line.
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/base/types.h"

namespace viscera {

/// One file of GLSL, without its #version line.
struct ShaderFile {
  std::string name;  ///< as people know it: "organ.frag"
  std::string text;
};

/// One shader: its files one after another, preceded by `#version 450 core` and the definitions.
struct ShaderStage {
  unsigned kind = 0;  ///< GL_VERTEX_SHADER ...
  std::vector<ShaderFile> files;
  std::vector<std::string> definitions;  ///< "NAME" or "NAME VALUE"
};

class Program {
 public:
  /// Errors: one message per complaint of the compiler, "organ.frag:12: <complaint>" and the source
  /// line under it.
  static Result<Program> create(const std::vector<ShaderStage>& stages);
  Program() = default;
  ~Program();
  Program(Program&& other) noexcept;
  Program& operator=(Program&& other) noexcept;

  unsigned id() const { return id_; }
  void use() const;
  /// Setters of this program's uniforms. A name that the compiler has optimised away is ignored.
  void set(const char* name, int value);
  void set(const char* name, float value);
  void set(const char* name, const Eigen::Vector3i& value);
  void set(const char* name, const Eigen::Vector2f& value);
  void set(const char* name, const Eigen::Vector3f& value);
  void set(const char* name, const Eigen::Matrix3f& value);
  void set(const char* name, const Eigen::Matrix4f& value);

 private:
  int location(const char* name);
  unsigned id_ = 0;
  std::unordered_map<std::string, int> locations_;
};

}  // namespace viscera
