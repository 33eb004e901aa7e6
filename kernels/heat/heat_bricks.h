// The bricks of an organ that are warm or were harmed, with the fields that heat works on.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/heat/brick_geometry.h"

namespace viscera {

/// What left a voxel in one substep.
struct VoxelVapour {
  int voxel = 0;
  float water = 0.0f, tissue = 0.0f;  ///< [kg]
  float temperature = 0.0f;           ///< [K]
};

/// What a brick passed on in one step [J]; the book adds them up in the order of the bricks.
struct BrickSums {
  double latent = 0.0, vapour = 0.0, pyrolysis = 0.0, gas = 0.0;
};

/// What a brick's tissue has become, which lasts. 8 x 8 x 8 voxels, x fastest; one array a field.
struct BrickTissue {
  using Values = BrickField::Values;

  BrickIndex index = BrickIndex::Zero();
  Values water, charred;  ///< 1 wet ... 0 dry; share of the solids, 0 ... 1
  Values dose;            ///< of heat, over the one that kills
  Values coagulation;     ///< Omega of the proteins
  Values collagen;        ///< Omega of its shrinkage
  bool harmed = false;    ///< differs from sound tissue for good

  static constexpr auto fields() {
    using B = BrickTissue;
    return std::tuple(field("index", &B::index), field("water", &B::water),
                      field("charred", &B::charred), field("dose", &B::dose),
                      field("coagulation", &B::coagulation), field("collagen", &B::collagen),
                      field("harmed", &B::harmed));
  }
};
static_assert(fields_cover<BrickTissue>());

/// By the lethal dose of heat, or coagulated.
inline bool is_dead(const BrickTissue& brick, std::size_t voxel) {
  return std::max(brick.dose[voxel], brick.coagulation[voxel]) >= 1.0f;
}

/// What lasts of its warmth from step to step.
struct BrickWarmth {
  BrickField::Values excess{};    ///< temperature over the body's [K]
  float greatest = 0.0f;          ///< excess, either sign [K]
  std::array<float, 6> border{};  ///< the same along each open side [K]
  int idle = 0;                   ///< steps since it last was warm

  static constexpr auto fields() {
    using B = BrickWarmth;
    return std::tuple(field("excess", &B::excess), field("greatest", &B::greatest),
                      field("border", &B::border), field("idle", &B::idle));
  }
};
static_assert(fields_cover<BrickWarmth>());

/// Its fields, and what the step under way and other bricks need of it. A copy is on its own.
struct HeatBrick : BrickTissue {
  /// Only while it is warm.
  struct Warm : BrickWarmth {
    Values source{};  ///< heat put in during this step, by volume of the voxel [W/m3]
    // Of the step under way:
    Values before;            ///< excess at its start [K]
    Values rate;              ///< [K/s]
    Values conductivity;      ///< its negative where water boils away [W/(m K)]
    Values inverse_capacity;  ///< of the voxel's tissue, by its volume; 0: none [m3 K/J]
    Values living;            ///< tissue that still has blood and metabolism, 0 ... 1
    std::unique_ptr<std::array<Values, 2>>
        stages;                 ///< of the super step: first rate, excess two ago
    double living_sum = 0.0;    ///< of living excess [K]
    double boundary_sum = 0.0;  ///< of flow out to where there was no room [W/m]
    double source_sum = 0.0;    ///< [W/m3]
    float fastest = 0.0f;       ///< rate at which a voxel follows its neighbours [1/s]
    bool heated = false;        ///< something stands in `source`
    BrickSums sums;
    std::vector<VoxelVapour> vapour;
    // For a device that holds the fields (heat_passes.h):
    bool altered = false;  ///< somebody wrote a field by hand: the device must take them anew
    int slot = -1;         ///< the brick's number there; -1: it doesn't know the brick
    double stored = 0.0;   ///< heat as the device has it [J/m3 of a voxel]

    Warm() = default;
    explicit Warm(const BrickWarmth& lasting) : BrickWarmth(lasting) {}
  };

  std::shared_ptr<const BrickGeometry> geometry;
  std::array<HeatBrick*, 6> neighbours{};  ///< at -x, +x, -y, +y, -z, +z; null: none
  std::unique_ptr<Warm> warm;              ///< null: at body temperature

  HeatBrick() = default;
  HeatBrick(const HeatBrick& other)
      : BrickTissue(other),
        geometry(other.geometry),
        warm(other.warm ? std::make_unique<Warm>(static_cast<const BrickWarmth&>(*other.warm))
                        : nullptr) {}
  HeatBrick& operator=(const HeatBrick&) = delete;

  static constexpr auto fields() {
    return std::tuple_cat(BrickTissue::fields(), std::tuple(field("warm", &HeatBrick::warm)));
  }
};

/// Bricks in order of allocation. Pointers to bricks hold until they are removed.
class HeatBricks {
 public:
  static constexpr int kEdge = BrickField::kEdge;

  /// A brick takes its geometry along where it is copied; one that was read has none.
  struct State {
    std::vector<std::unique_ptr<HeatBrick>> bricks;  ///< in order of allocation, none null
    std::vector<BrickIndex> empty;  ///< where no tissue is, as far as anybody asked, in that order
    bool overflowed = false;

    State() = default;
    State(const State& other);
    State(State&&) = default;
    State& operator=(State other);

    static constexpr auto fields() {
      return std::tuple(field("bricks", &State::bricks), field("empty", &State::empty),
                        field("overflowed", &State::overflowed));
    }
  };

  /// `distance`: of the organ's surface; none: tissue is everywhere. `most` bricks are kept: beyond
  /// them nothing is allocated, and overflowed() says so. `where`: the state lies there, in its
  /// owner's; null: here.
  HeatBricks(double voxel, SignedDistance distance, std::size_t most,
             std::shared_ptr<State> where = nullptr);
  HeatBricks(HeatBricks&&) = default;
  HeatBricks& operator=(HeatBricks&&) = default;

  const State& state() const { return *state_; }
  /// Neighbours are found again, and the geometry of bricks that come without: taken from the
  /// bricks that were here, else made, on all threads.
  void restore(State state);
  /// Whether restore() may take it: no more bricks than are kept, one a place, and values that can
  /// be.
  bool fits(const State& state) const;

  double voxel() const { return voxel_; }
  std::size_t count() const { return state_->bricks.size(); }
  HeatBrick& brick(std::size_t i) { return *state_->bricks[i]; }
  const HeatBrick& brick(std::size_t i) const { return *state_->bricks[i]; }
  const HeatBrick* find(const BrickIndex& index) const;
  bool overflowed() const { return state_->overflowed; }

  /// From now on these bricks, and no others, are shaped or perfused otherwise than the distance
  /// says. Tissue only becomes less by it: bricks without any stay so. Those that change are
  /// returned.
  std::vector<HeatBrick*> take_shapes(std::vector<ShapedBrick> shapes);

  /// The brick here, made and warmed if need be; null where there is no tissue, or no room.
  HeatBrick* warm_up(const BrickIndex& index);
  /// The same for many, on all threads: null ones left out, the others in order.
  std::vector<HeatBrick*> warm_up(std::span<const BrickIndex> indices);
  /// Lets go of the temperature; of all of it where nothing was harmed. Moves the last brick to
  /// `i`.
  void cool_down(std::size_t i);

  BrickIndex voxel_of(const Vec3& rest_position) const;
  Vec3 centre(const HeatBrick& brick, int voxel) const;
  /// One voxel's value; what is sound and at body temperature where no brick is.
  double excess_at(const BrickIndex& voxel) const;
  double tissue_at(const BrickIndex& voxel) const;  ///< share of it that is; 1 where no brick is
  double water_at(const BrickIndex& voxel) const;
  double charred_at(const BrickIndex& voxel) const;
  double dose_at(const BrickIndex& voxel) const;
  double coagulation_at(const BrickIndex& voxel) const;
  double collagen_at(const BrickIndex& voxel) const;

  std::size_t memory_bytes() const;
  /// Of a field that fills a box of this size: for those who choose the voxel.
  static std::size_t bytes_for(const Vec3& size, double voxel);

 private:
  HeatBrick* warm_up(const BrickIndex& index, std::shared_ptr<const BrickGeometry> geometry);
  double lasting_at(const BrickIndex& voxel, BrickField::Values BrickTissue::*field,
                    double sound) const;
  std::shared_ptr<const BrickGeometry> geometry_at(const BrickIndex& index) const;
  void find_geometry(State& state) const;
  void link_neighbours();

  double voxel_;
  SignedDistance distance_;
  std::size_t most_;
  std::shared_ptr<State> state_;  // never null
  BrickMap numbers_;              // kEmpty where there is no tissue
  std::vector<ShapedBrick> shapes_;
  BrickMap shape_numbers_;
};
static_assert(fields_cover<HeatBricks::State>());

}  // namespace viscera
