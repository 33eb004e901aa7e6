#include "tests/engine/gpu/block_layout.h"

#include <algorithm>
#include <ranges>

namespace viscera {
namespace {

struct Type {
  unsigned type;
  const char* name;
  std::size_t size;
};
constexpr std::array<Type, 14> kTypes = {{{GL_FLOAT, "float", 4},
                                          {GL_DOUBLE, "double", 8},
                                          {GL_FLOAT_VEC2, "vec2", 8},
                                          {GL_FLOAT_VEC3, "vec3", 12},
                                          {GL_FLOAT_VEC4, "vec4", 16},
                                          {GL_FLOAT_MAT4, "mat4", 64},
                                          {GL_INT, "int", 4},
                                          {GL_INT_VEC4, "ivec4", 16},
                                          {GL_UNSIGNED_INT, "uint", 4},
                                          {GL_UNSIGNED_INT_VEC2, "uvec2", 8},
                                          {GL_UNSIGNED_INT_VEC3, "uvec3", 12},
                                          {GL_UNSIGNED_INT_VEC4, "uvec4", 16},
                                          {GL_DOUBLE, "double", 8},
                                          {0, "a type that this test doesn't know", 0}}};

const Type& type_of(unsigned type) {
  const auto found = std::ranges::find(kTypes, type, &Type::type);
  return found != kTypes.end() ? *found : kTypes.back();
}

/// A block's variable as the driver reports it.
struct Variable {
  std::string name;
  unsigned type = 0;
  std::size_t offset = 0, count = 0, stride = 0, top_stride = 0;
  bool is_array = false;

  /// All of it.
  std::size_t size() const { return is_array ? count * stride : type_of(type).size; }
  std::string place() const {
    return std::string(type_of(type).name) + " at byte " + std::to_string(offset) + ", " +
           std::to_string(size()) + " long";
  }
};

struct Block {
  std::string name;
  std::size_t size = 0;
  std::vector<Variable> variables;
};

std::string name_of(unsigned program, unsigned interface, unsigned index) {
  std::array<char, 256> name{};
  GLsizei length = 0;
  glGetProgramResourceName(program, interface, index, static_cast<GLsizei>(name.size()), &length,
                           name.data());
  return {name.data(), static_cast<std::size_t>(length)};
}

template <std::size_t n>
std::array<int, n> properties(unsigned program, unsigned interface, unsigned index,
                              const std::array<unsigned, n>& names) {
  std::array<int, n> values{};
  glGetProgramResourceiv(program, interface, index, n, names.data(), n, nullptr, values.data());
  return values;
}

Variable read_variable(unsigned program, unsigned interface, unsigned index) {
  const auto [type, offset, count, stride] = properties<4>(
      program, interface, index, {GL_TYPE, GL_OFFSET, GL_ARRAY_SIZE, GL_ARRAY_STRIDE});
  Variable variable;
  variable.name = name_of(program, interface, index);
  variable.type = static_cast<unsigned>(type);
  variable.offset = static_cast<std::size_t>(offset);
  variable.count = static_cast<std::size_t>(count);
  variable.stride = static_cast<std::size_t>(stride);
  if (interface == GL_BUFFER_VARIABLE) {
    variable.top_stride = static_cast<std::size_t>(
        properties<1>(program, interface, index, {GL_TOP_LEVEL_ARRAY_STRIDE})[0]);
  }
  variable.is_array = variable.name.ends_with("[0]");
  if (variable.is_array) variable.name.resize(variable.name.size() - 3);
  return variable;
}

std::vector<Block> read_blocks(unsigned program, unsigned blocks, unsigned variables) {
  int count = 0;
  glGetProgramInterfaceiv(program, blocks, GL_ACTIVE_RESOURCES, &count);
  std::vector<Block> all;
  for (unsigned b = 0; b < static_cast<unsigned>(count); ++b) {
    const auto [size, active] =
        properties<2>(program, blocks, b, {GL_BUFFER_DATA_SIZE, GL_NUM_ACTIVE_VARIABLES});
    std::vector<int> indices(static_cast<std::size_t>(active));
    const unsigned property = GL_ACTIVE_VARIABLES;
    glGetProgramResourceiv(program, blocks, b, 1, &property, active, nullptr, indices.data());
    Block& block = all.emplace_back();
    block.name = name_of(program, blocks, b);
    block.size = static_cast<std::size_t>(size);
    for (const int index : indices) {
      block.variables.push_back(read_variable(program, variables, static_cast<unsigned>(index)));
    }
  }
  return all;
}

/// "table[0].slot", "pass.numbers.body": what follows the block's own name for the struct.
std::string path_of(const Variable& variable) {
  const std::size_t dot = variable.name.find('.');
  return dot == std::string::npos ? variable.name : variable.name.substr(dot + 1);
}

void compare(const Block& block, const StructLayout& expected,
             std::vector<std::string>& complaints) {
  std::vector<std::string> reported;
  for (const Variable& variable : block.variables) {
    const std::string path = path_of(variable), where = block.name + "." + path + ": ";
    reported.push_back(path);
    const auto member = std::ranges::find(expected.members, path, &MemberLayout::name);
    if (member == expected.members.end()) {
      complaints.push_back(where + "not in C++");
      continue;
    }
    if (variable.type != member->type || variable.offset != member->offset ||
        variable.size() != member->size) {
      complaints.push_back(where + variable.place() + "; in C++ " + type_of(member->type).name +
                           " at byte " + std::to_string(member->offset) + ", " +
                           std::to_string(member->size) + " long");
    }
    if (variable.top_stride != 0 && variable.top_stride != expected.size) {
      complaints.push_back(where + "one every " + std::to_string(variable.top_stride) +
                           " bytes, in C++ every " + std::to_string(expected.size));
    }
  }
  for (const MemberLayout& member : expected.members) {
    if (std::ranges::find(reported, member.name) == reported.end()) {
      complaints.push_back(block.name + "." + member.name + ": in C++ alone");
    }
  }
  const bool endless = !block.variables.empty() && block.variables[0].top_stride != 0;
  if (!endless && block.size != expected.size) {
    complaints.push_back(block.name + ": " + std::to_string(block.size) + " bytes, in C++ " +
                         std::to_string(expected.size));
  }
}

}  // namespace

std::vector<std::string> compare_blocks(const Program& program,
                                        const std::map<std::string, StructLayout>& expected,
                                        std::vector<std::string>* seen) {
  std::vector<Block> blocks = read_blocks(program.id(), GL_UNIFORM_BLOCK, GL_UNIFORM);
  std::ranges::copy(read_blocks(program.id(), GL_SHADER_STORAGE_BLOCK, GL_BUFFER_VARIABLE),
                    std::back_inserter(blocks));
  std::vector<std::string> complaints;
  for (const Block& block : blocks) {
    const auto found = expected.find(block.name);
    if (found != expected.end()) {
      compare(block, found->second, complaints);
      if (seen != nullptr) seen->push_back(block.name);
      continue;
    }
    for (const Variable& variable : block.variables) {
      const bool plain = variable.is_array && variable.name.find('.') == std::string::npos;
      if (!plain) {
        complaints.push_back(block.name + "." + path_of(variable) +
                             ": nothing in C++ is known for it");
      } else if (variable.stride != type_of(variable.type).size) {
        complaints.push_back(block.name + "." + variable.name + ": a " +
                             type_of(variable.type).name + " every " +
                             std::to_string(variable.stride) + " bytes");
      }
    }
  }
  std::ranges::sort(complaints);
  return complaints;
}

}  // namespace viscera
