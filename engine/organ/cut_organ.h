// An organ that is prepared once more, less what is gone from it.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "engine/organ/organ_model.h"
#include "engine/organ/reach.h"
#include "kernels/finite/continuation.h"
#include "kernels/heat/brick_geometry.h"
#include "kernels/parting/tissue_share.h"
#include "kernels/points/closed_pieces.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

/// An organ at finite strain that may be cut; immutable.
struct CuttableOrgan {
  std::shared_ptr<const OrganModel> whole;
  std::shared_ptr<const ShapeFunctions> fields;  ///< of `whole`
  std::shared_ptr<const SurfaceTree> skin;       ///< its surface at rest
  OrganDescription organ;                        ///< its response is finite
  Tissue tissue;
  BodyDemand demand;
  Vec3 gravity = Vec3::Zero();  ///< on what is cut off and falls, organ frame [m/s2]
  double heat_voxel = 0.0;      ///< of the bricks in which heat spreads; 0: nothing heats it [m]
  std::filesystem::path assets;
};

std::shared_ptr<const CuttableOrgan> make_cuttable(std::shared_ptr<const OrganModel> whole,
                                                   OrganDescription organ, Tissue tissue,
                                                   BodyDemand demand, const Vec3& gravity,
                                                   double heat_voxel, std::filesystem::path assets);

/// What is left of it.
struct CutOrgan {
  TissueShare tissue;  ///< as asked for, less remnants that no nodes carry
  std::shared_ptr<const OrganModel> model;
  std::shared_ptr<const ShapeFunctions> fields;
  std::vector<float> depths;  ///< of its vertices below the whole one's surface; 0: on it [m] (V)
  /// Of its vertices, as pieces_of_vertices() has them (kernels/points/closed_pieces.h).       (V)
  std::vector<int> pieces;
  /// Of each piece the number, by LoosePieces, of what moves it; -1: it is held. Empty: all is.
  std::vector<int> loose;
  Continuation continuation;                ///< from the body that it was before
  std::shared_ptr<const SurfaceTree> tree;  ///< of its surface at rest
  /// Bricks of heat that what is gone reaches, and those of pieces that have no blood.
  std::vector<ShapedBrick> heated;
  double crumbs = 0.0;    ///< pieces too small for nodes, which are gone, too [m3]
  double removed = 0.0;   ///< pieces that were taken out of the scene [m3]
  double remnants = 0.0;  ///< that `tissue` lacks and what was asked for has [m3]
  double seconds = 0.0;   ///< it took
};

/// Nodes stay where they are, twins come (kernels/paff/true_neighbours.h); what holds it and the
/// shape that it has without weight stay. A piece that nothing holds moves by itself
/// (kernels/finite/loose_pieces.h). `before` and its fields: the body until now, the whole one or
/// one cut less. Slivers beside a cut, of which every node has so little that it needs no twin,
/// have nothing to carry them: they go with it. `removed`: a place at rest [m] within each piece
/// that was taken out of the scene; the closed surface about it is dropped, and the nodes that only
/// it needed. Fails where walls can't be told from the surface, nothing is left, a piece comes off
/// of an organ that is quasi-static, or preparing it fails.
Result<CutOrgan> cut_organ(const CuttableOrgan& organ, const TissueShare& tissue,
                           std::span<const Vec3> removed, const OrganModel& before,
                           const ShapeFunctions& fields_before);

}  // namespace viscera
