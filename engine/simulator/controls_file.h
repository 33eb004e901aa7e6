// Controls on disk: what moved the tools, step by step; a text for people and programs.
//
//   frame,tool,tip_x_m,tip_y_m,tip_z_m,jaw,power_W,blade,frames_per_s
//   1,hook,-0.042,0.01,0.033,1,30,0,60
//
// A row a tool and frame, frames from 1 without gaps, tools in the scene's order. Digits are the
// shortest that read back to the same numbers. Files of before are read, too: without the last
// column they have 60 frames a second, without the one before it nobody pulls a knife's trigger.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/simulation/controls.h"

namespace viscera {

std::string controls_header();
/// The rows of one frame, with their line ends.
std::string controls_rows(std::uint64_t frame, const std::vector<std::string>& tools,
                          const Controls& controls, std::uint64_t frames_per_second);

/// One frame's after the other, the first that of frame 1. Every mistake as "FILE:LINE: found,
/// expected", the first twenty of them; also that they were recorded with another number of frames
/// a second than the scene has.
Result<std::vector<Controls>> read_controls(const std::filesystem::path& file,
                                            const std::vector<std::string>& tools,
                                            std::uint64_t frames_per_second);

}  // namespace viscera
