#include "engine/gpu/program.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <regex>
#include <sstream>
#include <utility>

namespace viscera {

namespace {

std::string head_of(const ShaderStage& stage) {
  std::string head = "#version 450 core\n";
  for (const std::string& definition : stage.definitions) head += "#define " + definition + "\n";
  return head;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// "file:line" and the line itself, for a line of the joined source.
std::string describe_line(const ShaderStage& stage, std::size_t line, std::string& source) {
  const std::vector<std::string> head = lines_of(head_of(stage));
  if (line <= head.size()) {
    source = line > 0 ? head[line - 1] : "";
    return stage.files.back().name + " (definitions)";
  }
  line -= head.size();
  for (const ShaderFile& file : stage.files) {
    const std::vector<std::string> lines = lines_of(file.text);
    if (line <= lines.size()) {
      source = lines[line - 1];
      return file.name + ":" + std::to_string(line);
    }
    line -= lines.size();
  }
  source.clear();
  return stage.files.back().name + " (end)";
}

/// The compiler's log with "file:line:" in place of "0:line(column):" (Mesa) or "0(line) :"
/// (NVIDIA), each complaint followed by the line it is about.
Error explain(const std::string& log, const ShaderStage& stage) {
  static const std::regex place(R"(^\s*\d+(?::(\d+)(?:\(\d+\))?|\((\d+)\))\s*:\s*(.*)$)");
  Error error;
  for (const std::string& line : lines_of(log)) {
    if (line.empty()) continue;
    std::smatch match;
    if (!std::regex_match(line, match, place)) {
      error.messages.push_back(stage.files.back().name + ": " + line);
      continue;
    }
    std::string source;
    const std::size_t number = std::stoul(match[1].matched ? match[1] : match[2]);
    const std::string where = describe_line(stage, number, source);
    error.messages.push_back(where + ": " + match[3].str() + "\n    " + source);
  }
  if (error.messages.empty()) {
    error.messages.push_back(stage.files.back().name + ": refused without a reason");
  }
  return error;
}

Result<unsigned> compile(const ShaderStage& stage) {
  // One string without #line: Mesa forgets the string's number in some of its complaints.
  std::string text = head_of(stage);
  for (const ShaderFile& file : stage.files) {
    for (const std::string& line : lines_of(file.text)) text += line + "\n";
  }
  const char* pointer = text.c_str();
  const GLuint shader = glCreateShader(stage.kind);
  glShaderSource(shader, 1, &pointer, nullptr);
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
    glDeleteShader(*shader);  // lives on while it is attached
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

void Program::use() const {
  glUseProgram(id_);
}

int Program::location(const char* name) {
  const auto [entry, is_new] = locations_.try_emplace(name, -1);
  if (is_new) entry->second = glGetUniformLocation(id_, name);
  return entry->second;
}

void Program::set(const char* name, int value) {
  glProgramUniform1i(id_, location(name), value);
}

void Program::set(const char* name, float value) {
  glProgramUniform1f(id_, location(name), value);
}

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
