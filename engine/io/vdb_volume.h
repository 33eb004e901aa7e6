// OpenVDB [Museth2013] behind a plain interface: its headers take long to compile, so one source
// includes them.
#pragma once

#include <filesystem>
#include <string>

#include "engine/io/smoke_file.h"
#include "engine/io/smoke_info.h"

namespace viscera {

/// Initialises OpenVDB the first time.
void ensure_openvdb();

/// The bytes of a .vdb file with the fog volumes "density" [kg/m3] and "temperature" [K], stored as
/// half floats. Voxels below half precision's least value (6e-8 kg/m3, which hides a hundredth of a
/// per cent of a light ray over a metre) are inactive. Errors: a grid whose arrays don't fit its
/// size, or what OpenVDB reports.
Result<std::string> encode_volume(const SmokeGrid& grid, double time,
                                  const std::string& volume_name, const std::string& scene_name);

/// What a file that encode_volume() made holds; its end mark is looked for first. In this process,
/// which a forged file may end: read_smoke_info() (foreign_files.h) asks another.
Result<SmokeFileInfo> read_smoke_info_here(const std::filesystem::path& file);

}  // namespace viscera
