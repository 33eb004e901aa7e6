// One line of `viscera bench hemisphere`: what was measured, how it is printed and stored.
#pragma once

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// Errors are to be reached with this many nodes at most.
inline constexpr std::size_t kNodesToReach = 1100;

/// The keys of the JSON have the same names.
struct HemisphereCase {
  std::string formulation;  ///< or a peer: calculix_t4, calculix_t10, bullet
  std::string variant;  ///< "pinned": surface nodes are moved, wherever they are; of a peer also
                        ///< "graded", "fitted" (the contact's rim is in the mesh), "linear"
  std::string basis;    ///< linear, quadratic
  std::size_t nodes = 0, surface_nodes = 0;
  double poisson = 0.0, a_over_R = 0.0;
  std::string contact;
  std::size_t cells = 0;               ///< of the contact patch
  double prepare_s = 0.0;              ///< from the surface to what `prepares` says, no cache
  std::string prepares = "all loads";  ///< then a load costs online_us; "the mesh", "the body":
                                       ///< then each load is solved, or stepped to rest, afresh
  std::optional<double> assemble_s, factor_s, compliance_s;
  std::optional<double> online_us;  ///< contact and displacement of the whole surface, one core; of
                                    ///< peers the wall time of a process, or a step
  std::optional<double> own_us;     ///< what the peer itself says a solution takes in one process
  std::optional<double> online_moving_us;  ///< the same for a patch that is elsewhere each time
  double more_s = 0.0;  ///< to the first answer, beside prepare_s and online_us: steps to rest [s]
  std::optional<double> force_over_ERdelta, force_error, profile_error;
  /// Against our own axisymmetric solution, where there is no reference.
  std::optional<double> own_force_error, own_profile_error;
  double compliance_eigenvalue = 0.0;  ///< smallest of sym(C_nn) over its largest, whole surface
  std::optional<double> smallest_eigenvalue;  ///< of the patch's compliance over its largest
  std::size_t memory_bytes = 0;               ///< that stay for running
  std::optional<std::size_t> factor_bytes;
  std::vector<Vec3> profile;       ///< rest and
  std::vector<Vec3> displacement;  ///< its displacement, over R; not in the JSON
  bool converged = true;
  std::string note;
  bool in_plots = true;
};

/// From the surface to the first answer [s].
double first_answer_s(const HemisphereCase& one);

/// Against the data's reference, else against our own solution.
std::optional<double> any_force_error(const HemisphereCase& one);
std::optional<double> any_profile_error(const HemisphereCase& one);

void print_heading(std::ostream& out);
/// With the targets that the case misses.
void print_case(const HemisphereCase& one, std::ostream& out);
nlohmann::json to_json(const HemisphereCase& one);

}  // namespace viscera
