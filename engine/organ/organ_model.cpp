#include "engine/organ/organ_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include "engine/io/factor_file.h"
#include "engine/io/report.h"
#include "engine/io/response_cache.h"
#include "engine/organ/shape.h"
#include "kernels/base/hash.h"
#include "kernels/base/stopwatch.h"
#include "kernels/formulations/formulations.h"
#include "kernels/paff/compliance_checks.h"
#include "kernels/paff/compliance_columns.h"
#include "kernels/paff/stiffness_factor.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

/// Raised when pre-processing changes in a way that its inputs don't show: node placement,
/// sampling.
constexpr int kPreparationVersion = 3;

/// The stages of preparation and their shares of its time, for the progress bar.
constexpr double kShapeDone = 0.10, kCloudDone = 0.20, kFactorDone = 0.45, kComplianceDone = 0.75;

/// What is kept for tissue that may coagulate takes no more than this; where it would, tissue
/// farther from the burns is left out in steps of `kNarrower` [bytes].
constexpr std::size_t kMostChangeable = 200'000'000;
constexpr double kNarrower = 0.85;

Progress part_of(const Progress& progress, double from, double to) {
  return [=, &progress](double fraction, std::string_view what) {
    return progress(from + fraction * (to - from), what);
  };
}

void hash_vector(Hasher& hasher, const Vec3& v) {
  for (int c = 0; c < 3; ++c) hasher.value(v[c]);
}

void hash_region(Hasher& hasher, const Region& region) {
  hasher.value(region.shape).value(region.radius);
  hash_vector(hasher, region.a);
  hash_vector(hasher, region.b);
}

bool in_any(const std::vector<Region>& regions, const Vec3& x) {
  return std::any_of(regions.begin(), regions.end(),
                     [&](const Region& region) { return region.contains(x); });
}

Result<PointCloud> place_cloud(const OrganDescription& organ, const TriangleSurface& surface,
                               const BodyDemand& demand, const Progress& progress) {
  const SurfaceTree tree(surface);
  const Resolution& r = organ.resolution;
  return place_nodes(
      surface, tree,
      graded_spacing(r.spacing, r.finest, r.gradient, vertices_in(demand.fine, surface)), {},
      progress);
}

/// Fills what follows from surface and cloud alone: kept out of the cache because it takes less
/// time to compute than to read.
Result<void> finish(OrganModel& model, const OrganDescription& organ, const BodyDemand& demand) {
  const Formulation* formulation = find_formulation(organ.formulation);
  const ShapeFunctions fields = formulation->fields(model.cloud);
  auto places = place_on_surface(model.surface, fields);
  if (!places) return std::unexpected(places.error());
  model.places = std::move(*places);
  // All of the surface: a tool may leave its path. What only sags has no place to touch.
  if (demand.touched) {
    auto touchable = touchable_part(model.places, [](const Vec3&) { return true; });
    if (!touchable) return std::unexpected(touchable.error());
    model.touchable = std::move(*touchable);
  }
  model.drawn = carry_surface(model.surface, model.places);
  model.finest_spacing =
      *std::min_element(model.cloud.spacings.begin(), model.cloud.spacings.end());
  return {};
}

// Counted: a nested-dissection factor of a 3-D body grows as N^(4/3); 1.5e8 numbers at 12,200 nodes
// of a cube, fewer below.
double factor_entries(double nodes) {
  return 550.0 * std::pow(nodes, 4.0 / 3.0);
}

std::size_t compliance_bytes(std::size_t places, std::size_t touchable) {
  return 9 * places * touchable * sizeof(float);
}

/// Peak beyond the surface while a compliance is computed [bytes]: quadrature and its fields (66 kB
/// a node, measured) and the factor in single precision with the fronts that wait for their
/// parents; then the compliance in the order of elimination and in that of the nodes, with the copy
/// of its square that is checked.
std::size_t preparation_bytes(std::size_t nodes, std::size_t places, std::size_t touchable) {
  constexpr double kWaitingFronts = 0.8;  // of the factor
  const double n = static_cast<double>(nodes);
  const double assembly = 66e3 * n;
  const double factor = 4.0 * (1.0 + kWaitingFronts) * factor_entries(n) + 9e3 * n;
  const std::size_t square = compliance_bytes(touchable, touchable);
  return 2 * compliance_bytes(places, touchable) + square +
         static_cast<std::size_t>(assembly + factor);
}

/// Refuses what this machine can't hold, before minutes are spent on it.
Result<void> check_memory(const OrganModel& model, std::size_t touchable) {
  const std::size_t nodes = model.cloud.size();
  const std::size_t needed = preparation_bytes(nodes, model.places.size(), touchable);
  const std::uint64_t present = this_machine().memory_bytes;
  if (needed <= present) return {};
  return failure(fmt::format(
      "resolution: found spacings that make {} nodes and columns for {} places, and need {:.1f} GB "
      "while preparing, expected at most this machine's {:.1f} GB: raise finest_spacing_mm",
      nodes, touchable, 1e-9 * static_cast<double>(needed), 1e-9 * static_cast<double>(present)));
}

void set_surface(OrganModel& model, TriangleSurface surface) {
  model.surface = std::move(surface);
  model.rest_bounds = bounds(model.surface);
  model.rest_positions.reserve(model.surface.vertices.size());
  for (const Vec3& v : model.surface.vertices) model.rest_positions.push_back(v.cast<float>());
  for (const Vec3& n : vertex_normals(model.surface)) model.rest_normals.push_back(n.cast<float>());
}

/// Vectors and indices as the cache keeps them, and back.
std::vector<double> flat(const std::vector<Vec3>& vectors) {
  std::vector<double> numbers;
  for (const Vec3& v : vectors) numbers.insert(numbers.end(), v.data(), v.data() + 3);
  return numbers;
}
std::vector<Vec3> vectors(const std::vector<double>& numbers) {
  std::vector<Vec3> all;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    all.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return all;
}

/// The columns that are there, packed.
SurfaceCompliance made_part(const SurfaceCompliance& compliance) {
  SurfaceCompliance part;
  part.places = compliance.places;
  part.symmetric = compliance.symmetric;
  part.touchable = compliance.on_demand->made();
  const auto three = static_cast<std::ptrdiff_t>(3 * compliance.rows());
  part.columns.reserve(part.touchable.size() * static_cast<std::size_t>(three));
  for (const int place : part.touchable) {
    const auto from = compliance.columns.begin() + place * three;
    part.columns.insert(part.columns.end(), from, from + three);
  }
  return part;
}

/// Room for all columns of the whole surface, which that factor will make.
SurfaceCompliance columns_to_come(const OrganModel& model,
                                  std::shared_ptr<const StiffnessFactor> factor) {
  SurfaceCompliance compliance;
  compliance.places = model.places.size();
  compliance.touchable = model.touchable.places;
  compliance.columns.resize(compliance.rows() * compliance.rows());
  compliance.on_demand = std::make_shared<ColumnsOnDemand>(
      StiffnessFactor::columns(std::move(factor), model.places.fields),
      compliance.touchable.size());
  return compliance;
}

/// Whether columns are left to be made when they are asked for.
bool comes_on_demand(const OrganModel& model, const OrganDescription& organ,
                     std::size_t column_budget) {
  // Half precision needs the greatest entry of all.
  return compliance_bytes(model.places.size(), model.touchable.size()) > column_budget &&
         organ.displacement_storage == DisplacementStorage::kSingle &&
         find_formulation(organ.formulation)->keeps_factor();
}

/// Touchable places whose columns preparation makes, by their indices.
std::vector<int> prepared_places(const OrganModel& model, const OrganDescription& organ,
                                 const BodyDemand& demand, std::size_t column_budget) {
  const bool all = !comes_on_demand(model, organ, column_budget);
  std::vector<Region> fine;
  for (const Region& region : demand.fine) fine.push_back(region.grown(organ.resolution.finest));
  std::vector<int> places;
  for (std::size_t t = 0; t < model.touchable.size(); ++t)
    if (all || in_any(fine, model.touchable.positions[t])) places.push_back(static_cast<int>(t));
  return places;
}

using CacheArrays = std::map<std::string, CacheData::Array>;

void keep_changeable(const ChangeableRegion& region, CacheArrays& arrays) {
  const ElasticRegion& tissue = region.tissue;
  arrays["change_moduli"] =
      std::vector<double>{tissue.shear_modulus, tissue.pointwise_lambda, tissue.averaged_lambda};
  arrays["change_nodes"] = tissue.nodes;
  arrays["change_positions"] = flat(tissue.positions);
  arrays["change_weights"] = tissue.weights;
  arrays["change_begin"] = std::vector<int>(tissue.begin.begin(), tissue.begin.end());
  arrays["change_point_nodes"] = tissue.point_nodes;
  arrays["change_gradients"] = flat(tissue.gradients);
  arrays["change_cell"] = tissue.cell;
  arrays["change_psi"] = tissue.psi;
  arrays["change_cell_begin"] =
      std::vector<int>(tissue.cell_begin.begin(), tissue.cell_begin.end());
  arrays["change_cell_nodes"] = tissue.cell_nodes;
  arrays["change_cell_gradients"] = flat(tissue.cell_gradients);
  arrays["change_places"] = region.places;
  arrays["change_compliance"] = region.nodes;
}

/// Empty where there is none, or not of a piece.
ChangeableRegion changeable_from_cache(CacheArrays& arrays) {
  ChangeableRegion region;
  bool whole = true;
  const auto take = [&](const char* name, auto& into) {
    using Into = std::remove_reference_t<decltype(into)>;
    const auto found = arrays.find(name);
    auto* values = found == arrays.end() ? nullptr : std::get_if<Into>(&found->second);
    if (values) into = std::move(*values);
    whole = whole && values;
  };
  ElasticRegion& tissue = region.tissue;
  std::vector<double> moduli, positions, gradients, cell_gradients;
  std::vector<int> begin, cell_begin;
  take("change_moduli", moduli);
  take("change_nodes", tissue.nodes);
  take("change_positions", positions);
  take("change_weights", tissue.weights);
  take("change_begin", begin);
  take("change_point_nodes", tissue.point_nodes);
  take("change_gradients", gradients);
  take("change_cell", tissue.cell);
  take("change_psi", tissue.psi);
  take("change_cell_begin", cell_begin);
  take("change_cell_nodes", tissue.cell_nodes);
  take("change_cell_gradients", cell_gradients);
  take("change_places", region.places);
  take("change_compliance", region.nodes);
  if (!whole || moduli.size() != 3) return {};
  tissue.shear_modulus = moduli[0];
  tissue.pointwise_lambda = moduli[1];
  tissue.averaged_lambda = moduli[2];
  tissue.positions = vectors(positions);
  tissue.gradients = vectors(gradients);
  tissue.cell_gradients = vectors(cell_gradients);
  tissue.begin.assign(begin.begin(), begin.end());
  tissue.cell_begin.assign(cell_begin.begin(), cell_begin.end());
  const std::size_t columns = 3 * tissue.nodes.size(), points = tissue.size();
  if (columns == 0 || tissue.weights.size() != points || tissue.begin.size() != points + 1 ||
      tissue.begin.back() != tissue.gradients.size() ||
      tissue.point_nodes.size() != tissue.gradients.size() || tissue.cell_begin.empty() ||
      ElasticRegion::kTerms * tissue.cell_begin.back() != tissue.cell_gradients.size() ||
      tissue.cell_nodes.size() != tissue.cell_begin.back() ||
      (!tissue.cell.empty() && tissue.cell.size() != points) ||
      tissue.psi.size() != ElasticRegion::kTerms * tissue.cell.size() ||
      region.nodes.size() != columns * columns || region.places.size() % columns != 0)
    return {};
  region.rows = region.places.size() / columns;
  return region;
}

/// `said`: the notes that preparing its elasticity left.
PreparedResponse to_cache(const OrganModel& model, std::span<const std::string> said) {
  PreparedResponse stored;
  stored.cloud = model.cloud;
  stored.compliance = model.compliance.on_demand ? made_part(model.compliance) : model.compliance;
  stored.figures = model.figures;
  if (!model.sag.empty()) stored.extra["sag"] = model.sag;
  if (!model.changeable.empty()) keep_changeable(model.changeable, stored.extra);
  // Text, as the numbers of its characters; one note a line.
  std::vector<int> notes;
  for (const std::string& note : said) {
    notes.insert(notes.end(), note.begin(), note.end());
    notes.push_back('\n');
  }
  if (!notes.empty()) stored.extra["notes"] = std::move(notes);
  return stored;
}

std::vector<std::string> notes_from_cache(PreparedResponse& stored) {
  std::vector<std::string> notes;
  const auto found = stored.extra.find("notes");
  if (found == stored.extra.end()) return notes;
  const auto* letters = std::get_if<std::vector<int>>(&found->second);
  if (!letters) return notes;
  std::string note;
  for (const int c : *letters) {
    if (c != '\n') {
      note += static_cast<char>(c);
    } else {
      notes.push_back(std::move(note));
      note.clear();
    }
  }
  return notes;
}

std::filesystem::path factor_file(const ResponseCache& cache, const std::string& key) {
  return cache.file(key).replace_extension(".factor");
}

/// Only where columns are left to be made from it.
Result<void> save_factor(const ResponseCache& cache, const OrganModel& model,
                         const StiffnessFactor* factor) {
  if (!factor) return {};
  const std::filesystem::path file = factor_file(cache, model.key);
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  if (error) return failure(file.parent_path().string() + ": can't be created: " + error.message());
  return write_factor(file, model.key, *factor);
}

/// Fills `model` from the cache; false when there is nothing usable there.
bool load_cached(const ResponseCache& cache, OrganModel& model, const OrganDescription& organ,
                 const BodyDemand& demand, const PrepareOptions& options,
                 std::vector<std::string>& warnings) {
  CachedResponse cached = cache.load(model.key);
  if (!cached.warning.empty()) warnings.push_back(organ.name + ": cache " + cached.warning);
  if (!cached.response) return false;
  const std::vector<std::string> said = notes_from_cache(*cached.response);
  model.notes.insert(model.notes.end(), said.begin(), said.end());
  model.cloud = std::move(cached.response->cloud);
  model.compliance = std::move(cached.response->compliance);
  model.figures = cached.response->figures;
  if (auto* sag = std::get_if<std::vector<float>>(&cached.response->extra["sag"]))
    model.sag = std::move(*sag);
  model.changeable = changeable_from_cache(cached.response->extra);
  if (!model.deformable() || !finish(model, organ, demand)) return false;
  if (model.sag.size() != (demand.sags ? 9 * model.places.size() : 0)) return false;
  if (!model.changeable.empty() && model.changeable.rows != 3 * model.places.size()) return false;
  if (comes_on_demand(model, organ, options.column_budget)) {
    auto factor = read_factor(factor_file(cache, model.key), model.key);
    if (!factor || factor->nodes() != model.cloud.size()) {
      const Error why =
          factor ? failure("it was made for other nodes").error() : std::move(factor.error());
      warnings.push_back(fmt::format("{}: cache {}: rebuilt because {}", organ.name,
                                     factor_file(cache, model.key).string(), why.text()));
      return false;
    }
    const SurfaceCompliance made = std::move(model.compliance);
    if (made.places != model.places.size()) return false;
    model.compliance =
        columns_to_come(model, std::make_shared<const StiffnessFactor>(std::move(*factor)));
    const std::size_t three = 3 * made.rows();
    for (std::size_t t = 0; t < made.touchable.size(); ++t)
      std::copy_n(
          made.columns.begin() + static_cast<std::ptrdiff_t>(t * three), three,
          model.compliance.columns.begin() +
              static_cast<std::ptrdiff_t>(made.touchable[t]) * static_cast<std::ptrdiff_t>(three));
    model.compliance.on_demand->take_as_made(made.touchable);
    model.compliance.on_demand->end_preparation();
  }
  return model.touchable.places == model.compliance.touchable &&
         model.places.size() == model.compliance.places;
}

/// After the cache, which holds single precision: one file serves both ways to keep it.
void keep_in_half_precision(OrganModel& model) {
  model.half_columns = half_precision(model.compliance);
  model.compliance = force_part(model.compliance);
}

/// Three solves more: the body under its own weight along x, y and z.
Result<void> weigh(OrganModel& model, ElasticSolver& solver, double density) {
  const std::size_t rows = 3 * model.places.size();
  model.sag.resize(3 * rows);
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 weight = density * Vec3::Unit(axis);
    const auto unknowns = solver.solve_static({.body_force = [&](const Vec3&) { return weight; },
                                               .traction = {},
                                               .held_displacement = {}});
    if (!unknowns) return std::unexpected(unknowns.error());
    read_places(model.places.fields, unknowns->data(),
                model.sag.data() + static_cast<std::size_t>(axis) * rows);
  }
  if (!std::all_of(model.sag.begin(), model.sag.end(), [](float u) { return std::isfinite(u); }))
    return failure("gravity: the displacement under its own weight isn't finite");
  return {};
}

/// Whether some point lies within a distance of points that are given: many questions.
class NearPoints {
 public:
  NearPoints(const std::vector<Vec3>& points, double radius) : radius_(radius) {
    for (const Vec3& point : points) cells_[cell_of(point)].push_back(point);
  }
  bool operator()(const Vec3& x, double radius) const {
    const std::array<int, 3> home = cell_of(x);
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        for (int k = -1; k <= 1; ++k) {
          const auto cell = cells_.find({home[0] + i, home[1] + j, home[2] + k});
          if (cell == cells_.end()) continue;
          for (const Vec3& point : cell->second)
            if ((point - x).squaredNorm() < radius * radius) return true;
        }
    return false;
  }

 private:
  std::array<int, 3> cell_of(const Vec3& x) const {
    std::array<int, 3> cell;
    for (int c = 0; c < 3; ++c)
      cell[static_cast<std::size_t>(c)] = static_cast<int>(std::floor(x[c] / radius_));
    return cell;
  }

  double radius_;  // greatest that is asked for
  std::map<std::array<int, 3>, std::vector<Vec3>> cells_;
};

/// Tissue below the surface that may be burnt, as deep as `kMostChangeable` allows. All of the fine
/// part where the organ says where that is: following the burn's path would prepare it again with
/// every key frame. Measured on the main scene, along paths and so: liver 27 and 68 MB, gallbladder
/// 13 and 109 MB; all of its organs' elasticity prepared in 8.1 and 8.9 s.
Result<void> add_changeable(OrganModel& model, ElasticSolver& solver, const BodyDemand& demand,
                            const Progress& progress) {
  const auto* regions = dynamic_cast<const RegionSolver*>(&solver);
  if (!regions) {
    model.notes.push_back(
        "tissue that coagulates stays as soft as it was: only the formulations galerkin "
        "and galerkin_quadratic can follow it");
    return {};
  }
  const NearPoints near(vertices_in(demand.burnt, model.surface), demand.burn_depth);
  for (double depth = demand.burn_depth;; depth *= kNarrower) {
    auto tissue = regions->region([&](const Vec3& x) { return near(x, depth); });
    if (!tissue) return std::unexpected(tissue.error());
    const std::size_t bytes = changeable_bytes(model.places.size(), tissue->nodes.size());
    if (bytes > kMostChangeable) continue;
    if (depth < demand.burn_depth)
      model.notes.push_back(fmt::format(
          "tissue deeper than {:.1f} mm below the fine part of its surface stays as soft as it was "
          "when it coagulates (a whole {:.0f} mm would take more than {:.0f} MB): a smaller "
          "resolution/fine, a greater finest_spacing_mm, or stiffens: false",
          1e3 * depth, 1e3 * demand.burn_depth, 1e-6 * static_cast<double>(kMostChangeable)));
    auto region = changeable_region(solver, std::move(*tissue), model.places.fields, progress);
    if (!region) return std::unexpected(region.error());
    model.changeable = std::move(*region);
    return {};
  }
}

/// `kept` becomes the factor where columns are left to be made from it.
Result<void> compute(OrganModel& model, const OrganDescription& organ, const Tissue& tissue,
                     const BodyDemand& demand, const PrepareOptions& options,
                     const Progress& progress, std::shared_ptr<const StiffnessFactor>& kept) {
  auto cloud = place_cloud(organ, model.surface, demand, part_of(progress, kShapeDone, kCloudDone));
  if (!cloud) return std::unexpected(cloud.error());
  model.cloud = std::move(*cloud);

  if (auto done = finish(model, organ, demand); !done) return done;
  const std::vector<int> prepared = prepared_places(model, organ, demand, options.column_budget);
  if (auto fits = check_memory(model, prepared.size()); !fits) return fits;

  ElasticProblem problem;
  problem.surface = &model.surface;
  problem.cloud = &model.cloud;
  problem.material = model.material;
  problem.is_fixed = [&](const Vec3& x) { return in_any(organ.fixed, x); };
  const Formulation* formulation = find_formulation(organ.formulation);
  auto solver = formulation->prepare(problem, part_of(progress, kCloudDone, kFactorDone));
  if (!solver) return std::unexpected(solver.error());
  if (demand.sags)
    if (auto weighed = weigh(model, **solver, tissue.density); !weighed) return weighed;
  double smallest_eigenvalue = 0.0;
  const bool on_demand = comes_on_demand(model, organ, options.column_budget);
  if (on_demand) {
    kept = (*solver)->factor();
    model.compliance = columns_to_come(model, kept);
    model.compliance.need(prepared);
    model.compliance.on_demand->end_preparation();
    // That of the whole is no greater than that of a part. But it is positive all the same: a
    // factor in real numbers is there only where the stiffness is.
    smallest_eigenvalue = smallest_compliance_eigenvalue(made_part(model.compliance));
  } else if (model.touchable.size() > 0) {
    auto compliance = (*solver)->compliance(model.places.fields, model.touchable.places,
                                            part_of(progress, kFactorDone, kComplianceDone));
    if (!compliance) return std::unexpected(compliance.error());
    model.compliance = std::move(*compliance);
  } else {
    model.compliance.places = model.places.size();
  }
  model.figures = (*solver)->figures();
  if (on_demand) model.figures.smallest_compliance_eigenvalue = smallest_eigenvalue;
  if (!demand.burnt.empty())
    return add_changeable(model, **solver, demand, part_of(progress, kComplianceDone, 1.0));
  return {};
}

}  // namespace

std::ptrdiff_t OrganModel::saved_bytes() const {
  if (!in_half_precision()) return 0;
  const auto entries = static_cast<std::ptrdiff_t>(half_columns.entries.size());
  const auto square = static_cast<std::ptrdiff_t>(compliance.columns.size());
  return entries * static_cast<std::ptrdiff_t>(sizeof(float) - sizeof(std::uint16_t)) -
         square * static_cast<std::ptrdiff_t>(sizeof(float));
}

ColumnFigures OrganModel::column_figures() const {
  if (compliance.on_demand) return compliance.on_demand->figures();
  return {3 * compliance.touchable.size(), 0, 0.0};
}

std::size_t OrganModel::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  std::size_t columns = of(compliance.columns);
  if (compliance.on_demand) {
    const ColumnFigures made = compliance.on_demand->figures();
    columns = (made.prepared + made.on_demand) * compliance.rows() * sizeof(float) +
              compliance.on_demand->source().memory_bytes();
  }
  return of(surface.vertices) + of(surface.triangles) + of(rest_positions) + of(rest_normals) +
         of(cloud.positions) + of(cloud.spacings) + columns + of(half_columns.entries) +
         of(compliance.touchable) + of(sag) + changeable.memory_bytes() + of(touchable.positions) +
         of(touchable.normals) + of(touchable.areas) + of(touchable.spacings) +
         of(touchable.places) + of(places.positions) + of(places.normals) + of(places.areas) +
         of(places.spacings) + of(places.fields.nodes) + of(places.fields.values) +
         of(places.fields.row_begin) + of(touchable.cell_begin) + of(touchable.cell_items) +
         of(drawn.carriers.nodes) + of(drawn.carriers.values) + of(drawn.carriers.row_begin) +
         of(drawn.triangle_begin) + of(drawn.triangle_items) + of(drawn.rest_normals);
}

Result<std::string> organ_key(const OrganDescription& organ, const Tissue& tissue,
                              const PreparedShape& shape, const BodyDemand& demand,
                              const PrepareOptions& options) {
  if (!demand.elastic()) return shape.key;
  const Formulation* formulation = find_formulation(organ.formulation);
  if (!formulation) return failure("formulation: " + unknown_formulation(organ.formulation));
  Hasher hasher;
  hasher.text("viscera organ").value(kPreparationVersion).text(shape.key);
  hasher.text(organ.formulation).value(formulation->version());
  hasher.value(tissue.elastic.youngs_modulus).value(tissue.elastic.poisson_ratio);
  for (const Region& region : organ.fixed) hash_region(hasher, region);
  hasher.value(organ.resolution.spacing).value(organ.resolution.finest);
  hasher.value(organ.resolution.gradient).value(demand.touched);
  // Columns made one by one have other last digits than all at once.
  hasher.value(options.column_budget).text("fine");
  for (const Region& region : demand.fine) hash_region(hasher, region);
  if (demand.sags) hasher.text("sags").value(tissue.density);
  if (!demand.burnt.empty()) {
    hasher.text("burnt").value(demand.burn_depth);
    for (const Region& region : demand.burnt) hash_region(hasher, region);
  }
  return hasher.hex();
}

Result<std::shared_ptr<const OrganModel>> prepare_organ(const OrganDescription& organ,
                                                        const Tissue& tissue, PreparedShape shape,
                                                        const BodyDemand& demand,
                                                        const PrepareOptions& options,
                                                        const Progress& progress,
                                                        std::vector<std::string>& warnings) {
  const Stopwatch watch;
  auto key = organ_key(organ, tissue, shape, demand, options);
  if (!key) return std::unexpected(key.error());
  auto model = std::make_shared<OrganModel>();
  model->notes = shape.notes;
  model->cache_hit = shape.cache_hit;
  if (demand.elastic()) {
    const ResponseCache cache(ResponseCache::default_folder());
    const auto restart = [&] {
      *model = OrganModel{};
      model->key = *key;
      model->material = tissue.elastic;
      model->notes = shape.notes;
      set_surface(*model, shape.surface);
    };
    restart();
    model->cache_hit =
        options.use_cache && load_cached(cache, *model, organ, demand, options, warnings);
    if (!model->cache_hit) {
      restart();
      std::shared_ptr<const StiffnessFactor> factor;
      if (auto done = compute(*model, organ, tissue, demand, options, progress, factor); !done)
        return std::unexpected(done.error());
      if (options.use_cache) {
        if (auto saved = save_factor(cache, *model, factor.get()); !saved)
          warn_once(warnings, "cache not written: " + saved.error().text());
        const auto said = std::span(model->notes).subspan(shape.notes.size());
        if (auto saved = cache.save(model->key, to_cache(*model, said)); !saved)
          warn_once(warnings, "cache not written: " + saved.error().text());
      }
    }
  } else {
    model->key = *key;
    model->material = tissue.elastic;
    set_surface(*model, std::move(shape.surface));
  }
  if (organ.displacement_storage == DisplacementStorage::kHalf && model->touchable_anywhere())
    keep_in_half_precision(*model);
  if (organ.response == Response::kLocal && organ.deformable)
    model->drawn = carried_by_none(model->surface);
  for (const std::string& note : model->notes) warnings.push_back(organ.name + ": " + note);
  if (model->deformable()) {
    // Said once, however many organs use the formulation.
    const Formulation& formulation = *find_formulation(organ.formulation);
    std::string warning(formulation.warning());
    if (!warning.empty()) warn_once(warnings, std::move(warning));
    if (!model->touchable_anywhere()) {
      model->prepare_s = shape.seconds + watch.seconds();
      return model;
    }
    auto accepted = accept_compliance(formulation, model->figures.smallest_compliance_eigenvalue);
    if (!accepted) return std::unexpected(accepted.error());
    if (!accepted->empty()) warnings.push_back("organ \"" + organ.name + "\": " + *accepted);
  }
  model->prepare_s = shape.seconds + watch.seconds();
  return model;
}

Result<OrganPlan> plan_organ(const OrganDescription& organ, const Tissue& tissue,
                             const Reach& reach, const PrepareOptions& options) {
  auto name = shape_key(organ.geometry, options.assets);
  if (!name) return std::unexpected(name.error());
  PreparedShape shape;
  shape.key = std::move(*name);
  auto surface = build_shape(organ.geometry, options.assets, shape.notes);
  if (!surface) return std::unexpected(surface.error());
  const auto demand = demand_on(organ, tissue, reach, *surface);
  if (!demand) return std::unexpected(demand.error());
  auto key = organ_key(organ, tissue, shape, *demand, options);
  if (!key) return std::unexpected(key.error());
  auto plan = plan_surface(std::move(*surface), organ, *demand, options.column_budget);
  if (!plan) return plan;
  std::error_code ignored;
  const ResponseCache cache(ResponseCache::default_folder());
  plan->cached = std::filesystem::exists(
      demand->elastic() ? cache.file(*key) : shape_file(shape.key), ignored);
  plan->notes = std::move(shape.notes);
  return plan;
}

Result<OrganPlan> plan_surface(TriangleSurface surface, const OrganDescription& organ,
                               const BodyDemand& demand, std::size_t column_budget) {
  OrganPlan plan;
  OrganModel model;
  set_surface(model, std::move(surface));
  plan.triangles = model.surface.triangles.size();
  plan.surface = model.surface;
  plan.memory_bytes = model.memory_bytes();
  if (!demand.elastic()) return plan;
  auto cloud = place_cloud(organ, model.surface, demand, no_progress());
  if (!cloud) return std::unexpected(cloud.error());
  model.cloud = std::move(*cloud);
  if (auto done = finish(model, organ, demand); !done) return std::unexpected(done.error());
  plan.prepared_places = prepared_places(model, organ, demand, column_budget).size();
  if (auto fits = check_memory(model, plan.prepared_places); !fits)
    return std::unexpected(fits.error());
  plan.nodes = model.cloud.size();
  plan.surface_nodes = model.cloud.surface_count;
  plan.places = model.places.size();
  plan.touchable_places = model.touchable.size();
  const double n = static_cast<double>(plan.nodes);
  plan.memory_bytes = model.memory_bytes() + compliance_bytes(plan.places, plan.prepared_places);
  if (plan.prepared_places < plan.touchable_places)
    plan.memory_bytes += static_cast<std::size_t>(sizeof(float) * factor_entries(n));
  if (demand.sags) plan.memory_bytes += 9 * plan.places * sizeof(float);
  if (organ.displacement_storage == DisplacementStorage::kHalf)
    plan.memory_bytes = plan.memory_bytes -
                        compliance_bytes(plan.places, plan.touchable_places) / 2 +
                        compliance_bytes(plan.touchable_places, plan.touchable_places);
  plan.preparation_bytes =
      model.memory_bytes() + preparation_bytes(plan.nodes, plan.places, plan.prepared_places);

  // Operations counted, at 1e11 a second (two cores, single precision): factoring goes as N^2, the
  // columns of a touchable place as a share of the factor. Assembly is linear in the nodes.
  constexpr double kPerSecond = 1e11;
  plan.prepare_s =
      0.1 + 4.5e-4 * n +
      (3.8e3 * n * n + 2.5 * static_cast<double>(plan.prepared_places) * factor_entries(n)) /
          kPerSecond;
  plan.cloud = std::move(model.cloud);
  return plan;
}

}  // namespace viscera
