#include "engine/features/parting/blades_in_tissue.h"

#include <algorithm>

#include "engine/features/parting/parting.h"

namespace viscera {
namespace {

/// A blade's edge in one organ.
struct EdgeInTissue {
  double length = 0.0;         ///< [m]
  Vec3 middle = Vec3::Zero();  ///< times the length, until all is summed [m]
  double above = 0.0;          ///< the drawn surface, in the mean; likewise [m]
};

/// Of a straight piece between two heights, what lies below `level`.
double part_below(double one, double other, double level) {
  const auto [low, high] = std::minmax(one, other);
  if (high <= level) return 1.0;
  return low >= level ? 0.0 : (level - low) / (high - low);
}

/// Where it has cut tissue away, what lies less than `beside` above the surface counts, too [m].
EdgeInTissue edge_in_tissue(const BladeTrack& track, const TissueShare& left, double beside) {
  EdgeInTissue in;
  for (std::size_t k = 0; k + 1 < track.edge.size(); ++k) {
    // From one piece of an organ to another there is no way at rest.
    if (track.pieces[k] != track.pieces[k + 1]) continue;
    const double one = track.above[k], other = track.above[k + 1];
    const bool in_kerf = left.share(track.edge[k]) < 0.5 || left.share(track.edge[k + 1]) < 0.5;
    const double level = in_kerf ? beside : 0.0;
    const double part = part_below(one, other, level);
    const double length = part * (track.edge[k + 1] - track.edge[k]).norm();
    // The part at the deeper end.
    const double at = one < other ? 0.5 * part : 1.0 - 0.5 * part;
    in.length += length;
    in.middle += length * ((1.0 - at) * track.edge[k] + at * track.edge[k + 1]);
    in.above += length * ((1.0 - at) * one + at * other);
  }
  if (!(in.length > 0.0)) return {};
  in.middle /= in.length;
  in.above /= in.length;
  return in;
}

}  // namespace

std::optional<BladesInTissue> blades_in_tissue(const World& world, Entity instrument) {
  const InstrumentDescription& tool = world.find<InstrumentBody>(instrument)->description;
  const BladeDescription* blade = blade_of(tool);
  if (tool.kind != InstrumentKind::kScissors || !blade) return {};
  std::optional<BladesInTissue> found;
  const Pool<OrganCut>& organs = world.all<OrganCut>();
  for (std::size_t o = 0; o < organs.size(); ++o) {
    if (world.find<OrganState>(organs.owner(o))->frozen) continue;
    // In a kerf a blade touches both walls.
    const TissueShare& gone = organs[o].gone;
    const double beside = 0.5 * std::max(blade->thickness, gone.least_kerf()) + 0.5 * gone.voxel();
    BladesInTissue in{.organ = organs.owner(o)};
    double longest = 0.0;
    for (const BladeTrack& track : organs[o].blades) {
      if (!(track.instrument == instrument)) continue;
      const EdgeInTissue edge = edge_in_tissue(track, gone, beside);
      in.area += blade->thickness * edge.length;
      if (!(edge.length > longest)) continue;
      longest = edge.length;
      in.middle = edge.middle;
      in.below = edge.above < 0.0;
    }
    if (in.area > (found ? found->area : 0.0)) found = in;
  }
  return found;
}

}  // namespace viscera
