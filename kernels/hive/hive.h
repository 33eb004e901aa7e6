// A hive: the tissue close to a contact, answered by few enough unknowns for a haptic tick
// ([De2006], LPAFF).
//
// Default formulation (`subtracted`): the tissue under a tool's cells moves as
//   u = U f + w,
// U the half-space's closed forms for the cells' loads (half_space.h), sharp as they are, and w
// what the body makes different: its shape, how far it goes, where it is held. w is smooth where
// the half-space is steep, so a few dozen nodes carry it: the hive's, on the surface within its
// radius and in layers below. So no node need lie near the tool's edge, and on a flat, deep body
// the force is that of the half-space, whatever the number of nodes.
//
// Where w comes from is the periphery:
//   coupled     of the body's own precomputed compliance, by loads spread over its nodes' spacing
//               (near_field.h): w = (body's response - half-space's) to the same spread loads
//   boussinesq  zero at the periphery: the body goes on as a half-space; inside, what the surface's
//               shape makes of the half-space's tractions
//   fixed       the whole displacement is zero at the periphery [De2006]: far too stiff
//
// `paper` is the published scheme on the same nodes: moving least squares, collocated, with every
// node's displacement its unknown; tool nodes pinned, f = K_nn U + K_nu U_u.
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/hive/foot_hold.h"
#include "kernels/hive/hive_verdict.h"
#include "kernels/hive/pressed_cells.h"
#include "kernels/hive/surface_walk.h"

namespace viscera {

enum class HiveFormulation { kSubtracted, kPaper };
enum class HivePeriphery { kCoupled, kBoussinesq, kFixed };
std::string_view name_of(HiveFormulation formulation);
std::string_view name_of(HivePeriphery periphery);

struct HiveSettings {
  HiveFormulation formulation = HiveFormulation::kSubtracted;
  HivePeriphery periphery = HivePeriphery::kBoussinesq;
  IsotropicMaterial material;
  double radius = 0.0;  ///< of the influence region, along the surface [m]
  double depth = 0.0;   ///< of the lowest layer [m]; 0: as the radius, where there is room
  int nodes = 80;       ///< at most; from 14 to 512
  /// Radius of a disc that loads the tissue as the tool does, where the modulus changes with depth:
  /// which of its moduli finite strains meet [m]; 0: an eighth of `radius`.
  double pressed = 0.0;
};

/// What a hive stands on; all of it outlives the hive. `compliance` is for `coupled`, `touchable`
/// too, and for bodies whose modulus changes from place to place: a hive has that of its centre.
struct HiveBody {
  const WalkableSurface* surface = nullptr;
  const SurfaceCompliance* compliance = nullptr;
  const TouchableSurface* touchable = nullptr;
};

/// What the tissue does to the tool.
struct HiveForce {
  HiveVerdict verdict = HiveVerdict::kNotBuilt;
  Vec3 force = Vec3::Zero();   ///< on the tool [N]
  Vec3 moment = Vec3::Zero();  ///< on the tool about the hive's centre [N m]
  double energy = 0.0;         ///< stored in the tissue [J]
  int touching = 0;            ///< cells with force
  int factorisations = 0;      ///< 0: the same cells touched as before
};

/// Figures of the last build and seat.
struct HiveFigures {
  int nodes = 0, surface_nodes = 0;
  int unknowns = 0;             ///< of the equations solved by build(); 0 for `coupled`
  double smallest_pivot = 0.0;  ///< of the cells' compliance, over its largest diagonal entry
  double lifted =
      0.0;  ///< added to its diagonal to make it positive, over its mean; 0 nearly always
};

/// Movable, one thread at a time. All memory is taken by `create`: build, seat and press allocate
/// nothing, lock nothing and throw nothing, so the next hive can be built beside a running one.
class Hive {
 public:
  /// Fails on settings out of range, a material that isn't one, and `coupled` without a compliance
  /// that is symmetric. `most_cells`: of one contact.
  static Result<Hive> create(const HiveBody& body, const HiveSettings& settings, int most_cells);
  /// So many that share the memory that building takes, most of a hive's: one of them is built at a
  /// time, while the others may be pressed.
  static Result<std::vector<Hive>> create_some(const HiveBody& body, const HiveSettings& settings,
                                               int most_cells, int count);
  Hive(Hive&&) noexcept;
  Hive& operator=(Hive&&) noexcept;
  ~Hive();

  /// Nodes about `centre`, their equations, factored and condensed to the surface nodes. Cells must
  /// be seated anew. `coupled`, it is smaller where the surface leaves no room for all of it.
  HiveVerdict build(const SurfaceSpot& centre) noexcept;

  /// Condenses to these cells of a tool: at rest positions of the surface, pressed (not held) along
  /// their `direction`. Cheap beside build(): for every tick in which the tool has moved aside.
  /// `hold`: what others take off the body's answer there; left out where the hive's own can't
  /// bear it (a tool on the very tissue that a jaw holds).
  HiveVerdict seat(std::span<const ContactCell> cells, const HoldBlend& hold = {}) noexcept;

  /// The tick: force of the seated cells pushed `depths` [m] along their directions (negative: a
  /// gap), no cell pulling. A tool that only goes up and down needs nothing else.
  HiveForce press(std::span<const double> depths) noexcept;

  /// As after a press that found these forces on the seated cells [N], for displacement(): of
  /// tissue that answers otherwise than by the cells' compliance (nonlinear_hive.h).
  void load(std::span<const double> forces) noexcept;

  /// Forces of the last press on the tissue along the cells' directions, >= 0 [N]    (cells)
  std::span<const double> cell_forces() const noexcept;
  /// Displacement of the surface at a rest place under the last press [m].
  Vec3 displacement(const SurfaceSpot& spot) const noexcept;
  /// What the hold that the cells are seated with adds to the energy that the forces of the last
  /// press store, to what `before` would have them store, to first order: a tool that stands still
  /// has its force changed by it [J].
  double work_of_hold(const HoldBlend& before) const noexcept;
  /// Force on the tool, besides its cells', since the hold is another one where the tool goes
  /// aside: what the stored energy falls by [N].
  Vec3 drawn_aside() const noexcept;
  /// Compliance of the seated cells along their directions [m/N]; (cells x cells), symmetric.
  Eigen::Ref<const MatrixX> compliance() const noexcept;

  // For who puts cells together otherwise (hive_contact.h); of a built hive, `subtracted`.
  /// w at these places per force on each, the mirror of itself, (3 n) x (3 n) [m/N].
  MatrixX correction(std::span<const Vec3> places) const;
  /// Forces at places as its surface nodes carry them [N], (3 m); what corrected() takes.
  VectorX node_loads(std::span<const Vec3> places, std::span<const Vec3> forces) const;
  /// w at a place under these [m].
  Vec3 corrected(const Vec3& place, const VectorX& node_loads) const noexcept;

  const SurfaceSpot& centre() const noexcept;
  /// Modulus of the tissue where it was built as `pressed` meets it, over that of its material.
  double relative_modulus() const noexcept;
  const HiveSettings& settings() const noexcept;
  /// How far from the centre cells may lie: beyond they touch the periphery [m].
  double usable_radius() const noexcept;
  const HiveFigures& figures() const noexcept;
  /// Nodes at rest, layer by layer from the surface down [m].
  std::span<const Vec3> nodes() const noexcept;

  /// Where it stands, what is seated on it and what the last press found there. Equations and
  /// compliances are made again from these.
  struct State {
    bool built = false, seated = false;
    SurfacePoint centre;                        ///< about which it was built
    std::vector<ContactCell> cells;             ///< seated; else none
    HoldBlend hold;                             ///< that they were seated with
    std::vector<double> cell_forces;            ///< [N]  (cells)
    std::vector<double> node_forces;            ///< [N]  (3 surface nodes)
    PressedCells::State pressed;                ///< stays from seat to seat
    double smallest_pivot = 0.0, lifted = 0.0;  ///< HiveFigures
    static constexpr auto fields() {
      return std::tuple(
          field("built", &State::built), field("seated", &State::seated),
          field("centre", &State::centre), field("cells", &State::cells),
          field("hold", &State::hold), field("cell_forces", &State::cell_forces),
          field("node_forces", &State::node_forces), field("pressed", &State::pressed),
          field("smallest_pivot", &State::smallest_pivot), field("lifted", &State::lifted));
    }
  };
  State state() const;
  /// What the next build() needs of a hive that is used no more: its state, without its place.
  State idle_state() const;
  /// Builds it about that place, unless it stands there, and seats the cells: not for a tick.
  void restore(const State& state);
  /// Of this body, and of hives of this size.
  bool fits(const State& state) const noexcept;

 private:
  struct Workshop;
  struct Data;
  explicit Hive(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};
static_assert(fields_cover<Hive::State>());

}  // namespace viscera
