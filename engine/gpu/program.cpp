#include "engine/gpu/program.h"

#include <epoxy/gl.h>

#include <regex>
#include <sstream>
#include <utility>

namespace viscera {

namespace {

std::string source_line(const std::string& text, int line) {
  std::istringstream stream(text);
  std::string found;
  for (int i = 0; i < line && std::getline(stream, found); ++i) {
  }
  return found;
}

/// The compiler's log with "file:line:" in place of "string:line(column):" (Mesa) or
/// "string(line) :" (NVIDIA), each complaint followed by the line it is about.
Error explain(const std::string& log, const ShaderStage& stage) {
  static const std::regex place(R"(^\s*(\d+)(?::(\d+)(?:\(\d+\))?|\((\d+)\))\s*:\s*(.*)$)");
  Error error;
  std::istringstream stream(log);
  std::string line;
  while (std::getline(stream, line)) {
    if (line.empty()) continue;
    std::smatch match;
    if (!std::regex_match(line, match, place)) {
      error.messages.push_back(stage.files.back().name + ": " + line);
      continue;
    }
    const std::size_t file = std::stoul(match[1]);
    const int number = std::stoi(match[2].matched ? match[2] : match[3]);
    if (file == 0 || file > stage.files.size()) {
      error.messages.push_back(stage.files.back().name + " (definitions): " + match[4].str());
      continue;
    }
    const ShaderFile& found = stage.files[file - 1];
    error.messages.push_back(found.name + ":" + std::to_string(number) + ": " + match[4].str() +
                             "\n    " + source_line(found.text, number));
  }
  if (error.messages.empty()) {
    error.messages.push_back(stage.files.back().name + ": refused without a reason");
  }
  return error;
}

Result<unsigned> compile(const ShaderStage& stage) {
  std::vector<std::string> texts = {"#version 450 core\n"};
  for (const std::string& definition : stage.definitions) {
    texts.front() += "#define " + definition + "\n";
  }
  for (std::size_t i = 0; i < stage.files.size(); ++i) {
    texts.push_back("#line 1 " + std::to_string(i + 1) + "\n" + stage.files[i].text + "\n");
  }
  std::vector<const char*> pointers;
  for (const std::string& text : texts) pointers.push_back(text.c_str());
  const GLuint shader = glCreateShader(stage.kind);
  glShaderSource(shader, static_cast<GLsizei>(pointers.size()), pointers.data(), nullptr);
  glCompileShader(shader);
  GLint good = GL_FALSE, length = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good == GL_TRUE) return shader;
  glGetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
  std::string log(std::max(length, 1), '\0');
  glGetShaderInfoLog(shader, length, nullptr, log.data());
  glDeleteShader(shader);
  return std::unexpected(explain(log.c_str(), stage));
}

}  // namespace

Result<Program> Program::create(const std::vector<ShaderStage>& stages) {
  Program program;
  program.id_ = glCreateProgram();
  Error error;
  std::string names;
  for (const ShaderStage& stage : stages) {
    const Result<unsigned> shader = compile(stage);
    if (!shader) {
      error.messages.insert(error.messages.end(), shader.error().messages.begin(),
                            shader.error().messages.end());
      continue;
    }
    glAttachShader(program.id_, *shader);
    glDeleteShader(*shader);   // lives on while it is attached
    names += (names.empty() ? "" : " + ") + stage.files.back().name;
  }
  if (!error.messages.empty()) return std::unexpected(error);
  glLinkProgram(program.id_);
  GLint good = GL_FALSE, length = 0;
  glGetProgramiv(program.id_, GL_LINK_STATUS, &good);
  if (good == GL_TRUE) return program;
  glGetProgramiv(program.id_, GL_INFO_LOG_LENGTH, &length);
  std::string log(std::max(length, 1), '\0');
  glGetProgramInfoLog(program.id_, length, nullptr, log.data());
  return failure(names + ": not linked: " + log.c_str());
}

Program::~Program() {
  if (id_ != 0) glDeleteProgram(id_);
}

Program::Program(Program&& other) noexcept
    : id_(std::exchange(other.id_, 0)), locations_(std::move(other.locations_)) {}

Program& Program::operator=(Program&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(locations_, other.locations_);
  return *this;
}

void Program::use() const { glUseProgram(id_); }

int Program::location(const char* name) {
  const auto [entry, is_new] = locations_.try_emplace(name, -1);
  if (is_new) entry->second = glGetUniformLocation(id_, name);
  return entry->second;
}

void Program::set(const char* name, int value) { glProgramUniform1i(id_, location(name), value); }

void Program::set(const char* name, float value) { glProgramUniform1f(id_, location(name), value); }

void Program::set(const char* name, const Eigen::Vector3i& value) {
  glProgramUniform3iv(id_, location(name), 1, value.data());
}

void Program::set(const char* name, const Eigen::Vector2f& value) {
  glProgramUniform2fv(id_, location(name), 1, value.data());
}

void Program::set(const char* name, const Eigen::Vector3f& value) {
  glProgramUniform3fv(id_, location(name), 1, value.data());
}

void Program::set(const char* name, const Eigen::Matrix3f& value) {
  glProgramUniformMatrix3fv(id_, location(name), 1, GL_FALSE, value.data());
}

void Program::set(const char* name, const Eigen::Matrix4f& value) {
  glProgramUniformMatrix4fv(id_, location(name), 1, GL_FALSE, value.data());
}

}  // namespace viscera
