// Jaws that seal: bipolar current through what they squeeze, until it begins to dry.
//
// A generator of that kind holds its power while tissue coagulates, and ends by itself once the
// impedance, for the gap between the jaws as it is, has risen well beyond its least: then water
// leaves. Tissue whose proteins have coagulated between jaws that press it stays fused.
#pragma once

#include <vector>

#include "engine/features/cautery/cautery.h"

namespace viscera {

/// What a cycle of current left between the jaws; the organ's rest frame.
struct Seal {
  Entity organ;
  Vec3 middle = Vec3::Zero();    ///< [m]
  Mat3 axes = Mat3::Identity();  ///< columns: along the jaws, from the lower to the upper, across
  Vec3 half = Vec3::Zero();      ///< half its size along these [m]
  double begun = 0.0, ended = 0.0;  ///< [s]
  double coagulated = 0.0;          ///< share of its volume
  double squeezed = 1.0;            ///< its thickness over that at rest
  double least = 0.0, last = 0.0;   ///< impedance [Ohm]
  bool dried = false;               ///< the generator ended by itself
  /// Most of it has coagulated.
  bool fused() const;
  bool holds_within(const Vec3& place) const;
  static constexpr auto fields() {
    using S = Seal;
    return std::tuple(field("organ", &S::organ), field("middle", &S::middle),
                      field("axes", &S::axes), field("half", &S::half), field("begun", &S::begun),
                      field("ended", &S::ended), field("coagulated", &S::coagulated),
                      field("squeezed", &S::squeezed), field("least", &S::least),
                      field("last", &S::last), field("dried", &S::dried));
  }
};
static_assert(fields_cover<Seal>());

/// Of an instrument with bipolar jaws.
struct Sealer {
  static constexpr std::string_view kName = "sealers";
  bool on = false;            ///< a cycle is under way: the handle asks for current, on tissue
  bool over = false;          ///< its generator has ended
  bool cooling = false;       ///< after it; the jaws still hold what the last seal is
  std::uint64_t retaken = 0;  ///< Jaws::retaken as it began
  double least_by_gap = 0.0;  ///< least impedance over the gap's square [Ohm/m2]
  Seal now;                   ///< of the cycle under way
  std::vector<Seal> seals;
  static constexpr auto fields() {
    return std::tuple(field("on", &Sealer::on), field("over", &Sealer::over),
                      field("cooling", &Sealer::cooling), field("retaken", &Sealer::retaken),
                      field("least_by_gap", &Sealer::least_by_gap), field("now", &Sealer::now),
                      field("seals", &Sealer::seals));
  }
};
static_assert(fields_cover<Sealer>());

/// A step of such an instrument: heat between its jaws -> BurnTrace, Sealer, OrganBurn.
void seal_tissue(World& world, Entity instrument, BurnTrace& trace, const FrameContext& context);

/// After a state was loaded: seals are of organs that there are.
void drop_unsound_seals(World& world);

/// Visits all seals that cycles have left: (seal, BipolarDescription).
template <class Visit>
void each_seal(const World& world, const Visit& visit) {
  const Pool<Sealer>& all = world.all<Sealer>();
  for (std::size_t i = 0; i < all.size(); ++i)
    for (const Seal& seal : all[i].seals)
      visit(seal, *bipolar_of(world.find<InstrumentBody>(all.owner(i))->description));
}

}  // namespace viscera
