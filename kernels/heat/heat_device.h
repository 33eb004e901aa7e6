// What a device keeps and gives back of warm bricks: for the GLSL twins of heat and for who
// dispatches them. A twin header (engine/gpu/twin_header.h).
#pragma once

#include <array>
#include <cstdint>

namespace viscera {

/// A warm brick: where its fields are, and its neighbours' at -x, +x, -y, +y, -z, +z; -1: none is
/// warm.
struct HeatEntry {
  std::int32_t slot = 0;
  std::int32_t geometry = 0;
  std::int32_t heated = 0;  ///< else its sources are old
  std::int32_t beside[6] = {};
  bool operator==(const HeatEntry&) const = default;
};

/// What has changed in a brick, as bits.
enum HeatChange : std::uint32_t {
  kWaterChanged = 1,
  kHarmChanged = 2,  ///< dose, coagulation or collagen
  kHarmedForGood = 4,
  kExcessChanged = 8
};

/// What a step leaves of a brick; by slot.
struct HeatSums {
  float latent = 0.0f, vapour = 0.0f, pyrolysis = 0.0f, gas = 0.0f;  ///< [J/m3] of a voxel
  float stored = 0.0f;                                               ///< likewise
  float greatest = 0.0f;                                             ///< excess, either sign [K]
  std::uint32_t vapours = 0;                                         ///< voxels that gave off any
  std::uint32_t changed = 0;                                         ///< bits of HeatChange
  std::array<float, 6> border{};                                     ///< greatest along each side
};

/// HeatFlows of a brick; by slot.
struct BrickFlows {
  float living = 0.0f, boundary = 0.0f, source = 0.0f, fastest = 0.0f;
};

/// What has left a voxel of a brick that gives off vapour.
struct VoxelLoss {
  float water = 0.0f, fumes = 0.0f;  ///< [kg/m3]
  float excess = 0.0f;               ///< at which it last gave off any [K]
  float unused = 0.0f;
};

}  // namespace viscera
