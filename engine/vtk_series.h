// The deformed organs of a run for ParaView: vtk/ORGAN/NNNN.vtu, and vtk/organs.pvd with the times.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "engine/io/vtu_file.h"
#include "engine/world.h"
#include "kernels/base/result.h"

namespace viscera {

/// How the forces on an organ's places are handed to the vertices of its drawn surface: to those
/// that the place carries, by weight and area. Sums are kept; nothing changes its sign.
class ForceShares {
 public:
  explicit ForceShares(const OrganModel& model);
  /// Adds to `forces` (V) what the contact puts on the places [N].
  void add(const ContactResponse& response, std::vector<Vec3f>& forces) const;

 private:
  struct Share {
    int vertex;
    float weight;
  };
  std::vector<std::vector<Share>> shares_;  ///< of each touchable place, summing up to 1
};

/// Points are the tissue at rest where breathing has taken it, in the world [m]; "displacement" [m]
/// leads to the drawn surface (ParaView's "Warp By Vector" with factor 1 shows it), and "force" [N]
/// is what the instruments put on the surface. An organ gets another file when it has changed since
/// its last one.
class VtkSeries {
 public:
  VtkSeries(const std::filesystem::path& folder, const World& world);

  /// The world as it is now, under the number of the picture.
  Result<void> add(const World& world, std::uint64_t picture);
  /// The collection; without it the files are whole, but ParaView knows no times.
  Result<void> finish() const;

 private:
  struct OrganSeries {
    std::string file;  ///< the last one, relative to the folder
    std::uint64_t version = 0;
    Pose pose;
    bool loaded = false;                ///< has forces
    std::optional<ForceShares> shares;  ///< made when it is first touched
  };

  Result<void> write(const World& world, std::size_t organ, bool loaded, std::uint64_t picture);

  std::filesystem::path folder_;
  std::vector<OrganSeries> organs_;
  std::vector<PvdEntry> entries_;
  std::vector<Vec3f> points_, displacements_, forces_;
};

}  // namespace viscera
