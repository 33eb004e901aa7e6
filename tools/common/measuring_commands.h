// The commands that measure. `viscera` lists them and starts the program that holds them, so that
// the user's program stays free of test bodies, random cases and other people's programs.
#pragma once

#include <array>

namespace viscera {

struct MeasuringCommand {
  const char* name;
  const char* help;  ///< its line in `viscera --help`
};

inline constexpr MeasuringCommand kBenchCommand = {"bench",
                                                   "measure, with the error beside every speed"};
inline constexpr MeasuringCommand kProfileCommand = {
    "profile", "what a scene's frames cost with more and more organs"};
inline constexpr MeasuringCommand kStressCommand = {
    "stress",
    "throw random bodies and tools at the elastic core; a failing case says how to run it again"};

inline constexpr std::array kMeasuringCommands = {kBenchCommand, kProfileCommand, kStressCommand};

/// Beside `viscera`.
inline constexpr const char* kMeasuringProgram = "viscera_bench";

}  // namespace viscera
