// The deformed organs of a run for ParaView: vtk/ORGAN/NNNN.vtu, and vtk/organs.pvd with the times.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "engine/io/vtu_file.h"
#include "engine/run/observer.h"
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
class VtkSeries : public Observer {
 public:
  explicit VtkSeries(const World& world);

  Result<void> open(const std::filesystem::path& folder) override;
  Result<void> add_picture(FrameViews& views) override;
  /// The collection; without it the files are whole, but ParaView knows no times.
  Result<void> close(const World& world) override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

 private:
  struct Last {
    std::string file;  ///< the organ's last one, relative to the folder
    std::uint64_t version = 0;
    Pose pose;
    bool loaded = false;  ///< has forces
    static constexpr auto fields() {
      return std::tuple(field("file", &Last::file), field("version", &Last::version),
                        field("pose", &Last::pose), field("loaded", &Last::loaded));
    }
  };
  struct State {
    std::vector<Last> organs;
    std::vector<PvdEntry> entries;
    static constexpr auto fields() {
      return std::tuple(field("organs", &State::organs), field("entries", &State::entries));
    }
  };

  Result<void> write(const World& world, std::size_t organ, bool loaded, std::uint64_t picture);

  std::filesystem::path folder_;
  State state_;
  struct Shares {
    std::shared_ptr<const OrganModel> body;  ///< that the organ was then
    ForceShares shares;
  };
  std::vector<std::optional<Shares>> shares_;  ///< of each organ, made when first touched
  std::vector<Vec3f> points_, displacements_, forces_;
};

}  // namespace viscera
