// What must hold of an elastic body and of the forces of its contacts, whatever the cloud. Each
// check returns what it measured beside what it may be; the tolerances are derived in the source.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kernels/contact/patch_contact.h"
#include "kernels/paff/elasticity.h"
#include "tools/stress/stress_cases.h"

namespace viscera {

/// A figure beside its limit. Sound when figure <= limit; a figure that isn't a number is unsound.
struct StressFigure {
  std::string check;  ///< "linear field", "no energy from a closed path"
  double figure = 0.0;
  double limit = 0.0;
  std::string detail;  ///< where, for a person; may be empty
  bool sound() const { return figure <= limit; }
};

/// A contact at one moment: what was asked of it and what came of it.
struct ContactMoment {
  std::vector<ContactCell> cells;
  std::vector<Vec3> forces;         ///< on the tissue [N]
  std::vector<Vec3> displacements;  ///< of the cells [m]
  std::vector<Vec3> slips;          ///< of cells with friction, ContactSolution::slips [m]
  std::vector<double> softness;     ///< of each cell alone under its own force [m/N]
  bool converged = false;
  double smallest_eigenvalue = 0.0;  ///< relative
};

/// Why a refusal helps nobody: it is empty, or names nothing to change. Empty: it is clear.
std::string unclear_refusal(const std::string& reason);

/// The body under loads that stretch it linearly answers with that linear field: relative error of
/// the displacement at the touchable places. Limit 1e-9, more for bodies that move far under little
/// (see the source). Also finds rigid motions that cost force.
Result<StressFigure> check_linear_field(const StressBody& body, const Formulation& formulation,
                                        ElasticSolver& solver, const TouchableSurface& touch);

/// Every entry is a finite number: figure is the count of those that aren't.
StressFigure check_finite(const SurfaceCompliance& compliance);

/// f.C f >= 0 for all f, by all eigenvalues: figure is the least one over the Frobenius norm, sign
/// turned, where it lies below what storing in single precision explains. Also that a compliance
/// said to be symmetric is so to the last bit.
StressFigure check_positive(const SurfaceCompliance& compliance);

/// Displacement by the stored compliance against the solver's own in double precision under the
/// same loads on some samples, relative to the greatest displacement.
Result<StressFigure> check_against_solver(ElasticSolver& solver, const SurfacePlaces& places,
                                          const SurfaceCompliance& compliance, Draws draws);

/// Forces and displacements are finite, pressed cells push along their direction and none pulls,
/// none is penetrated, held ones are where they were put.
StressFigure check_conditions(const ContactMoment& moment);

/// Frictionless and held contact on an elastic body has an energy W = f.d / 2 whose gradient is the
/// force, and W is convex: for any two moments a, b of the same cells
///   f_a.(d_b - d_a) <= W_b - W_a <= f_b.(d_b - d_a).
/// Summed around a closed path, nothing is gained. Checked for every pair of the history, so for
/// every closed path through its moments. Figure: greatest violation over the energy exchanged.
StressFigure check_energy(std::span<const ContactMoment> history);

/// Work of the tools around the closed path of held cells by the trapezoidal rule, which is exact
/// there; over the work exchanged.
StressFigure check_closed_path(std::span<const ContactMoment> path);

/// Work of one tool with friction around a closed path from clear of the tissue to clear of it,
/// less what friction took; `way` is the tool's displacement at each moment (moments) [m]. It is
/// never negative. Figure: what was gained over the work exchanged.
StressFigure check_friction(std::span<const ContactMoment> path, std::span<const Vec3> way);

/// For compliances that promise no energy (unsymmetric): forces and displacements are finite, and
/// where the contact says that it found none there are none. Figure: cells that aren't so.
StressFigure check_honest(const ContactMoment& moment);

/// The greatest stored energy that pushing any of the touchable surface by `depth` can need, from a
/// displacement field that does it (Dirichlet's principle) [J], and the least, from a force that
/// does less (Thomson's); see the source. For symmetric formulations held by Nitsche's method.
class EnergyBound {
 public:
  EnergyBound(const StressBody& body, const TouchableSurface& touch,
              const SurfaceCompliance& compliance);
  /// A tool whose cells share one direction, alone.
  StressFigure pressed(const ContactMoment& moment) const;
  /// Held cells that all move by the same displacement.
  StressFigure held(const ContactMoment& moment) const;
  /// Either of these: their force and energy from below.
  StressFigure least(const ContactMoment& moment) const;

 private:
  IsotropicMaterial material_;
  double softest_ = 0.0;  ///< greatest displacement of a touchable place under its own force [m/N]
  double shift_ = 0.0;    ///< energy of moving the whole body through its hold, x 2 [J/m2]
  double stretch_ =
      0.0;  ///< of stretching it linearly from its plane base; infinite without [J/m2]
};

/// Same moment reached by another way: relative difference of the force on all cells together.
StressFigure check_same_force(const ContactMoment& one, const ContactMoment& other,
                              std::string check);

}  // namespace viscera
