// Young's modulus, density and fibres that change from place to place within an organ: a capsule, a
// tumour, a vessel's wall, or a map of moduli as elastography gives it.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/result.h"
#include "kernels/points/cloud.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Over those of the organ's tissue, as means over cubes: parts that meet in one count by the share
/// of it that they fill [Voigt1889], which is exact for layers stretched along themselves and too
/// stiff by what is finer than the cube across them. Immutable; from any thread.
class MaterialField {
 public:
  /// Of the organ's parts, in its own frame; null where it has none. Reads their files. Fails,
  /// naming the part, for files that can't be read, labels that aren't there, and maps that don't
  /// cover the surface.
  static Result<std::shared_ptr<const MaterialField>> make(const OrganDescription& organ,
                                                           const Tissue& tissue,
                                                           const TriangleSurface& surface,
                                                           const std::filesystem::path& assets);

  /// Relative modulus over the cube of this edge [m] about `x`; NaN where a map doesn't say it.
  double modulus(const Vec3& x, double edge) const;
  double density(const Vec3& x, double edge) const;  ///< relative
  /// Where families meet, that along which the sum of their E a a^T, each by the share of the cube
  /// that it fills, is greatest; its modulus is what that sum has there.
  Fibres fibres(const Vec3& x, double edge) const;
  bool has_fibres() const;

  /// Fails, naming the part and a place, where a part lies nowhere among these nodes of the body,
  /// or a map doesn't say the modulus at one.
  Result<void> check(const PointCloud& cloud) const;

 private:
  struct Part {
    /// Of the cube that the part fills, 0 to 1.
    std::function<double(const Vec3& x, double edge)> share;
    /// Relative modulus, where it is a map's; empty: `modulus`.
    std::function<double(const Vec3& x, double edge)> map;
    double modulus = 1.0, density = 1.0;    ///< relative
    std::optional<Fibres> fibres;           ///< none: as what it lies in
    bool stiffens = false, weighs = false;  ///< whether it says them
  };

  MaterialField() = default;
  static Result<Part> part_of(const PartDescription& description, const TriangleSurface& surface,
                              const std::filesystem::path& assets, double youngs_modulus);

  Fibres fibres_;  // of what no part fills
  std::vector<Part> parts_;
};

}  // namespace viscera
