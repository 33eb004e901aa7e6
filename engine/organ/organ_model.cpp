#include "engine/organ/organ_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>

#include "engine/organ/finite_parts.h"
#include "engine/organ/material_field.h"
#include "engine/organ/organ_cache.h"
#include "engine/organ/organ_parts.h"
#include "kernels/base/finite.h"
#include "kernels/base/stopwatch.h"
#include "kernels/formulations/formulations.h"
#include "kernels/paff/compliance_checks.h"
#include "kernels/paff/compliance_columns.h"
#include "kernels/paff/local_spacing.h"

namespace viscera {
namespace {

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

/// After the cache, which holds single precision: one file serves both ways to keep it.
void keep_in_half_precision(OrganModel& model) {
  model.half_columns = half_precision(model.compliance);
  model.compliance = force_part(model.compliance);
}

/// Three solves more: the body under its own weight along x, y and z.
Result<void> weigh(OrganModel& model, ElasticSolver& solver, double density,
                   const MaterialField* field) {
  const LocalSpacing spacing(model.cloud);
  const auto density_at = [&](const Vec3& x) {
    constexpr double kOfPoint = 0.5;  // edge of what a quadrature point stands for, in spacings
    return field ? density * field->density(x, kOfPoint * spacing(x)) : density;
  };
  const std::size_t rows = 3 * model.places.size();
  model.sag.resize(3 * rows);
  for (int axis = 0; axis < 3; ++axis) {
    const auto unknowns = solver.solve_static(
        {.body_force = [&](const Vec3& x) { return Vec3(density_at(x) * Vec3::Unit(axis)); },
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

/// Of holds that move, as far along x, y and z.
Result<void> move_holds(OrganModel& model, const OrganDescription& organ, const BodyDemand& demand,
                        ElasticSolver& solver) {
  const std::size_t rows = 3 * model.places.size();
  for (const int number : demand.moving_holds)
    for (int axis = 0; axis < 3; ++axis) {
      const auto unknowns = solver.solve_static(
          {.body_force = {}, .traction = {}, .held_displacement = moved_hold(organ, number, axis)});
      if (!unknowns) return std::unexpected(unknowns.error());
      if (auto holds = expect_hold(*unknowns, number); !holds) return holds;
      model.hold_ways.resize(model.hold_ways.size() + rows);
      read_places(model.places.fields, unknowns->data(),
                  model.hold_ways.data() + model.hold_ways.size() - rows);
    }
  if (!all_finite(model.hold_ways))
    return failure("moving holds: the displacement under their motion isn't finite");
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

/// `kept` becomes the factor where columns are left to be made from it, `parts` what tissue at
/// finite strain is made of.
Result<void> compute(OrganModel& model, const OrganDescription& organ, const Tissue& tissue,
                     const BodyDemand& demand, const PrepareOptions& options,
                     const Progress& progress, std::shared_ptr<const StiffnessFactor>& kept,
                     std::optional<FiniteParts>& parts) {
  if (!model.deformable()) {
    auto placed =
        place_cloud(organ, model.surface, demand, part_of(progress, kShapeDone, kCloudDone));
    if (!placed) return std::unexpected(placed.error());
    model.cloud = std::move(*placed);
    if (auto done = add_places(model, organ, demand); !done) return done;
  }
  const std::vector<int> prepared = prepared_places(model, organ, demand, options.column_budget);

  auto made_field = MaterialField::make(organ, tissue, model.surface, options.assets);
  if (!made_field) return std::unexpected(made_field.error());
  const MaterialField* field = made_field->get();
  if (field) {
    if (auto sound = field->check(model.cloud); !sound) return sound;
  }

  ElasticProblem problem = elastic_problem(model, organ, tissue, field);
  problem.most_memory = options.most_memory;
  const Formulation* formulation = find_formulation(organ.formulation);
  auto solver = formulation->prepare(problem, part_of(progress, kCloudDone, kFactorDone));
  if (!solver) return std::unexpected(solver.error());
  if (organ.response == Response::kFinite) {
    auto made = finite_parts(model, organ, demand, **solver, field);
    if (!made) return std::unexpected(made.error());
    parts = std::move(*made);
  } else {
    if (demand.sags)
      if (auto weighed = weigh(model, **solver, tissue.density, field); !weighed) return weighed;
    if (auto moved = move_holds(model, organ, demand, **solver); !moved) return moved;
  }
  if (problem.points_alone) {
    model.figures = (*solver)->figures();
    solver->reset();  // its equations are half of what is held
    // No columns: those that something meets are made then.
    auto coarse = make_finite_in_levels(model, *parts, finite_options(organ, tissue),
                                        !demand.burnt.empty(), {}, demand.weight);
    if (!coarse) return std::unexpected(coarse.error());
    kept = coarse->still;
    return {};
  }
  double smallest_eigenvalue = 0.0;
  const bool on_demand = comes_on_demand(model, organ, options.column_budget);
  if (on_demand) {
    kept = (*solver)->factor();
    model.compliance = columns_to_come(model, kept);
    model.compliance.need(prepared);
    model.compliance.on_demand->end_preparation();
    // That of the whole is no greater than that of a part. But it is positive all the same: a
    // factor in real numbers is there only where the stiffness is.
    if (!prepared.empty())
      smallest_eigenvalue = smallest_compliance_eigenvalue(made_part(model.compliance));
  } else if (model.touchable.size() > 0) {
    auto compliance = (*solver)->compliance(model.places.fields, model.touchable.places,
                                            part_of(progress, kFactorDone, kComplianceDone));
    if (!compliance) return std::unexpected(compliance.error());
    model.compliance = std::move(*compliance);
  } else {
    model.compliance.places = model.places.size();
  }
  if (parts) {
    const FiniteOptions finite = finite_options(organ, tissue);
    auto unloaded = unload(
        *parts, demand.weight, finite.density,
        [&](const VectorX& forces) {
          VectorX moved(forces.size());
          const auto size = static_cast<std::size_t>(forces.size());
          (*solver)->factor()->apply({forces.data(), size}, {moved.data(), size});
          return moved;
        },
        model.notes, part_of(progress, kComplianceDone, 1.0));
    if (!unloaded) return unloaded;
    if (auto made = make_finite(model, *parts, finite, !demand.burnt.empty(), nullptr); !made)
      return made;
    model.step_compliance.need(prepared);
    model.step_compliance.on_demand->end_preparation();
  }
  model.figures = (*solver)->figures();
  if (on_demand) model.figures.smallest_compliance_eigenvalue = smallest_eigenvalue;
  if (!demand.burnt.empty() && !parts)
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
  if (finite) {
    const ColumnFigures made = step_compliance.on_demand->figures();
    columns += (made.prepared + made.on_demand) * step_compliance.rows() * sizeof(float) +
               finite->memory_bytes();
  }
  if (drawn.sides) columns += drawn.sides->memory_bytes();
  return of(energy_points) + of(surface.vertices) + of(surface.triangles) + of(rest_positions) +
         of(rest_normals) + of(cloud.positions) + of(cloud.spacings) + columns +
         of(half_columns.entries) + of(compliance.touchable) + of(sag) + of(hold_ways) +
         static_cast<std::size_t>(hold_loads.size()) * sizeof(double) + changeable.memory_bytes() +
         of(touchable.positions) + of(touchable.normals) + of(touchable.areas) +
         of(touchable.spacings) + of(touchable.modulus) + of(touchable.places) +
         of(places.positions) + of(places.normals) + of(places.areas) + of(places.spacings) +
         of(places.fields.nodes) + of(places.fields.values) + of(places.fields.row_begin) +
         of(touchable.cell_begin) + of(touchable.cell_items) + of(drawn.carriers.nodes) +
         of(drawn.carriers.values) + of(drawn.carriers.row_begin) + of(drawn.triangle_begin) +
         of(drawn.triangle_items) + of(drawn.rest_normals);
}

Result<std::shared_ptr<const OrganModel>> prepare_organ(
    const OrganDescription& organ, const Tissue& tissue, const PreparedShape& shape,
    const BodyDemand& demand, std::shared_ptr<OrganModel> begun, const PrepareOptions& options,
    const Progress& progress, std::vector<std::string>& warnings) {
  const Stopwatch watch;
  auto key = organ_key(organ, tissue, shape, demand, options);
  if (!key) return std::unexpected(key.error());
  const auto start = [&](std::shared_ptr<OrganModel> from) {
    auto started = from ? std::move(from) : std::make_shared<OrganModel>();
    started->key = *key;
    started->material = tissue.elastic;
    started->notes = shape.notes;
    if (started->surface.triangles.empty()) set_surface(*started, shape.surface);
    return started;
  };
  std::shared_ptr<OrganModel> model = start(nullptr);
  if (demand.elastic()) {
    const ResponseCache cache(ResponseCache::default_folder());
    model->cache_hit =
        options.use_cache && load_cached(cache, *model, organ, tissue, demand, options, warnings);
    if (!model->cache_hit) {
      model = start(std::move(begun));
      std::shared_ptr<const StiffnessFactor> factor;
      std::optional<FiniteParts> parts;
      if (auto done = compute(*model, organ, tissue, demand, options, progress, factor, parts);
          !done)
        return std::unexpected(done.error());
      if (options.use_cache) {
        if (auto saved = save_factor(cache, *model, factor.get()); !saved)
          warn_once(warnings, "cache not written: " + saved.error().text());
        const auto said = std::span(model->notes).subspan(shape.notes.size());
        PreparedResponse stored = to_cache(*model, said);
        if (parts) keep_finite(*parts, stored.extra);
        if (auto saved = cache.save(model->key, stored); !saved)
          warn_once(warnings, "cache not written: " + saved.error().text());
      }
    }
  } else {
    model->cache_hit = shape.cache_hit;
  }
  model->fields.reset();
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
    // A factor in real numbers is there only where the stiffness is positive.
    if (!model->touchable_anywhere() || model->finite) {
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

}  // namespace viscera
