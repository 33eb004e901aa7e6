// Where the program finds its own files.
#pragma once

#include <filesystem>

namespace viscera {

/// Where the programs that belong together stand: in this program's own folder, or on top of the
/// build folder for whatever lies in that.
std::filesystem::path program_folder();

/// The assets folder: $VISCERA_ASSETS, else that of the source tree for a program in its build
/// folder, else the installed one (PREFIX/share/viscera/assets), found from where the program is.
std::filesystem::path assets_folder();

/// The shipped scenes, beside the assets.
std::filesystem::path scenes_folder();

}  // namespace viscera
