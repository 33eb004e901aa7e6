#include "engine/organ/label_surface.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/organ/figures_text.h"
#include "engine/organ/isosurface.h"
#include "engine/organ/label_field.h"
#include "kernels/base/parallel.h"
#include "kernels/points/surface_checks.h"

namespace viscera {
namespace {

constexpr std::size_t kLeastVoxels = 8;
constexpr double kLeastShare = 0.01;    // of a label, for a piece to become an organ
constexpr double kVolumeError = 0.03;   // that a surface may have
constexpr double kVolumeGoal = 0.0075;  // at which the level isn't sought further
constexpr double kMeshGoal = 0.02;      // the same for triangles
constexpr int kStrongest = 1;           // smoothing passes

std::string millilitres(double volume) {
  return short_number(1e6 * volume) + " ml";
}

std::string label_words(const LabelMap& map, std::int32_t label) {
  const auto name = map.names.find(label);
  return "label " + std::to_string(label) +
         (name == map.names.end() ? "" : " (" + name->second + ")");
}

// The greatest piece of the zero set on a grid of this cell.
Result<TriangleSurface> rough_surface(const LabelField& field, double cell, double& lost) {
  const SignedDistance distance = [&field](const Vec3& x) { return field(x); };
  auto surface = marching_tetrahedra(distance, field.box(), cell);
  if (!surface) return surface;
  const std::vector<TriangleSurface> pieces = pieces_of(*surface);
  double whole = 0.0;
  for (const TriangleSurface& piece : pieces) whole += std::abs(volume(piece));
  lost = 1.0 - volume(pieces.front()) / whole;
  return pieces.front();
}

// Seeks the level at which the surface encloses what is wanted, by secants that begin with the
// whole area (of which only a part may move).
class VolumeSearch {
 public:
  VolumeSearch(double wanted, double greatest) : wanted_(wanted), greatest_(greatest) {}

  /// The level to try after one that enclosed `found` with this area.
  double next(double level, double found, double area) {
    if (!began_) slope_ = area;
    const double step = level - level_;
    if (began_ && std::abs(step) > 1e-9) {
      const double measured = (found - found_) / step;
      if (measured > 0.02 * area) slope_ = std::min(measured, area);
    }
    began_ = true;
    level_ = level, found_ = found;
    return std::clamp(level + (wanted_ - found) / slope_, -greatest_, greatest_);
  }

 private:
  double wanted_, greatest_, slope_ = 1.0, level_ = 0.0, found_ = 0.0;
  bool began_ = false;
};

// What the level does to the smooth body, on a grid.
struct Restored {
  double error;      // of the volume, relative
  double thickness;  // twice the volume over the area [m]
};

// Nothing where there is no surface in one piece.
std::optional<Restored> restore_volume(LabelField& field, double wanted, double cell,
                                       double& level) {
  Restored restored{1.0, 0.0};
  VolumeSearch search(wanted, field.greatest_level());
  for (int round = 0; round < 8; ++round) {
    field.set_level(level);
    double lost = 0.0;
    const auto surface = rough_surface(field, cell, lost);
    if (!surface || lost > 0.5 * kLeastShare) return std::nullopt;
    const double found = volume(*surface), outside = area(*surface);
    restored = {found / wanted - 1.0, 2.0 * found / outside};
    if (std::abs(restored.error) < kVolumeGoal || !field.adjustable()) break;
    level = search.next(level, found, outside);
  }
  return restored;
}

// Good triangles at the level where they, and not the smooth body, enclose the volume: they cut off
// from convex places more or less what they add in hollow ones. Shorter edges where that isn't
// enough.
Result<void> mesh_with_volume(LabelField& field, double cell, LabelOrgan& organ) {
  const SignedDistance distance = [&field](const Vec3& x) { return field(x); };
  const double level = organ.level;
  for (int refinement = 0; refinement < 3; ++refinement) {
    VolumeSearch search(organ.label_volume, field.greatest_level());
    organ.level = level;
    for (int round = 0; round < 4; ++round) {
      field.set_level(organ.level);
      auto surface = mesh_signed_distance(distance, field.box(), organ.edge, cell);
      if (!surface) return std::unexpected(surface.error());
      organ.surface = std::move(*surface);
      const double found = volume(organ.surface);
      const double off = std::abs(found / organ.label_volume - 1.0);
      if (off < kMeshGoal || !field.adjustable() || round == 3) break;
      organ.level = search.next(organ.level, found, area(organ.surface));
    }
    if (std::abs(volume(organ.surface) / organ.label_volume - 1.0) < 0.8 * kVolumeError) break;
    organ.edge *= 0.7;
  }
  if (const auto defects = surface_defects(organ.surface); !defects.empty()) {
    return failure(defects.front());
  }
  return {};
}

Result<LabelOrgan> surface_of(const LabelMap& map, const LabelPiece& piece, int number,
                              const LabelSurfaceOptions& options,
                              const std::vector<std::int32_t>& imported) {
  LabelOrgan organ;
  organ.label = piece.label;
  organ.piece = number;
  organ.voxels = piece.voxels;
  organ.label_volume = static_cast<double>(piece.voxels + piece.cavity_voxels) * map.voxel_volume();
  const double voxel = std::cbrt(map.voxel_volume());
  organ.edge = options.edge > 0.0 ? options.edge : 1.25 * voxel;
  const double wanted_edge = organ.edge;

  std::string reason = "no surface";
  for (int smoothing = kStrongest; smoothing >= -1; --smoothing) {
    LabelField field(map, piece, smoothing, imported);
    organ.level = 0.0;
    // Interpolated alone, a rod of one voxel is thinner than that.
    double cell = smoothing < 0 ? 0.35 * voxel : smoothing > 0 ? voxel : 0.75 * voxel;
    cell = std::min({cell, 0.8 * wanted_edge, 1.5 * map.spacing().minCoeff()});
    const auto restored = restore_volume(field, organ.label_volume, cell, organ.level);
    if (!restored) {
      reason = "smoothing would break it into pieces";
      continue;
    }
    if (std::abs(restored->error) > 0.5 * kVolumeError && smoothing >= 0) continue;
    // A thin or small piece still needs triangles around it.
    organ.edge = std::min(wanted_edge, restored->thickness);
    if (const auto meshed = mesh_with_volume(field, std::max(cell, 0.5 * voxel), organ); !meshed) {
      reason = meshed.error().text();
      organ.surface = {};
      continue;
    }
    if (smoothing < kStrongest) {
      organ.warnings.push_back(
          "smoothed less than usual, since thin parts would have broken off or shrunk: steps of "
          "the voxels may show");
    }
    break;
  }
  if (organ.surface.empty()) {
    return failure(label_words(map, piece.label) + ": " + reason);
  }
  const double off = volume(organ.surface) / organ.label_volume - 1.0;
  if (std::abs(off) > kVolumeError) {
    organ.warnings.push_back("its volume differs from the labels' by " + short_number(100.0 * off) +
                             " %: it is thin, or enclosed by other labels");
  }
  if (piece.cavity_voxels > 0) {
    organ.warnings.push_back(
        "a cavity was filled, since organs are solid: " +
        millilitres(static_cast<double>(piece.cavity_voxels) * map.voxel_volume()) + ", first at " +
        place_text(piece.cavity));
  }
  if (piece.at_border) {
    organ.warnings.push_back(
        "it reaches the border of the volume: what lies beyond is missing, and the cut is flat");
  }
  return organ;
}

}  // namespace

Result<std::vector<LabelOrgan>> label_surfaces(const LabelMap& map,
                                               const std::vector<std::int32_t>& labels,
                                               const LabelSurfaceOptions& options, bool skip_small,
                                               std::vector<std::string>& warnings) {
  const auto extents = label_extents(map);
  std::vector<std::int32_t> imported = labels;
  std::sort(imported.begin(), imported.end());
  struct Task {
    LabelPiece piece;
    int number;
    std::vector<std::string> notes;
  };
  std::vector<Task> tasks;
  Error mistakes;
  for (const std::int32_t label : labels) {
    const auto extent = extents.find(label);
    if (label == 0 || extent == extents.end()) {
      std::string known;
      for (const auto& [number, unused] : extents) {
        known += (known.empty() ? "" : ", ") + std::to_string(number);
      }
      mistakes.messages.push_back(map.file.string() + ": found no voxel of label " +
                                  std::to_string(label) + ", expected one of " + known);
      continue;
    }
    std::vector<LabelPiece> pieces = label_pieces(map, label, extent->second);
    if (pieces.front().voxels < kLeastVoxels) {
      const std::string message =
          label_words(map, label) + ": found at most " + std::to_string(pieces.front().voxels) +
          " voxels in one piece, expected at least " + std::to_string(kLeastVoxels);
      if (skip_small) {
        warnings.push_back(message + ": left out");
      } else {
        mistakes.messages.push_back(map.file.string() + ": " + message);
      }
      continue;
    }
    const auto least = std::max(
        kLeastVoxels, static_cast<std::size_t>(
                          std::ceil(kLeastShare * static_cast<double>(extent->second.voxels))));
    std::vector<std::string> notes;
    std::size_t kept = 0, crumbs = 0;
    for (const LabelPiece& piece : pieces) {
      if (piece.voxels >= least) {
        ++kept;
      } else {
        crumbs += piece.voxels;
      }
    }
    if (kept > 1) {
      notes.push_back("the label is in " + std::to_string(kept) +
                      " pieces that don't touch; each is an organ of its own");
    }
    if (crumbs > 0) {
      notes.push_back(std::to_string(pieces.size() - kept) + " crumbs were left out, " +
                      millilitres(static_cast<double>(crumbs) * map.voxel_volume()) + " in all (" +
                      short_number(100.0 * static_cast<double>(crumbs) /
                                   static_cast<double>(extent->second.voxels)) +
                      " % of the label)");
    }
    for (std::size_t p = 0; p < kept; ++p) {
      tasks.push_back(
          {std::move(pieces[p]), static_cast<int>(p) + 1, p == 0 ? notes : decltype(notes){}});
    }
  }
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);

  std::vector<Result<LabelOrgan>> made(tasks.size());
  parallel_for_each_index(tasks.size(), 1, [&](std::size_t t) {
    made[t] = surface_of(map, tasks[t].piece, tasks[t].number, options, imported);
  });
  std::vector<LabelOrgan> organs;
  for (std::size_t t = 0; t < made.size(); ++t) {
    if (!made[t]) {
      if (skip_small) {
        warnings.push_back(made[t].error().text() + ": left out");
      } else {
        mistakes.messages.push_back(map.file.string() + ": " + made[t].error().text());
      }
      continue;
    }
    made[t]->warnings.insert(made[t]->warnings.begin(), tasks[t].notes.begin(),
                             tasks[t].notes.end());
    organs.push_back(std::move(*made[t]));
  }
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return organs;
}

}  // namespace viscera
