// Tissue that parts: what a blade has swept or heat has vaporised is gone (kernels/parting), and
// the organ is prepared once more with the walls of the cut (engine/organ/cut_organ.h).
//
// Preparing takes longer than a frame, so it goes on beside the frames and the organ is cut from a
// frame on that its size alone decides: a run is the same on any machine, which waits where it is
// slower. Meanwhile the blade goes on, and what it has swept since is the next one's.
#pragma once

#include <future>
#include <memory>
#include <string>
#include <vector>

#include "engine/features/parting/blade_feel.h"
#include "engine/features/parting/parting_keys.h"
#include "engine/organ/cut_organ.h"
#include "engine/simulation/feature.h"

namespace viscera {

/// Of an organ that may be cut.
struct Cuttable {
  static constexpr bool kConstant = true;
  std::shared_ptr<const CuttableOrgan> organ;
  double voxel = 0.0;            ///< [m]
  double fracture_energy = 0.0;  ///< [J/m2]; 0: not known
  double ultimate_strain = 0.0;  ///< beyond which it tears; 0: it doesn't
};

/// The edge of a blade that is in an organ or near it, as the last step left it.
struct BladeTrack {
  Entity instrument;
  std::uint64_t blade = 0;    ///< of the instrument's
  double jaw = 1.0;           ///< of its scissors
  std::vector<Vec3> edge;     ///< places along it, at rest, organ frame [m]
  std::vector<double> above;  ///< ... the drawn surface; below 0 in tissue [m]
  /// ... tissue and the kerf that it makes; below 0 in either [m].
  std::vector<double> outside;
  std::vector<std::int32_t> pieces;  ///< of the organ, whose surface is nearest to each
  std::uint64_t body = 0;            ///< OrganCut::bodies then
  /// It has left.
  void lose() {
    edge.clear();
    above.clear();
    outside.clear();
    pieces.clear();
  }
  static constexpr auto fields() {
    return std::tuple(field("instrument", &BladeTrack::instrument),
                      field("blade", &BladeTrack::blade), field("jaw", &BladeTrack::jaw),
                      field("edge", &BladeTrack::edge), field("above", &BladeTrack::above),
                      field("outside", &BladeTrack::outside), field("pieces", &BladeTrack::pieces),
                      field("body", &BladeTrack::body));
  }
};
static_assert(fields_cover<BladeTrack>());

/// A piece that was taken out of the scene, or is as soon as the organ's next body is there.
struct RemovedPiece {
  Vec3 within = Vec3::Zero();  ///< a place of it at rest, organ frame [m]
  double mass = 0.0;           ///< [kg]
  static constexpr auto fields() {
    return std::tuple(field("within", &RemovedPiece::within), field("mass", &RemovedPiece::mass));
  }
};
static_assert(fields_cover<RemovedPiece>());

/// What is gone from an organ.
struct OrganCut {
  static constexpr std::string_view kName = "cut organs";
  static constexpr bool kOfBodies = true;
  TissueShare gone{0.25e-3};     ///< now
  TissueShare asked{0.25e-3};    ///< of the body that was last asked for
  TissueShare used{0.25e-3};     ///< of the body that the organ is
  std::uint64_t due = 0;         ///< frame from which on `asked` is used
  std::uint64_t bodies = 0;      ///< that it has become
  std::uint64_t refused = 0;     ///< that couldn't be prepared
  double area = 0.0;             ///< parted by blades, of one side [m2]
  double torn = 0.0;             ///< parted as it was pulled, of one side [m2]
  double work = 0.0;             ///< of blades, by fracture energy [J]
  double vaporised = 0.0;        ///< by volume, what has left as vapour [m3]
  double vaporised_asked = 0.0;  ///< of that, before `asked` [m3]
  double remnants = 0.0;         ///< that no nodes carried, which went with cuts [m3]
  std::vector<BladeTrack> blades;
  std::vector<RemovedPiece> removed;                  ///< in the order in which they were
  std::uint64_t removed_asked = 0, removed_used = 0;  ///< so many the bodies of those names lack
  std::vector<Entity> stuck;  ///< instruments whose piece doesn't fit through, as was told
  bool pending = false;
  bool changed = false;  ///< so much has gone since `asked` that another body is wanted
  static constexpr auto fields() {
    using S = OrganCut;
    return std::tuple(
        field("gone", &S::gone), field("asked", &S::asked), field("used", &S::used),
        field("due", &S::due), field("bodies", &S::bodies), field("refused", &S::refused),
        field("area", &S::area), field("torn", &S::torn), field("work", &S::work),
        field("vaporised", &S::vaporised), field("vaporised_asked", &S::vaporised_asked),
        field("remnants", &S::remnants), field("blades", &S::blades), field("removed", &S::removed),
        field("removed_asked", &S::removed_asked), field("removed_used", &S::removed_used),
        field("stuck", &S::stuck), field("pending", &S::pending), field("changed", &S::changed));
  }
};
static_assert(fields_cover<OrganCut>());

/// What follows from it.
struct OrganLeft {
  std::shared_ptr<const ShapeFunctions> fields;  ///< of the body that the organ is
  std::vector<float> depths;                     ///< as CutOrgan::depths; empty: it is whole
  std::vector<int> pieces;                       ///< as CutOrgan::pieces
  std::vector<int> loose;                        ///< as CutOrgan::loose
  std::shared_ptr<const SurfaceTree> tree;       ///< as CutOrgan::tree; null: it is whole
  std::vector<ShapedBrick> heated;               ///< as CutOrgan::heated
  TissueShare::State made_of;                    ///< what it is made of
  std::vector<Vec3> made_without;             ///< places of removed pieces, as cut_organ has them
  std::shared_future<Result<CutOrgan>> next;  ///< of OrganCut::asked
  std::string refusal;                        ///< why the last one was refused
  double crumbs = 0.0;                        ///< as CutOrgan::crumbs [m3]
  double removed = 0.0;                       ///< as CutOrgan::removed [m3]
  double greatest_seconds = 0.0;              ///< that one took to be prepared
};

/// Whether this instrument cuts this organ, and so doesn't press it.
bool cuts(const World& world, Entity instrument, Entity organ);

/// OrganCut::asked that is due -> the organ's body.
void part_organs(World& world, const FrameContext& context);
/// Where blades have gone -> OrganCut, forces on them.
void cut_tissue(World& world, const FrameContext& context);

/// What has left as vapour in the last step -> OrganCut.
void take_vaporised(World& world, const FrameContext& context);

/// A scalpel as it stands in tissue, for the hand that holds it; of other tools nothing.
BladeAsFelt blade_as_felt(const World& world, Entity instrument);

/// The places along each of an instrument's blades as they stand, organ frame [m]: one edge of a
/// scalpel, two of scissors, from the hinge on.
std::vector<std::vector<Vec3>> edges_of(const InstrumentDescription& tool,
                                        const InstrumentState& state, const Pose& organ);

std::vector<ReportSection> parting_report(const World& world);

Feature parting_feature();

}  // namespace viscera
