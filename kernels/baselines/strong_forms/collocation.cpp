#include "kernels/baselines/strong_forms/collocation.h"

#include <sstream>

#include "kernels/base/parallel.h"
#include "kernels/base/stopwatch.h"
#include "kernels/baselines/strong_forms/sparse_lu.h"
#include "kernels/paff/compliance_checks.h"
#include "kernels/paff/compliance_columns.h"
#include "kernels/paff/nodal_measures.h"
#include "kernels/paff/problem_checks.h"

namespace viscera {
namespace {

enum class RowKind : char { kHeld, kTraction, kBalance };

constexpr std::size_t kChunk = 32;

/// Where a node stands, for messages [mm].
std::string place_of(const PointCloud& cloud, std::size_t node) {
  std::ostringstream text;
  text << "node " << node << " at (" << (cloud.positions[node] * 1e3).transpose() << ") mm";
  return text.str();
}

/// Everything about a body's rows but their derivatives.
struct Rows {
  std::vector<RowKind> kinds;
  std::vector<double> spacings, scales;  ///< h_i [m]; what a row is multiplied by
  std::vector<double> extents;           ///< A_i [m2] or V_i [m3] of the row; 0 for a held node
  std::vector<Vec3> positions;
  SurfacePatches patches;
  double fixed_area = 0.0;

  std::size_t size() const { return kinds.size(); }
  /// Depth of the layer that a traction row balances [m].
  double layer(std::size_t i) const {
    if (kinds[i] != RowKind::kTraction) return 0.0;
    return 0.5 * spacings[i] * patches.mean_normal(i).squaredNorm();
  }
};

Result<Rows> classify(const ElasticProblem& problem) {
  const PointCloud& cloud = *problem.cloud;
  Result<std::vector<double>> volumes = nodal_volumes(*problem.surface, cloud);
  if (!volumes) return std::unexpected(volumes.error());
  Rows rows{std::vector<RowKind>(cloud.size(), RowKind::kBalance),
            cloud.spacings,
            std::vector<double>(cloud.size()),
            std::move(*volumes),
            cloud.positions,
            SurfacePatches(*problem.surface, cloud)};
  const double modulus = problem.material.lame_lambda() + 2.0 * problem.material.shear_modulus();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double h = cloud.spacings[i];
    rows.scales[i] = h * h / modulus;
    if (i < cloud.surface_count) {
      const double area = rows.patches.area(i);
      if (problem.is_fixed(cloud.positions[i])) {
        rows.kinds[i] = RowKind::kHeld;
        rows.scales[i] = 1.0;
        rows.extents[i] = 0.0;
        rows.fixed_area += area;
        continue;
      }
      // A fold whose sides cancel has no normal to stand for them.
      constexpr double kLeastNormal = 0.1;
      if (!(rows.patches.mean_normal(i).norm() > kLeastNormal)) {
        return failure("surface: " + place_of(cloud, i) +
                       " has no patch of surface with a normal of its own (another node stands on "
                       "it, or the body is a sheet there); expected one: use a smaller node "
                       "spacing, or \"galerkin\"");
      }
      rows.kinds[i] = RowKind::kTraction;
      rows.scales[i] = h / modulus;
      rows.extents[i] = area;
    } else if (!(rows.extents[i] > 0.0)) {
      return failure("nodes: " + place_of(cloud, i) +
                     " stands for no volume; expected nodes evenly spread: use another spacing");
    }
  }
  if (!(rows.fixed_area > 0.0)) {
    return failure(
        "fixed region: it holds none of the " + std::to_string(cloud.surface_count) +
        " nodes on the surface; expected at least one: make the region larger, or the node "
        "spacing smaller");
  }
  return rows;
}

/// -div sigma of alpha_j e_k, all k: -[(lambda + mu) H + mu tr(H) I].
Mat3 balance_block(const IsotropicMaterial& material, const Mat3& hessian) {
  const double lambda = material.lame_lambda(), mu = material.shear_modulus();
  return -(lambda + mu) * hessian - mu * hessian.trace() * Mat3::Identity();
}

/// sigma n of alpha_j e_k, all k: lambda n g^T + mu g n^T + mu (g . n) I.
Mat3 traction_block(const IsotropicMaterial& material, const Vec3& normal, const Vec3& gradient) {
  const double lambda = material.lame_lambda(), mu = material.shear_modulus();
  return lambda * normal * gradient.transpose() + mu * gradient * normal.transpose() +
         mu * gradient.dot(normal) * Mat3::Identity();
}

struct ChunkOfRows {
  std::vector<std::size_t> counts;
  std::vector<int> columns;
  std::vector<Mat3> blocks;
  std::string mistake;
};

void assemble_chunk(const Rows& rows, const IsotropicMaterial& material,
                    const NodeStencils& stencils, bool stabilised_tractions, std::size_t first,
                    std::size_t last, ChunkOfRows& out) {
  NodeStencil stencil;
  for (std::size_t i = first; i < last; ++i) {
    if (const Result<void> found = stencils(static_cast<int>(i), stencil); !found) {
      out.mistake = found.error().text();
      return;
    }
    const double layer = stabilised_tractions ? rows.layer(i) : 0.0;
    for (std::size_t j = 0; j < stencil.nodes.size(); ++j) {
      Mat3 block = Mat3::Identity() * stencil.values[j];
      if (rows.kinds[i] == RowKind::kBalance) block = balance_block(material, stencil.hessians[j]);
      if (rows.kinds[i] == RowKind::kTraction) {
        block = traction_block(material, rows.patches.mean_normal(i), stencil.gradients[j]);
        if (layer > 0.0) block += layer * balance_block(material, stencil.hessians[j]);
      }
      out.columns.push_back(stencil.nodes[j]);
      out.blocks.push_back(rows.scales[i] * block);
    }
    out.counts.push_back(stencil.nodes.size());
  }
}

Result<BlockRows> assemble(const Rows& rows, const IsotropicMaterial& material,
                           const NodeStencils& stencils, bool stabilised_tractions) {
  std::vector<ChunkOfRows> chunks((rows.size() + kChunk - 1) / kChunk);
  parallel_chunks(rows.size(), kChunk, [&](std::size_t first, std::size_t last) {
    assemble_chunk(rows, material, stencils, stabilised_tractions, first, last,
                   chunks[first / kChunk]);
  });
  BlockRows all;
  for (const ChunkOfRows& chunk : chunks) {
    if (!chunk.mistake.empty()) return failure(chunk.mistake);
    for (const std::size_t count : chunk.counts) {
      all.row_begin.push_back(all.row_begin.back() + count);
    }
    all.columns.insert(all.columns.end(), chunk.columns.begin(), chunk.columns.end());
    all.blocks.insert(all.blocks.end(), chunk.blocks.begin(), chunk.blocks.end());
  }
  return all;
}

class CollocationSolver final : public ElasticSolver {
 public:
  CollocationSolver(const Formulation& formulation, Rows rows, bool stabilised_tractions,
                    BlockRows matrix, SparseLu factor, const PreparationFigures& figures)
      : formulation_(formulation),
        rows_(std::move(rows)),
        stabilised_tractions_(stabilised_tractions),
        matrix_(std::move(matrix)),
        factor_(std::move(factor)),
        figures_(figures) {}

  Result<void> solve(std::span<double> loads, int columns) override {
    for (std::size_t at = 0; at < loads.size(); ++at) {
      loads[at] *= load_scale((at / 3) % rows_.size());
    }
    return factor_.solve(loads, columns);
  }

  Result<std::vector<double>> solve_static(const StaticLoads& loads) override {
    std::vector<double> unknowns(figures_.unknowns, 0.0);
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      Vec3::Map(unknowns.data() + 3 * i) = rows_.scales[i] * right_hand_side(loads, i);
    }
    const std::vector<double> load = unknowns;
    if (const Result<void> solved = factor_.solve(unknowns, 1); !solved) {
      return std::unexpected(solved.error());
    }
    // Near incompressibility round-off would show: once is enough.
    std::vector<double> change = matrix_.residual(load, unknowns);
    if (const Result<void> solved = factor_.solve(change, 1); !solved) {
      return std::unexpected(solved.error());
    }
    for (std::size_t i = 0; i < unknowns.size(); ++i) unknowns[i] += change[i];
    return unknowns;
  }

  Result<SurfaceCompliance> compliance(const SparseWeights& places, std::vector<int> touchable,
                                       const Progress& progress) override {
    const Stopwatch watch;
    auto compliance = compliance_columns(
        rows_.size(), places, std::move(touchable),
        [&](SparseLoads& loads, std::span<double> out) {
          for (std::size_t e = 0; e < loads.values.size(); ++e) {
            loads.values[e] *= load_scale(static_cast<std::size_t>(loads.unknowns[e]) / 3);
          }
          return factor_.solve_sparse(loads.begin, loads.unknowns, loads.values, out);
        },
        progress);
    if (compliance) {
      figures_.smallest_compliance_eigenvalue = smallest_compliance_eigenvalue(*compliance);
      const auto accepted =
          accept_compliance(formulation_, figures_.smallest_compliance_eigenvalue);
      if (!accepted) compliance = std::unexpected(accepted.error());
    }
    figures_.compliance_s += watch.seconds();
    return compliance;
  }

  const PreparationFigures& figures() const override { return figures_; }

 private:
  /// From 1 N at the node to the scaled row.
  double load_scale(std::size_t node) const {
    return rows_.extents[node] > 0.0 ? rows_.scales[node] / rows_.extents[node] : 0.0;
  }

  Vec3 right_hand_side(const StaticLoads& loads, std::size_t i) const {
    const Vec3& x = rows_.positions[i];
    Vec3 right = Vec3::Zero();
    switch (rows_.kinds[i]) {
      case RowKind::kHeld:
        if (loads.held_displacement) right = loads.held_displacement(x);
        break;
      case RowKind::kBalance:
        if (loads.body_force) right = loads.body_force(x);
        break;
      case RowKind::kTraction:
        if (loads.traction) {
          right = rows_.patches.mean(i, [&](const Vec3& n) { return loads.traction(x, n); });
        }
        if (stabilised_tractions_ && loads.body_force) {
          right += rows_.layer(i) * loads.body_force(x);
        }
        break;
    }
    return right;
  }

  const Formulation& formulation_;
  Rows rows_;
  bool stabilised_tractions_;
  BlockRows matrix_;
  SparseLu factor_;
  PreparationFigures figures_;
};

}  // namespace

void NodeStencil::resize(std::size_t count) {
  nodes.resize(count);
  values.resize(count);
  gradients.resize(count);
  hessians.resize(count);
}

Result<std::unique_ptr<ElasticSolver>> prepare_collocation(const Formulation& formulation,
                                                           const ElasticProblem& problem,
                                                           const CollocationRules& rules,
                                                           const Progress& progress) {
  constexpr double kAssemblyShare = 0.3;
  const Stopwatch assembly;
  if (std::vector<std::string> mistakes = problem_mistakes(problem); !mistakes.empty()) {
    Error error;
    error.messages = std::move(mistakes);
    return std::unexpected(error);
  }
  if (!progress(0.0, "measuring nodes")) return failure(kCancelled);
  Result<Rows> rows = classify(problem);
  if (!rows) return std::unexpected(rows.error());
  if (!progress(0.5 * kAssemblyShare, "assembling")) return failure(kCancelled);
  Result<BlockRows> matrix =
      assemble(*rows, problem.material, rules.stencils(*problem.cloud), rules.stabilised_tractions);
  if (!matrix) return std::unexpected(matrix.error());
  PreparationFigures figures;
  figures.unknowns = 3 * rows->size();
  figures.stiffness_nonzeros = matrix->nonzeros();
  figures.fixed_area = rows->fixed_area;
  figures.assemble_s = assembly.seconds();

  if (!progress(kAssemblyShare, "factoring")) return failure(kCancelled);
  const Stopwatch factoring;
  Result<SparseLu> factor = SparseLu::factor(*matrix, "collocation matrix");
  if (!factor) return std::unexpected(factor.error());
  figures.factor_s = factoring.seconds();
  figures.factor_bytes = factor->factor_bytes();
  if (!progress(1.0, "factoring")) return failure(kCancelled);
  return std::make_unique<CollocationSolver>(formulation, std::move(*rows),
                                             rules.stabilised_tractions, std::move(*matrix),
                                             std::move(*factor), figures);
}

}  // namespace viscera
