// What contact on one body keeps from call to call.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/contact/contact_cells.h"
#include "kernels/finite/finite_state.h"
#include "kernels/finite/relaxation.h"

namespace viscera {

/// Small: matrices, columns of the compliance and hives follow from the cells' places, and are made
/// from them again, to the last bit.
struct TissueContactState {
  /// What the tissue does under a hand, to begin the next frame's answer with.
  struct FootAnswer {
    Vec3 place = Vec3::Zero();          ///< of the foot, at rest [m]
    std::vector<double> displacements;  ///< of the nodes under a mean force along each axis [m/N]
    std::vector<double> forces;         ///< on what others hold, likewise
    bool asked = true;                  ///< in this step
    static constexpr auto fields() {
      using F = FootAnswer;
      return std::tuple(field("place", &F::place), field("displacements", &F::displacements),
                        field("forces", &F::forces), field("asked", &F::asked));
    }
  };
  /// Where a cell is: all that its response depends on.
  struct Place {
    Vec3 position = Vec3::Zero(), normal = Vec3::UnitZ();
    double area = 0.0;
    float bell = 0.0f;
    bool operator==(const Place&) const = default;
    static constexpr auto fields() {
      return std::tuple(field("position", &Place::position), field("normal", &Place::normal),
                        field("area", &Place::area), field("bell", &Place::bell));
    }
  };
  /// What turns the response into equations.
  struct Way {
    Vec3 direction = -Vec3::UnitZ();
    double friction = 0.0;
    bool held = false;
    bool operator==(const Way&) const = default;
    static constexpr auto fields() {
      return std::tuple(field("direction", &Way::direction), field("friction", &Way::friction),
                        field("held", &Way::held));
    }
  };

  std::vector<Place> places;  ///< of the last solve's or load's cells; empty: the body is another
                              ///< one since                                          (cells)
  std::vector<Way> ways;      ///< of the last solve's; empty: not of these places    (cells)
  std::vector<char> active;   ///< the last active set, where the next solve begins   (unknowns)
  VectorX amounts;            ///< of the unknowns; with friction the next solve's guess [N]
  MatrixX lifted;  ///< what made the last solve's matrix positive; empty: nothing was needed [m/N]
  std::vector<Vec3> forces;         ///< of the last solve or load; empty: none [N]       (cells)
  std::vector<Vec3> displacements;  ///< of its cells [m]                                 (cells)
  ContactResponse response;         ///< to the forces on cells that aren't anchors
  std::uint64_t columns_built = 0;  ///< cells whose columns are put together; hives have none
  int stayed = 0;                   ///< solves in a row at these places; several of one frame that
  bool counted = false;             ///< are told as such count once
  bool shared = false;  ///< each cell has a response of its own: as those of bodies that touch
  FiniteState motion;   ///< of tissue at finite strain; else empty
  TissueMemory memory;  ///< of such tissue that relaxes
  /// Of what is finer than places there: the forces on each cell that tissue without rest would
  /// have had, as the step began, averaged over the past that each term knows [N] (terms x cells).
  std::vector<Vec3> remembered;
  std::vector<FootAnswer> felt;  ///< by hands, of tissue at finite strain

  /// Force components that are unknown of the last solve's cells.
  std::size_t unknowns() const {
    std::size_t count = 0;
    for (const Way& way : ways) count += way.held || way.friction > 0.0 ? 3 : 1;
    return count;
  }

  static constexpr auto fields() {
    using S = TissueContactState;
    return std::tuple(
        field("places", &S::places), field("ways", &S::ways), field("active", &S::active),
        field("amounts", &S::amounts), field("lifted", &S::lifted), field("forces", &S::forces),
        field("displacements", &S::displacements), field("response", &S::response),
        field("columns_built", &S::columns_built), field("stayed", &S::stayed),
        field("counted", &S::counted), field("shared", &S::shared), field("motion", &S::motion),
        field("memory", &S::memory), field("remembered", &S::remembered), field("felt", &S::felt));
  }
};
static_assert(fields_cover<TissueContactState::Place>() && fields_cover<TissueContactState::Way>());
static_assert(fields_cover<TissueContactState::FootAnswer>());
static_assert(fields_cover<TissueContactState>());

/// Whether a body with so many touchable places can go on from it; the last `anchors` of its cells
/// are anchors. Its sizes agree, indices are those of places, and all is finite.
bool is_sound(const TissueContactState& state, std::size_t touchable, std::size_t anchors);

}  // namespace viscera
