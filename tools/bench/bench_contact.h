// `viscera bench contact`: bodies that touch each other, time against error.
#pragma once

#include <filesystem>
#include <iosfwd>

#include "kernels/base/result.h"

namespace viscera {

struct ContactBenchOptions {
  std::filesystem::path json, plots;  ///< empty: none is written
};

/// Two half balls by the kernel and as organs of a scene, linear and at finite strain, against
/// Hertz; a ball that is dragged along the other against Coulomb. Prints the cases with the figures
/// to reach and writes JSON and a plot. Fails where a body can't be prepared, and on Ctrl-C.
Result<void> bench_contact(const ContactBenchOptions& options, std::ostream& out);

}  // namespace viscera
