// The bent block (engine/verification/bent_block.h) by CalculiX, as a separate program: ten-node
// tetrahedra, large displacements, the same law.
#pragma once

#include <cstddef>
#include <filesystem>

#include "engine/verification/bent_block.h"
#include "kernels/base/result.h"

namespace viscera {

struct BentBlockByCalculix {
  std::size_t nodes = 0;
  Vec3 force = Vec3::Zero();  ///< on the block by what moves its end [N]
};

bool calculix_installed();

/// Cubes of which `elements` lie along x, each cut into six tetrahedra. Works in `folder`. Fails
/// where CalculiX does. 30 elements have 17,629 nodes and take a minute or two.
Result<BentBlockByCalculix> bend_by_calculix(const BentBlockOptions& options, int elements,
                                             const std::filesystem::path& folder);

}  // namespace viscera
