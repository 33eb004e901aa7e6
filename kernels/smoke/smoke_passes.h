// What the smoke passes and their GLSL twins both know: one declaration, which twin_header.h makes
// GLSL of. One parameter struct a pass, made of 4-byte scalars and 16-byte vectors, each vector on
// a multiple of 16 bytes; sizes are multiples of 16, filled up by scalars.
#pragma once

#include <array>
#include <cstdint>

#include "kernels/base/device_vectors.h"

namespace viscera {

// --- bin -----------------------------------------------------------------------------------------

/// A dense grid of cells, x fastest, with a margin of one empty cell all around. A position's cell
/// is floor((position - origin) inverse_cell), kept within [1, size - 2].
struct BinParameters {
  Float4 origin;              ///< least corner of the margin's first cell [m]
  Int4 size;                  ///< cells along x, y, z, and in all
  float inverse_cell = 0.0f;  ///< [1/m]
  std::uint32_t particles = 0;
  std::uint32_t unused_a = 0, unused_b = 0;
};

// --- viscosity -----------------------------------------------------------------------------------

enum class Laplacian : std::uint32_t {
  kPairwise,  ///< symmetric pairs with the trace of their second moment made right; the default
  kPaper,     ///< second derivatives of linear moving least squares [De2006] eq. 15; inconsistent
};

// Bounds for clumps.
inline constexpr float kLeastOfDensity = 1.0f / 3.0f;
inline constexpr float kLeastOfMoment = 0.5f;
inline constexpr float kMostRatio = 1.2f;  ///< of a pair's strength to the lesser of the two
/// Of the paper's moment matrix, inverse: less isn't inverted. A power of two: drivers are known
/// that read other double literals with the last bit wrong.
inline constexpr double kLeastCondition = 1.0 / 134217728.0;

struct ViscosityParameters {
  float inverse_square = 0.0f;          ///< 1 / h^2 [1/m2]
  float viscosity = 0.0f;               ///< nu [m2/s]
  float crowding = 0.0f;                ///< c^2 / 2, c the crowding speed [m2/s2]
  float fill = 0.0f;                    ///< phi for a sum of q^3 of one
  float most_excess = 0.0f;             ///< of phi over 1
  float gas_drag = 0.0f;                ///< rate where phi is 0: 18 nu / h^2 [1/s]
  std::uint32_t fewest_neighbours = 0;  ///< with fewer a particle is isolated
  Laplacian laplacian = Laplacian::kPairwise;
  float step = 0.0f;  ///< dt, which bounds what the paper's Laplacian may do [s]
  std::uint32_t particles = 0;
  std::uint32_t unused_a = 0, unused_b = 0;
};

// --- integrate -----------------------------------------------------------------------------------

/// One transverse wave of the swirling flow: amplitude * sine(wave_number . x + phase).
struct SwirlWave {
  Float4 amplitude;    ///< of the eddies' speed [1]; w: 0
  Float4 wave_number;  ///< in turns [1/m]; w: phase at this time, in turns within [0, 1)
};

/// Sides of the domain that smoke leaves through, as bits.
enum : std::uint32_t {
  kOpenLowX = 1,
  kOpenHighX = 2,
  kOpenLowY = 4,
  kOpenHighY = 8,
  kOpenLowZ = 16,
  kOpenHighZ = 32,
  kOpenAll = 63
};

struct IntegrateParameters {
  Float4 extent;                 ///< of the domain [m]; w: restitution of its closed sides
  float step = 0.0f;             ///< dt [s]
  float white = 0.0f;            ///< deviation in dt of the eddies' white part, of their speed [1]
  float entrainment = 0.0f;      ///< drag rate a speed relative to the gas [1/m]
  float gravity = 0.0f;          ///< buoyancy of warm parcels, along +z [m/s2]; 0: the gas has it
  float gas_temperature = 0.0f;  ///< of the gas at rest [K]
  float cooling = 0.0f;          ///< rate at which gas takes heat, over that of momentum [1]
  float turbulence = 0.0f;       ///< without gas, the eddies' speed over a parcel's [1]
  std::uint32_t seed = 0;
  std::uint32_t substep = 0;  ///< counter of the random numbers
  std::uint32_t open_sides = 0;
  std::uint32_t waves = 0;  ///< that follow in a buffer of SwirlWave
  std::uint32_t particles = 0;
};

// --- collide -------------------------------------------------------------------------------------

/// How a particle ends.
enum class SmokeFate : std::uint8_t { kAirborne, kBackground, kEvacuated, kLeaked, kDeposited };

/// Below this share of the gap a particle is put at the gap again: rounding isn't a touch.
inline constexpr float kGapSlack = 0.99f;

/// Particles are told apart by their pace: those of pace k are no faster than kPaceRatio^-k times
/// the fastest of all, so that one quick particle makes nobody else look far for surfaces.
inline constexpr std::uint32_t kPaces = 3;
inline constexpr float kPaceRatio = 4.0f;

/// A triangle near particles, ready for the nearest-point test.
struct SurfaceTriangle {
  /// Domain frame [m]; w: number of the surface, greatest distance of a corner from their mean, 0.
  std::array<Float4, 3> corners;
  std::array<Float4, 3> motion;  ///< velocities of the corners [m/s]
  /// Pseudo-normals [Baerentzen2005]: the face's; the edges' 01, 12, 20, sums of two faces'; the
  /// corners', sums of the faces' around by angle. Not normalised but the face's.
  std::array<Float4, 7> normals;
};

/// An instrument's part: the points within radius of a segment.
struct SmokeCapsule {
  Float4 from;         ///< domain frame [m]; w: radius [m]
  Float4 to;           ///< [m]
  Float4 from_motion;  ///< velocity of the ends [m/s]
  Float4 to_motion;
};

struct CollideParameters {
  Float4 origin;  ///< of the surface cells, as in BinParameters
  Int4 size;
  float inverse_cell = 0.0f;  ///< [1/m]
  float gap = 0.0f;           ///< that is kept between a particle and a surface [m]
  float friction = 0.0f;      ///< share of the tangential velocity that a touch takes
  float touch = 0.0f;         ///< distance within which smoke deposits [m]
  float kept = 1.0f;          ///< share of its smoke that a touching particle keeps in this step
  std::uint32_t capsules = 0;
  std::uint32_t particles = 0;
  std::uint32_t rounds = 0;  ///< of getting out of overlapping surfaces before it is trapped
  Float4 extent;             ///< of the domain, whose closed sides count as surfaces here [m]
  std::uint32_t open_sides = 0;
  std::uint32_t unused_a = 0, unused_b = 0, unused_c = 0;
};

// --- splat ---------------------------------------------------------------------------------------

inline constexpr float kWidestSplat = 31.0f;  ///< greatest radius of a kernel [cells]

struct SplatParameters {
  Int4 size;                    ///< cells along x, y, z, and in all
  float inverse_voxel = 0.0f;   ///< [1/m]
  float first_square = 0.0f;    ///< r^2 of a kernel (splat_levels.h) at age 0 [m2]
  float growth = 0.0f;          ///< of r^2 with age [m2/s]
  float widest_square = 0.0f;   ///< greatest r^2 [m2]
  float mass_scale = 0.0f;      ///< fixed-point steps a kilogram
  float heat_scale = 0.0f;      ///< a kilogram kelvin
  float momentum_scale = 0.0f;  ///< a kilogram metre a second
  std::uint32_t particles = 0;
};

}  // namespace viscera
