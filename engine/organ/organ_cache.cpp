#include "engine/organ/organ_cache.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/io/factor_file.h"
#include "engine/organ/finite_parts.h"
#include "engine/organ/organ_parts.h"
#include "engine/organ/recipe.h"
#include "engine/organ/region_arrays.h"
#include "kernels/base/hash.h"
#include "kernels/formulations/formulations.h"

namespace viscera {
namespace {

/// Raised when pre-processing changes in a way that its inputs don't show: node placement,
/// sampling.
constexpr int kPreparationVersion = 5;
/// The same of what tissue at finite strain has besides.
constexpr int kFiniteVersion = 6;
constexpr const char* kChange = "change_";  // before the names of its arrays

void hash_vector(Hasher& hasher, const Vec3& v) {
  for (int c = 0; c < 3; ++c) hasher.value(v[c]);
}

void hash_region(Hasher& hasher, const Region& region) {
  hasher.value(region.shape).value(region.radius);
  hash_vector(hasher, region.a);
  hash_vector(hasher, region.b);
}

void hash_fibres(Hasher& hasher, const Fibres& fibres) {
  hasher.text("fibres").value(fibres.modulus);
  hash_vector(hasher, fibres.direction);
}

Result<void> hash_parts(Hasher& hasher, const OrganDescription& organ,
                        const std::filesystem::path& assets) {
  for (const PartDescription& part : organ.parts) {
    hasher.text("part").value(part.where.index());
    hasher.value(part.youngs_modulus.value_or(0.0)).value(part.density.value_or(0.0));
    if (part.fibres) hash_fibres(hasher, *part.fibres);
    Result<void> hashed;
    if (const auto* capsule = std::get_if<CapsulePart>(&part.where))
      hasher.value(capsule->thickness);
    if (const auto* region = std::get_if<Region>(&part.where)) hash_region(hasher, *region);
    if (const auto* recipe = std::get_if<RecipePart>(&part.where)) {
      hasher.value(recipe->seed);
      for (const std::filesystem::path& file : recipe_files(assets, recipe->name))
        if (hashed) hashed = hash_file(hasher, file, "a recipe");
    }
    if (const auto* labels = std::get_if<LabelPart>(&part.where)) {
      hasher.value(labels->label);
      hashed = hash_file(hasher, labels->file, "a label map");
    }
    if (const auto* map = std::get_if<ModulusMapPart>(&part.where)) {
      hasher.value(map->unit);
      hashed = hash_file(hasher, map->file, "a map of moduli");
    }
    if (!hashed) return hashed;
  }
  return {};
}

void keep_changeable(const ChangeableRegion& region, CacheArrays& arrays) {
  const ElasticRegion& tissue = region.tissue;
  keep_points(tissue, kChange, arrays);
  arrays["change_positions"] = flat(tissue.positions);
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
  ElasticRegion& tissue = region.tissue;
  std::vector<double> positions, cell_gradients;
  std::vector<int> cell_begin;
  TakenArrays taken(arrays, kChange);
  take_points(taken, tissue);
  taken.take("positions", positions);
  taken.take("cell_begin", cell_begin);
  taken.take("cell_nodes", tissue.cell_nodes);
  taken.take("cell_gradients", cell_gradients);
  taken.take("places", region.places);
  taken.take("compliance", region.nodes);
  if (!taken.whole()) return {};
  tissue.positions = vectors(positions);
  tissue.cell_gradients = vectors(cell_gradients);
  tissue.cell_begin.assign(cell_begin.begin(), cell_begin.end());
  const std::size_t columns = 3 * tissue.nodes.size(), points = tissue.size();
  if (columns == 0 || tissue.positions.size() != points || tissue.begin.size() != points + 1 ||
      tissue.begin.back() != tissue.gradients.size() ||
      tissue.point_nodes.size() != tissue.gradients.size() || tissue.cell_begin.empty() ||
      ElasticRegion::kTerms * tissue.cell_begin.back() != tissue.cell_gradients.size() ||
      tissue.cell_nodes.size() != tissue.cell_begin.back() ||
      (!tissue.cell.empty() && tissue.cell.size() != points) ||
      (!tissue.modulus.empty() && tissue.modulus.size() != points) ||
      tissue.psi.size() != ElasticRegion::kTerms * tissue.cell.size() ||
      region.nodes.size() != columns * columns || region.places.size() % columns != 0)
    return {};
  region.rows = region.places.size() / columns;
  return region;
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
std::filesystem::path step_file(const ResponseCache& cache, const std::string& key) {
  return cache.file(key).replace_extension(".step");
}

/// Of these nodes, or of coarse ones; null, with a warning, where the file doesn't hold it.
std::shared_ptr<const StiffnessFactor> cached_factor(const std::filesystem::path& file,
                                                     const OrganModel& model, bool coarse,
                                                     const std::string& organ,
                                                     std::vector<std::string>& warnings) {
  auto factor = read_factor(file, model.key);
  if (factor && (coarse || factor->nodes() == model.places.nodes))
    return std::make_shared<const StiffnessFactor>(std::move(*factor));
  const Error why =
      factor ? failure("it was made for other nodes").error() : std::move(factor.error());
  warnings.push_back(
      fmt::format("{}: cache {}: rebuilt because {}", organ, file.string(), why.text()));
  return nullptr;
}

}  // namespace

std::uint64_t cached_bytes(const BodyDemand& demand, const std::string& key) {
  const auto size = [](const std::filesystem::path& file) -> std::uint64_t {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    return error ? 0 : bytes;
  };
  if (!demand.elastic()) return size(shape_file(key));
  const ResponseCache cache(ResponseCache::default_folder());
  const std::uint64_t response = size(cache.file(key));
  return response > 0 ? response + size(factor_file(cache, key)) + size(step_file(cache, key)) : 0;
}

PreparedResponse to_cache(const OrganModel& model, std::span<const std::string> said) {
  PreparedResponse stored;
  stored.cloud = model.cloud;
  stored.compliance = model.compliance.on_demand ? made_part(model.compliance) : model.compliance;
  stored.figures = model.figures;
  if (!model.sag.empty()) stored.extra["sag"] = model.sag;
  if (!model.hold_ways.empty()) stored.extra["hold_ways"] = model.hold_ways;
  if (!model.touchable.modulus.empty()) stored.extra["touchable_modulus"] = model.touchable.modulus;
  if (!model.changeable.empty() && !model.finite) keep_changeable(model.changeable, stored.extra);
  // Text, as the numbers of its characters; one note a line.
  std::vector<int> notes;
  for (const std::string& note : said) {
    notes.insert(notes.end(), note.begin(), note.end());
    notes.push_back('\n');
  }
  if (!notes.empty()) stored.extra["notes"] = std::move(notes);
  return stored;
}

Result<void> save_factor(const ResponseCache& cache, const OrganModel& model,
                         const StiffnessFactor* factor) {
  if (!factor) return {};
  const std::filesystem::path file = factor_file(cache, model.key);
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  if (error) return failure(file.parent_path().string() + ": can't be created: " + error.message());
  if (model.finite) {
    const FiniteSolver& solver = *model.finite;
    const StiffnessFactor& step = solver.levels() ? *solver.levels()->coarse() : *solver.factor();
    if (auto saved = write_factor(step_file(cache, model.key), model.key, step); !saved)
      return saved;
  }
  return write_factor(file, model.key, *factor);
}

bool load_cached(const ResponseCache& cache, OrganModel& model, const OrganDescription& organ,
                 const Tissue& tissue, const BodyDemand& demand, const PrepareOptions& options,
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
  if (auto* ways = std::get_if<std::vector<float>>(&cached.response->extra["hold_ways"]))
    model.hold_ways = std::move(*ways);
  model.changeable = changeable_from_cache(cached.response->extra);
  if (!model.deformable() || !add_places(model, organ, demand)) return false;
  if (auto* modulus = std::get_if<std::vector<float>>(&cached.response->extra["touchable_modulus"]))
    model.touchable.modulus = std::move(*modulus);
  const std::size_t numbers = 2 * TouchableSurface::kModulusScales * model.touchable.size();
  if (model.touchable.modulus.size() != numbers &&
      !(model.touchable.modulus.empty() && organ.parts.empty()))
    return false;
  const bool sag = demand.sags && organ.response != Response::kFinite;
  if (model.sag.size() != (sag ? 9 * model.places.size() : 0)) return false;
  const std::size_t holds =
      organ.response != Response::kFinite ? demand.moving_holds.size() : std::size_t{0};
  if (model.hold_ways.size() != 9 * holds * model.places.size()) return false;
  if (!model.changeable.empty() && model.changeable.rows != 3 * model.places.size()) return false;
  if (answers_in_levels(model, organ)) {
    auto parts = finite_from_cache(cached.response->extra, model.places.nodes);
    if (!parts) return false;
    CoarseFactors coarse;
    coarse.still = cached_factor(factor_file(cache, model.key), model, true, organ.name, warnings);
    coarse.step = cached_factor(step_file(cache, model.key), model, true, organ.name, warnings);
    return coarse.still && coarse.step &&
           make_finite_in_levels(model, *parts, finite_options(organ, tissue),
                                 !demand.burnt.empty(), coarse);
  }
  if (comes_on_demand(model, organ, options.column_budget)) {
    auto factor = cached_factor(factor_file(cache, model.key), model, false, organ.name, warnings);
    if (!factor) return false;
    const SurfaceCompliance made = std::move(model.compliance);
    if (made.places != model.places.size()) return false;
    model.compliance = columns_to_come(model, std::move(factor));
    const std::size_t three = 3 * made.rows();
    for (std::size_t t = 0; t < made.touchable.size(); ++t)
      std::copy_n(
          made.columns.begin() + static_cast<std::ptrdiff_t>(t * three), three,
          model.compliance.columns.begin() +
              static_cast<std::ptrdiff_t>(made.touchable[t]) * static_cast<std::ptrdiff_t>(three));
    model.compliance.on_demand->take_as_made(made.touchable);
    model.compliance.on_demand->end_preparation();
  }
  if (organ.response == Response::kFinite) {
    const auto parts = finite_from_cache(cached.response->extra, model.places.nodes);
    if (!parts) return false;
    auto step = cached_factor(step_file(cache, model.key), model, false, organ.name, warnings);
    if (!step || !make_finite(model, *parts, finite_options(organ, tissue), !demand.burnt.empty(),
                              std::move(step)))
      return false;
    model.step_compliance.need(prepared_places(model, organ, demand, options.column_budget));
    model.step_compliance.on_demand->end_preparation();
  }
  return model.touchable.places == model.compliance.touchable &&
         model.places.size() == model.compliance.places;
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
  if (tissue.fibres.modulus > 0.0) hash_fibres(hasher, tissue.fibres);
  for (const Region& region : organ.fixed) hash_region(hasher, region);
  if (organ.free) hasher.text("free");
  hasher.value(organ.resolution.spacing).value(organ.resolution.finest);
  hasher.value(organ.resolution.gradient).value(demand.touched);
  // Columns made one by one have other last digits than all at once.
  hasher.value(options.column_budget).text("fine");
  for (const Region& region : demand.fine) hash_region(hasher, region);
  if (organ.response == Response::kFinite) {
    const FiniteOptions finite = finite_options(organ, tissue);
    hasher.text("finite").value(kFiniteVersion).value(finite.time_step).value(finite.density);
    hasher.value(finite.viscous_time).value(finite.dynamic);
    for (const RelaxationTerm& term : finite.relaxation) hasher.value(term.share).value(term.time);
  }
  if (organ.response == Response::kFinite && !demand.weight.isZero(0.0))
    hasher.text("weight")
        .value(demand.weight.x())
        .value(demand.weight.y())
        .value(demand.weight.z());
  if (!demand.moving_holds.empty()) hasher.text("moving holds");
  for (const int hold : demand.moving_holds) hasher.value(hold);
  if (demand.sags) hasher.text("sags").value(tissue.density);
  if (!organ.parts.empty()) {
    hasher.value(tissue.density);
    if (auto hashed = hash_parts(hasher, organ, options.assets); !hashed)
      return std::unexpected(hashed.error());
  }
  if (!demand.burnt.empty()) {
    hasher.text("burnt").value(demand.burn_depth);
    for (const Region& region : demand.burnt) hash_region(hasher, region);
  }
  return hasher.hex();
}

}  // namespace viscera
