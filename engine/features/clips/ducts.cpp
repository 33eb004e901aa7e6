// Ducts and vessels: lines through organs that are solid here. One is cut where what is gone of its
// organ reaches it. A clip closes it that has it between its bars, is shut, and holds its pressure;
// so does a seal of bipolar jaws that goes on for a millimetre beside the cut.
// What bars press a solid with, squeezed to a third, says less than that of a wall that lies on
// itself.
#include <algorithm>
#include <limits>

#include "engine/features/cautery/bipolar.h"
#include "engine/features/clips/clips.h"
#include "engine/features/parting/parting.h"

namespace viscera {
namespace {

/// Of a body between two samples of a line, and where half is gone.
constexpr double kDuctStep = 0.25e-3;  // [m]
constexpr double kHalfGone = 0.5;
/// Of a duct's length, for a seal beside a cut to hold. Chosen.
constexpr double kLeastSeal = 1e-3;  // [m]

std::vector<Vec3> samples_of(const DuctDescription& duct) {
  std::vector<Vec3> samples = {duct.path.front()};
  for (std::size_t p = 0; p + 1 < duct.path.size(); ++p) {
    const Vec3 way = duct.path[p + 1] - duct.path[p];
    const int steps = std::max(1, static_cast<int>(std::ceil(way.norm() / kDuctStep)));
    for (int s = 1; s <= steps; ++s)
      samples.push_back(duct.path[p] + static_cast<double>(s) / steps * way);
  }
  return samples;
}

/// The sample nearest to the middle of what a clip has between its bars, at rest; none: -1.
int clipped_at(const Clip& clip, double width, std::span<const Vec3> samples) {
  Vec3 upper = Vec3::Zero(), lower = Vec3::Zero();
  for (std::size_t k = 0; k < clip.cells.size(); ++k)
    (k < clip.upper ? upper : lower) += clip.cells[k].position;
  upper /= static_cast<double>(clip.upper);
  lower /= static_cast<double>(clip.cells.size() - clip.upper);
  const Vec3 middle = 0.5 * (upper + lower);
  double outermost = 0.0;  // cell along the bars
  for (const ContactCell& cell : clip.cells)
    outermost = std::max(outermost, std::abs(clip.axes_then.col(0).dot(cell.position - middle)));
  // A cell's area is its part of the bar.
  const Vec3 half(outermost + 0.5 * clip.cells[0].area / width, 0.5 * (upper - lower).norm(),
                  0.5 * width + kDuctStep);
  int nearest = -1;
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const Vec3 from = clip.axes_then.transpose() * (samples[s] - middle);
    if ((from.cwiseAbs() - half).maxCoeff() > 0.0 || !(from.norm() < distance)) continue;
    distance = from.norm();
    nearest = static_cast<int>(s);
  }
  return nearest;
}

DuctFigures figures_of(const World& world, Entity organ, const DuctDescription& duct) {
  DuctFigures figures{organ, duct.name, duct.pressure, false, false};
  const TissueShare& gone = world.find<OrganCut>(organ)->gone;
  if (gone.untouched()) return figures;
  const std::vector<Vec3> samples = samples_of(duct);
  constexpr int kNone = std::numeric_limits<int>::max();
  int first = kNone, last = -1;  // that are cut
  for (int s = 0; s < static_cast<int>(samples.size()); ++s) {
    if (gone.share(samples[static_cast<std::size_t>(s)]) >= kHalfGone) continue;
    first = std::min(first, s);
    last = s;
  }
  figures.cut = last >= 0;
  if (!figures.cut) return figures;
  bool before = false, behind = false;  // closed
  each_clip(world, [&](const Clip& clip, const ClipsDescription& clips) {
    if (!(clip.organ == organ) || !clip.closed() || clips.holds < duct.pressure) return;
    const int at = clipped_at(clip, clips.width, samples);
    before |= at >= 0 && at < first;
    behind |= at > last;
  });
  each_seal(world, [&](const Seal& seal, const BipolarDescription& bipolar) {
    if (!(seal.organ == organ) || !seal.fused() || bipolar.holds < duct.pressure) return;
    double in_front = 0.0, beyond = 0.0;  // of the duct in the seal [m]
    for (int s = 0; s + 1 < static_cast<int>(samples.size()); ++s) {
      const Vec3 &one = samples[static_cast<std::size_t>(s)],
                 &next = samples[static_cast<std::size_t>(s) + 1];
      if (!seal.holds_within(one) || !seal.holds_within(next)) continue;
      if (s + 1 < first) in_front += (next - one).norm();
      if (s > last) beyond += (next - one).norm();
    }
    before |= in_front >= kLeastSeal;
    behind |= beyond >= kLeastSeal;
  });
  using Fed = DuctDescription::Fed;
  figures.open = (duct.fed != Fed::kEnd && !before) || (duct.fed != Fed::kStart && !behind);
  return figures;
}

}  // namespace

std::vector<DuctFigures> duct_figures(const World& world) {
  std::vector<DuctFigures> all;
  const SceneModel& model = world.model();
  for (std::size_t o = 0; o < model.organs().size(); ++o)
    for (const DuctDescription& duct : ducts_of(model.scene().organs[o]))
      all.push_back(figures_of(world, model.organs()[o], duct));
  return all;
}

}  // namespace viscera
