// Labels to closed surfaces of good triangles that enclose the labels' volume.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/io/label_map.h"
#include "kernels/points/surface.h"

namespace viscera {

/// One organ: a piece of a label.
struct LabelOrgan {
  std::int32_t label = 0;
  int piece = 1;              ///< 1: the greatest of its label
  TriangleSurface surface;    ///< in the body's frame of the map [m]
  double edge = 0.0;          ///< wanted length of the triangles' edges [m]
  std::size_t voxels = 0;     ///< of the piece
  double label_volume = 0.0;  ///< of these voxels and of the cavities that they enclose [m3]
  double level = 0.0;         ///< by which the smoothed surface was moved to enclose that [m]
  std::vector<std::string> warnings;  ///< of cavities, borders, less smoothing, dropped crumbs
};

struct LabelSurfaceOptions {
  double edge = 0.0;  ///< [m]; 0: five quarters of a voxel's mean edge
};

/// Pieces of at least 1 % of their label and eight voxels, each as one closed surface; smaller ones
/// are named in the first piece's warnings. Surfaces of different labels in `labels` don't overlap
/// but for what triangles cut off from smooth surfaces. Fails for labels that are absent, or too
/// small to be an organ; `skip_small` leaves those out and names them in `warnings` instead.
Result<std::vector<LabelOrgan>> label_surfaces(const LabelMap& map,
                                               const std::vector<std::int32_t>& labels,
                                               const LabelSurfaceOptions& options, bool skip_small,
                                               std::vector<std::string>& warnings);

}  // namespace viscera
