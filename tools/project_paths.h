// Where the program finds its own files.
#pragma once

#include <filesystem>

namespace viscera {

/// The assets folder: $VISCERA_ASSETS, else beside an installed program
/// (PREFIX/share/viscera/assets), else the source tree that it was built from.
std::filesystem::path assets_folder();

}  // namespace viscera
