# cmake -DOUTPUT=shaders.cpp -DHEADER=engine/render/shaders.h -DFUNCTION=embedded_shaders
# -DFILES="a;b" -P embed_shaders.cmake: writes a source file that holds the text of every shader and
# defines FUNCTION, declared in HEADER, which gives them: the installed program needs no source tree.
set(text "#include \"${HEADER}\"\n\n#include <iterator>\n\nnamespace viscera {\n\n")
string(APPEND text "namespace {\n\nconst ShaderFile kShaders[] = {\n")
foreach(file ${FILES})
  get_filename_component(name "${file}" NAME)
  file(READ "${file}" content)
  string(APPEND text "    {\"${name}\", R\"glsl(${content})glsl\"},\n")
endforeach()
string(APPEND text "};\n\n}  // namespace\n\n")
string(APPEND text "std::span<const ShaderFile> ${FUNCTION}() { return kShaders; }\n\n")
string(APPEND text "}  // namespace viscera\n")
file(WRITE "${OUTPUT}" "${text}")
