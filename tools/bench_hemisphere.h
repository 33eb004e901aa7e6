// `viscera bench hemisphere`: time against error on the body of the reference, for every
// formulation, with the figures to reach.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "engine/verification/hemisphere_reference.h"
#include "kernels/base/result.h"
#include "tools/bench_figures.h"

namespace viscera {

struct HemisphereBenchOptions {
  bool quick = false;                 ///< under two minutes
  bool peers = false;                 ///< finite elements and Bullet on the same hemisphere
  std::filesystem::path json, plots;  ///< empty: none is written
  // Named cases alone; empty: the benchmark's own choice.
  std::vector<std::string> formulations;
  std::vector<std::size_t> nodes;
  std::vector<double> poisson_ratios;
  std::vector<double> radii;  ///< a / R
  std::vector<std::string> contacts;
  bool graded = false;           ///< nodes finer about the pole
  double touchable_zone = 0.75;  ///< see HemisphereOptions

  bool names_cases() const {
    return !formulations.empty() || !nodes.empty() || !poisson_ratios.empty() || !radii.empty() ||
           !contacts.empty();
  }
};

/// One line of the table; the keys of the JSON have the same names.
struct HemisphereCase {
  std::string formulation;  ///< or a peer: calculix_t4, calculix_t10, bullet
  std::string variant;      ///< of a peer: "graded"
  std::string basis;        ///< linear, quadratic
  std::size_t nodes = 0, surface_nodes = 0;
  double poisson = 0.0, a_over_R = 0.0;
  std::string contact;
  std::size_t cells = 0;   ///< of the contact patch
  double prepare_s = 0.0;  ///< from the surface to the compliance, no cache
  std::optional<double> assemble_s, factor_s, compliance_s;
  std::optional<double> online_us;  ///< contact and displacement of all visible nodes, one core
  std::optional<double> online_moving_us;  ///< the same for a patch that is elsewhere each time
  std::optional<double> force_over_ERdelta, force_error, profile_error;
  /// Against our own axisymmetric solution, where there is no reference.
  std::optional<double> own_force_error, own_profile_error;
  double compliance_eigenvalue = 0.0;  ///< smallest of sym(C_nn) over its largest, whole surface
  std::optional<double> smallest_eigenvalue;  ///< of the patch's compliance over its largest
  std::size_t memory_bytes = 0;               ///< that stay for running
  std::optional<std::size_t> factor_bytes;
  std::vector<Vec3> profile;       ///< rest and
  std::vector<Vec3> displacement;  ///< its displacement, over R; not in the JSON
  std::string note;
  bool in_plots = true;
};

/// Runs the cases, prints them with targets and writes JSON and plots. Fails where a named case
/// can't be run, or on Ctrl-C.
Result<void> bench_hemisphere(const HemisphereBenchOptions& options, std::ostream& out);

}  // namespace viscera
