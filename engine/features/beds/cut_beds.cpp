#include "engine/features/beds/cut_beds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/features/beds/beds.h"
#include "engine/features/contact/contact.h"
#include "engine/features/contact/tissue_sheet.h"
#include "engine/features/parting/parting.h"
#include "engine/features/touching/cut_bodies.h"

namespace viscera {
namespace {

/// Places of a surface that have moved by less than this are where they were [m].
constexpr double kWhereItWas = 1e-7;
/// Whether a cut lies between two places of a surface is asked so far below it [m]: what only
/// scratches the surface parts nothing.
constexpr double kBelowSurface = 1e-3;

/// One organ of a bed, as its body is now.
class BedSide {
 public:
  BedSide(const World& world, Entity organ) : model_(*world.find<OrganBody>(organ)->model) {
    const OrganLeft* left = world.find<OrganLeft>(organ);
    if (!left || !left->tree) return;
    rest_ = world.find<OrganContact>(organ)->rest.get();
    gone_ = &world.find<OrganCut>(organ)->used;
    pieces_ = left->pieces;
  }
  bool is_cut() const { return rest_ != nullptr; }

  CollisionSurface::Hit nearest(const Vec3& place) const {
    return rest_->closest(place, std::numeric_limits<double>::infinity()).value();
  }
  SurfacePatch patch(const SurfacePoint& point, double area) const {
    return patch_at(point, area, model_.surface, model_.rest_normals, *rest_);
  }
  /// The same patch where it is left, else one at the nearest place.
  SurfacePatch left_of(SurfacePatch patch) const {
    const CollisionSurface::Hit hit = nearest(patch.position);
    if (hit.distance > kWhereItWas) return this->patch(hit.point, patch.area);
    patch.point = hit.point;
    return patch;
  }
  Vec3 normal(const SurfacePoint& point) const {
    return area_vector(model_.surface, point.triangle).normalized();
  }
  /// Tissue leads straight from one place of the surface to the other.
  bool joins(const SurfacePoint& one, const SurfacePoint& other) const {
    if (!is_cut()) return true;
    if (piece_of(pieces_, model_.surface, one.triangle) !=
        piece_of(pieces_, model_.surface, other.triangle))
      return false;
    const Vec3 from = below(one), to = below(other);
    const int parts = std::max(1, static_cast<int>(std::ceil((to - from).norm() / gone_->voxel())));
    for (int i = 1; i < parts; ++i)
      if (gone_->share(Vec3(from + (to - from) * (static_cast<double>(i) / parts))) < 0.5)
        return false;
    return true;
  }

 private:
  /// Beside a wall that leans over it there is less tissue below a place.
  Vec3 below(const SurfacePoint& point) const {
    const Vec3 place = corner_mean(model_.rest_positions, model_.surface, point);
    for (const double part : {1.0, 0.5, 0.25}) {
      const Vec3 under = place - part * kBelowSurface * normal(point);
      if (gone_->share(under) >= 0.5) return under;
    }
    return place;
  }

  const OrganModel& model_;
  const CollisionSurface* rest_ = nullptr;  // null: it is whole
  const TissueShare* gone_ = nullptr;
  std::span<const int> pieces_;
};

using BedSides = std::array<BedSide, 2>;

BedSides sides_of(const World& world, const Bed& bed) {
  return {BedSide(world, bed.organs[0]), BedSide(world, bed.organs[1])};
}

struct BedLeft {
  BedPlaces places;
  std::vector<char> lost;  // of each bond
};

/// Bonds that no cell reaches have one of their own, or that of one beside them.
void add_cells(const BedSides& sides, const std::vector<std::size_t>& alone, double pitch,
               BedPlaces& places) {
  std::vector<std::size_t> middles;  // bonds at which new cells are
  std::vector<double> areas;
  for (const std::size_t bond : alone) {
    const auto near = std::ranges::find_if(middles, [&](std::size_t middle) {
      for (std::size_t side = 0; side < 2; ++side)
        if (!sides[side].joins(places.points[side][bond], places.points[side][middle]))
          return false;
      return (places.ends[0][bond] - places.ends[0][middle]).norm() < pitch;
    });
    if (near == middles.end()) {
      middles.push_back(bond);
      areas.push_back(places.layer.areas[bond]);
    } else {
      areas[static_cast<std::size_t>(near - middles.begin())] += places.layer.areas[bond];
    }
  }
  for (std::size_t m = 0; m < middles.size(); ++m)
    for (std::size_t side = 0; side < 2; ++side) {
      const SurfacePoint& point = places.points[side][middles[m]];
      SurfacePatch patch;
      patch.point = point;
      patch.position = places.ends[side][middles[m]];
      patch.normal = sides[side].normal(point);
      patch.area = areas[m];
      if (sides[side].is_cut()) patch = sides[side].patch(point, areas[m]);
      places.cells[side].push_back(patch);
    }
}

BondShares shares_left(const BedSides& sides, const std::vector<char>& lost,
                       const BedPlaces& places) {
  std::vector<Vec3> normals, middles;
  for (const SurfacePoint& point : places.points[places.first])
    normals.push_back(sides[places.first].normal(point));
  for (const SurfacePatch& cell : places.cells[places.first]) middles.push_back(cell.position);
  return bond_shares(
      places.ends[places.first], normals, middles, places.reach,
      [&](std::size_t bond, std::size_t cell) {
        const Vec3 away =
            places.cells[places.first][cell].position - places.ends[places.first][bond];
        if (lost[bond] || !(away.norm() < places.reach)) return false;
        for (std::size_t side = 0; side < 2; ++side)
          if (!sides[side].joins(places.points[side][bond], places.cells[side][cell].point))
            return false;
        return true;
      });
}

BedLeft places_left(const BedSides& sides, const BedPlaces& whole) {
  BedLeft left{whole, std::vector<char>(whole.layer.areas.size(), 0)};
  BedPlaces& places = left.places;
  for (std::size_t side = 0; side < 2; ++side) {
    if (!sides[side].is_cut()) continue;
    for (std::size_t b = 0; b < left.lost.size(); ++b) {
      const CollisionSurface::Hit hit = sides[side].nearest(whole.ends[side][b]);
      places.points[side][b] = hit.point;
      if (hit.distance > kWhereItWas) places.ends[side][b] = hit.position;
      if (hit.distance > std::sqrt(whole.layer.areas[b] / std::numbers::pi)) left.lost[b] = 1;
    }
    for (SurfacePatch& cell : places.cells[side]) cell = sides[side].left_of(cell);
  }
  places.layer.shares = shares_left(sides, left.lost, places);
  std::vector<std::size_t> alone;
  for (std::size_t b = 0; b < left.lost.size(); ++b)
    if (!left.lost[b] && places.layer.shares.begin[b] == places.layer.shares.begin[b + 1])
      alone.push_back(b);
  if (!alone.empty()) {
    add_cells(sides, alone, places.reach, places);
    places.layer.cells = places.cells[0].size();
    places.layer.shares = shares_left(sides, left.lost, places);
  }
  return left;
}

}  // namespace

const BedPlaces& places_now(const World& world, Entity bed) {
  const BedPlacesLeft* left = world.find<BedPlacesLeft>(bed);
  return left ? left->places : world.find<Bed>(bed)->places;
}

void bed_what_is_left(World& world, Entity organ, const Continuation* continuation) {
  const Pool<Bed>& beds = world.all<Bed>();
  for (std::size_t b = 0; b < beds.size(); ++b) {
    if (std::ranges::find(beds[b].organs, organ) == beds[b].organs.end()) continue;
    const Entity entity = beds.owner(b);
    world.all<BedPlacesLeft>().remove(entity);
    const BedSides sides = sides_of(world, beds[b]);
    BedState& state = *world.find<BedState>(entity);
    if (sides[0].is_cut() || sides[1].is_cut()) {
      BedLeft left = places_left(sides, beds[b].places);
      for (std::size_t i = 0; continuation && i < left.lost.size(); ++i)
        if (left.lost[i] && holds(left.places.layer, state.bonds, i))
          state.bonds.parted_by[i] = kPartedByCut;
      world.all<BedPlacesLeft>().add(entity, {std::move(left.places)});
    }
    // Cells that only a cut body has are others on the next one.
    const std::size_t lasting = beds[b].places.layer.cells;
    state.forces.resize(lasting, Vec3::Zero());
    state.forces.resize(places_now(world, entity).layer.cells, Vec3::Zero());
  }
}

double tissue_left_on(const World& world, Entity entity) {
  const Bed& bed = *world.find<Bed>(entity);
  const BedPlaces& places = places_now(world, entity);
  const BondStates& bonds = world.find<BedState>(entity)->bonds;
  double hanging = 0.0;
  for (std::size_t side = 0; side < 2; ++side) {
    const std::vector<int>& pieces = pieces_of(world, bed.organs[side]);
    if (pieces.empty()) continue;
    const OrganModel& model = *world.find<OrganBody>(bed.organs[side])->model;
    std::vector<double> volumes;
    for (const TriangleSurface& piece : closed_pieces(model.surface))
      volumes.push_back(volume(piece));
    const auto organ =
        static_cast<std::size_t>(std::ranges::max_element(volumes) - volumes.begin());
    std::vector<char> held(volumes.size(), 0);
    for (std::size_t b = 0; b < places.layer.areas.size(); ++b)
      if (holds(places.layer, bonds, b))
        held[static_cast<std::size_t>(
            piece_of(pieces, model.surface, places.points[side][b].triangle))] = 1;
    for (std::size_t p = 0; p < volumes.size(); ++p)
      if (p != organ && held[p]) hanging += volumes[p];
  }
  return hanging;
}

}  // namespace viscera
