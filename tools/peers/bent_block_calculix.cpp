#include "tools/peers/bent_block_calculix.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "engine/io/atomic_file.h"
#include "tools/common/bench_figures.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

/// Nodes lie on a lattice of half an element.
struct Lattice {
  std::array<int, 3> last;  ///< greatest index along each axis
  Vec3 size;

  int number(const std::array<int, 3>& at) const {
    return at[0] + (last[0] + 1) * (at[1] + (last[1] + 1) * at[2]) + 1;
  }
  std::size_t nodes() const {
    std::size_t count = 1;
    for (const int most : last) count *= static_cast<std::size_t>(most + 1);
    return count;
  }
};

void write_nodes(const Lattice& lattice, std::string& text) {
  text += "*NODE, NSET=ALL\n";
  for (int k = 0; k <= lattice.last[2]; ++k)
    for (int j = 0; j <= lattice.last[1]; ++j)
      for (int i = 0; i <= lattice.last[0]; ++i) {
        const std::array<int, 3> at = {i, j, k};
        text += std::to_string(lattice.number(at));
        for (std::size_t c = 0; c < 3; ++c)
          text += fmt::format(",{:.12e}", lattice.size[static_cast<Eigen::Index>(c)] *
                                              (static_cast<double>(at[c]) / lattice.last[c] - 0.5));
        text += '\n';
      }
}

/// Six tetrahedra about the diagonal of each cube, one for each order of the axes.
void write_elements(const Lattice& lattice, std::string& text) {
  text += "*ELEMENT, TYPE=C3D10, ELSET=BODY\n";
  int element = 0;
  for (int k = 0; k < lattice.last[2]; k += 2)
    for (int j = 0; j < lattice.last[1]; j += 2)
      for (int i = 0; i < lattice.last[0]; i += 2) {
        std::array<std::size_t, 3> order = {0, 1, 2};
        do {
          std::array<std::array<int, 3>, 4> corners;
          corners.fill({i, j, k});
          for (std::size_t c = 1; c < 4; ++c) {
            corners[c] = corners[c - 1];
            corners[c][order[c - 1]] += 2;
          }
          const bool even = (order[1] + 3 - order[0]) % 3 == 1;
          if (!even) std::swap(corners[1], corners[2]);
          text += std::to_string(++element);
          for (const auto& corner : corners) text += fmt::format(",{}", lattice.number(corner));
          for (const auto& [a, b] :
               {std::pair(0u, 1u), {1u, 2u}, {2u, 0u}, {0u, 3u}, {1u, 3u}, {2u, 3u}}) {
            std::array<int, 3> middle;
            for (std::size_t c = 0; c < 3; ++c) middle[c] = (corners[a][c] + corners[b][c]) / 2;
            text += fmt::format(",{}", lattice.number(middle));
          }
          text += '\n';
        } while (std::next_permutation(order.begin(), order.end()));
      }
}

void write_end(const Lattice& lattice, const char* name, int i, std::string& text) {
  text += fmt::format("*NSET, NSET={}\n", name);
  for (int k = 0; k <= lattice.last[2]; ++k)
    for (int j = 0; j <= lattice.last[1]; ++j)
      text += fmt::format("{},\n", lattice.number({i, j, k}));
}

/// CalculiX knows the law as the sum of three terms of its HYPERFOAM,
///   2 mu_i / alpha_i^2 (sum_k lambda_k^alpha_i - 3 + (J^(-alpha_i beta_i) - 1) / beta_i),
/// with beta_i = nu_i / (1 - 2 nu_i). With alpha 2 and beta -1 the first is
/// mu/2 (|F|^2 - 3 - (J^2 - 1)); the other two, with alpha 1, beta -1 and -2 and opposite moduli,
/// are (lambda + 2 mu)/2 (J - 1)^2; the sum is the law of kernels/finite/finite_body.h.
void write_law(const IsotropicMaterial& material, std::string& text) {
  const double mu = material.shear_modulus();
  const double volume = 0.5 * (material.lame_lambda() + 2.0 * mu);
  text += fmt::format(
      "*MATERIAL, NAME=TISSUE\n*HYPERFOAM, N=3\n"
      "{:.12e},2.,{:.12e},1.,{:.12e},1.,1.,1.\n{:.15f}\n",
      mu, volume, -volume, 2.0 / 3.0);
}

std::string input(const Lattice& lattice, const BentBlockOptions& options) {
  std::string text;
  write_nodes(lattice, text);
  write_elements(lattice, text);
  write_end(lattice, "HELD", 0, text);
  write_end(lattice, "MOVED", lattice.last[0], text);
  write_law(options.material, text);
  text += "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE\n";
  text += "*STEP, NLGEOM, INC=100\n*STATIC\n.1,1.\n*BOUNDARY\nHELD,1,3\n";
  for (int axis = 1; axis <= 3; ++axis)
    text += fmt::format("MOVED,{0},{0},{1:.12e}\n", axis, options.moved[axis - 1]);
  text += "*NODE PRINT, NSET=MOVED, TOTALS=ONLY\nRF\n*END STEP\n";
  return text;
}

/// The last total force of a .dat file.
Result<Vec3> last_force(const fs::path& path) {
  std::ifstream file(path);
  bool next = false, found = false;
  Vec3 force = Vec3::Zero();
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    Vec3 read;
    if (line.find("total force") != std::string::npos)
      next = true;
    else if (next && words >> read.x() >> read.y() >> read.z()) {
      force = read;
      found = true;
      next = false;
    }
  }
  if (!found) return failure(path.string() + ": found no total force, expected one");
  return force;
}

}  // namespace

bool calculix_installed() {
  return run_program({"ccx", "-v"}).code >= 0;
}

Result<BentBlockByCalculix> bend_by_calculix(const BentBlockOptions& options, int elements,
                                             const fs::path& folder) {
  Lattice lattice;
  lattice.size = options.size;
  const double edge = options.size.x() / elements;
  for (std::size_t c = 0; c < 3; ++c)
    lattice.last[c] = 2 * std::max(1, static_cast<int>(std::lround(
                                          options.size[static_cast<Eigen::Index>(c)] / edge)));
  std::error_code ignored;
  fs::remove(folder / "block.dat", ignored);
  if (auto written = write_file(folder / "block.inp", input(lattice, options)); !written)
    return std::unexpected(written.error());
  const CommandResult done = run_program({"ccx", "-i", "block"}, folder / "ccx.log", folder);
  if (done.code != 0) return failure(fmt::format("CalculiX failed with code {}", done.code));
  auto force = last_force(folder / "block.dat");
  if (!force) return std::unexpected(force.error());
  return BentBlockByCalculix{lattice.nodes(), *force};
}

}  // namespace viscera
