#include "engine/scene/load_scene.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "engine/scene/find_geometry.h"
#include "engine/scene/material_keys.h"
#include "engine/scene/overrides.h"
#include "engine/scene/scene_keys.h"
#include "engine/scene/tissues.h"
#include "engine/scene/to_si.h"
#include "engine/scene/validate.h"
#include "kernels/base/hash.h"
#include "kernels/base/input_file.h"
#include "kernels/formulations/formulations.h"
#include "kernels/paff/elasticity.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

// --- to SI --------------------------------------------------------------------------------------

double metres_per(const Json& unit) {
  return unit == "mm" ? 1e-3 : unit == "cm" ? 1e-2 : 1.0;
}

Pose pose_of(const Json& pose) {
  const Json& angle = pose["rotation_deg"];
  const auto about = [](const Json& degrees, const Vec3& axis) {
    return Eigen::AngleAxisd(radians(degrees), axis);
  };
  return {from_milli_vector(pose["position_mm"]),
          Quaternion(about(angle[2], Vec3::UnitZ()) * about(angle[1], Vec3::UnitY()) *
                     about(angle[0], Vec3::UnitX()))};
}

// --- organs -------------------------------------------------------------------------------------

OrganGeometry geometry_of(const Json& values) {
  const double edge = values.contains("edge_mm") ? from_milli(values["edge_mm"]) : 0.0;
  if (values.contains("file")) {
    FileGeometry geometry;
    geometry.file = values["file"].get<std::string>();
    geometry.unit = metres_per(values["unit"]);
    geometry.recentre = values["recentre"];
    geometry.edge = edge;
    if (values.contains("wrap")) {
      const Json& wrap = values["wrap"];
      geometry.wrap.emplace();
      geometry.wrap->voxel = from_milli(wrap["voxel_mm"]);
      if (wrap.contains("close_mm")) geometry.wrap->close = from_milli(wrap["close_mm"]);
    }
    return geometry;
  }
  RecipeGeometry geometry;
  geometry.recipe = values["recipe"];
  geometry.seed = values["seed"];
  geometry.edge = edge;
  if (values.contains("triangles")) geometry.triangles = values["triangles"].get<int>();
  if (values.contains("radius_mm")) geometry.radius = from_milli(values["radius_mm"]);
  if (values.contains("size_mm")) geometry.size = from_milli_vector(values["size_mm"]);
  geometry.scale = values["scale"];
  return geometry;
}

FiniteDescription finite_of(const Json& values) {
  FiniteDescription finite;
  finite.quasi_static = values["quasi_static"];
  finite.viscous_time = from_milli(values["viscous_time_ms"]);
  finite.iterations = values["iterations"];
  return finite;
}

PartDescription part_of(const Json& values) {
  PartDescription part;
  if (values.contains("capsule_mm")) part.where = CapsulePart{from_milli(values["capsule_mm"])};
  if (values.contains("region")) part.where = region_of(values["region"]);
  if (values.contains("recipe"))
    part.where = RecipePart{values["recipe"]["name"], values["recipe"]["seed"]};
  if (values.contains("labels"))
    part.where = LabelPart{values["labels"]["file"].get<std::string>(), values["labels"]["label"]};
  if (values.contains("field"))
    part.where = ModulusMapPart{values["field"]["file"].get<std::string>(),
                                1000.0 * values["field"]["kPa_per_unit"].get<double>()};
  if (values.contains("youngs_modulus_kPa"))
    part.youngs_modulus = 1000.0 * values["youngs_modulus_kPa"].get<double>();
  if (values.contains("density_kg_m3")) part.density = values["density_kg_m3"].get<double>();
  if (values.contains("fibres")) part.fibres = fibres_of(values["fibres"]);
  return part;
}

OrganDescription organ_of(const Json& values) {
  OrganDescription organ;
  organ.name = values["name"];
  organ.geometry = geometry_of(values["geometry"]);
  organ.tissue = values["tissue"];
  if (values.contains("youngs_modulus_kPa"))
    organ.youngs_modulus = 1000.0 * values["youngs_modulus_kPa"].get<double>();
  if (values.contains("poisson_ratio")) organ.poisson_ratio = values["poisson_ratio"].get<double>();
  organ.material = material_of(values["material"]);
  for (const Json& part : values["parts"]) organ.parts.push_back(part_of(part));
  organ.pose = pose_of(values["pose"]);
  for (const Json& region : values["fixed"]) organ.fixed.push_back(region_of(region));
  organ.free = values["free"];
  organ.formulation = values["formulation"];
  if (values["response"] == "linear" || values["response"] == "global")
    organ.response = Response::kLinear;
  if (values["response"] == "local") organ.response = Response::kLocal;
  if (values["response"] == "finite") organ.response = Response::kFinite;
  organ.finite = finite_of(values["finite"]);
  const Json& resolution = values["resolution"];
  organ.resolution = {from_milli(resolution["spacing_mm"]),
                      from_milli(resolution["finest_spacing_mm"]),
                      resolution["gradient"],
                      {}};
  for (const Json& region : resolution["fine"]) organ.resolution.fine.push_back(region_of(region));
  if (values["displacement_storage"] == "half")
    organ.displacement_storage = DisplacementStorage::kHalf;
  organ.deformable = values["deformable"];
  return organ;
}

// --- instruments --------------------------------------------------------------------------------

TipDescription tip_of(const Json& values) {
  const Json& shape = values["shape"];
  TipDescription tip;
  tip.shape = shape == "point"     ? TipDescription::Shape::kPoint
              : shape == "sphere"  ? TipDescription::Shape::kSphere
              : shape == "capsule" ? TipDescription::Shape::kCapsule
                                   : TipDescription::Shape::kMesh;
  tip.radius = values.contains("radius_mm") ? from_milli(values["radius_mm"]) : 0.0;
  if (values.contains("length_mm")) tip.length = from_milli(values["length_mm"]);
  if (values.contains("file")) {
    tip.file = values["file"].get<std::string>();
    tip.unit = metres_per(values["unit"]);
  }
  return tip;
}

InstrumentDescription instrument_of(const Json& values) {
  const Json& kind = values["kind"];
  InstrumentDescription instrument;
  instrument.name = values["name"];
  instrument.kind = kind == "probe"      ? InstrumentKind::kProbe
                    : kind == "grasper"  ? InstrumentKind::kGrasper
                    : kind == "hook"     ? InstrumentKind::kHook
                    : kind == "scalpel"  ? InstrumentKind::kScalpel
                    : kind == "scissors" ? InstrumentKind::kScissors
                    : kind == "spatula"  ? InstrumentKind::kSpatula
                    : kind == "bag"      ? InstrumentKind::kBag
                                         : InstrumentKind::kClipApplier;
  instrument.tip = tip_of(values["tip"]);
  instrument.trocar = from_milli_vector(values["trocar_mm"]);
  instrument.shaft_radius = from_milli(values["shaft_radius_mm"]);
  instrument.roll = radians(values["roll_deg"]);
  if (instrument.kind == InstrumentKind::kGrasper) {
    if (values.contains("grip_limit_N")) instrument.grip_limit = values["grip_limit_N"];
    instrument.grip_radius = from_milli(values["grip_radius_mm"]);
  }
  instrument.friction = values["friction"];
  for (const Json& key : values["path"]) {
    instrument.path.push_back({key["time_s"], from_milli_vector(key["tip_mm"]), key["power_W"],
                               key["jaw"], key["blade"]});
  }
  return instrument;
}

// --- picture ------------------------------------------------------------------------------------

CameraDescription camera_of(const Json& values) {
  CameraDescription camera;
  camera.optics = radians(values["optics_deg"]);
  camera.field_of_view = radians(values["field_of_view_deg"]);
  camera.round_mask = values["round_mask"];
  for (const Json& key : values["path"]) {
    camera.path.push_back({key["time_s"], from_milli_vector(key["tip_mm"]),
                           from_milli_vector(key["target_mm"]), radians(key["roll_deg"])});
  }
  return camera;
}

void read_extras(const std::vector<FeatureKeys>& features, FeatureKeys::Part FeatureKeys::*part,
                 const Json& values, Extras& extras) {
  for (const FeatureKeys& feature : features)
    if ((feature.*part).read) (feature.*part).read(values, extras);
}

SceneDescription scene_of(const Json& values, const std::vector<FeatureKeys>& features,
                          const fs::path& file) {
  const auto read = [&](FeatureKeys::Part FeatureKeys::*part, const Json& object, Extras& extras) {
    read_extras(features, part, object, extras);
  };
  SceneDescription scene;
  scene.file = file;
  scene.name = values["name"];
  scene.title = values["title"];
  scene.duration = values["duration_s"];
  scene.seed = values["seed"];
  read(&FeatureKeys::scene, values, scene.extras);
  for (const Json& organ : values["organs"]) {
    scene.organs.push_back(organ_of(organ));
    read(&FeatureKeys::organ, organ, scene.organs.back().extras);
  }
  for (const Json& instrument : values["instruments"]) {
    scene.instruments.push_back(instrument_of(instrument));
    read(&FeatureKeys::instrument, instrument, scene.instruments.back().extras);
  }
  set_steps(scene, {.per_second = values["steps_per_s"]});
  if (values.contains("camera")) scene.camera = camera_of(values["camera"]);
  const Json& light = values["light"];
  scene.light = {light["intensity"], light["colour_temperature_K"]};
  return scene;
}

// --- what a scene may name ----------------------------------------------------------------------

std::vector<std::string> bodies_of_files(const fs::path& assets) {
  std::vector<std::string> names;
  std::error_code failed;
  for (auto entry = fs::directory_iterator(assets / "organs", failed);
       !failed && entry != fs::end(entry); entry.increment(failed))
    if (entry->path().extension() == ".json") names.push_back(entry->path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> recipe_names(const fs::path& assets) {
  std::vector<std::string> names = bodies_of_files(assets);
  names.insert(names.end(), {"block", "hemisphere", "sphere"});
  std::sort(names.begin(), names.end());
  return names;
}

/// The names in a list of named objects, after `first`; nothing where some name is a mistake of its
/// own, so that it isn't reported twice. The file isn't checked yet.
std::optional<std::vector<std::string>> names_of(const Json& root, const std::string& list,
                                                 std::vector<std::string> first) {
  if (!root.is_object()) return {};
  std::vector<std::string> names = std::move(first);
  if (!root.contains(list)) return names;
  if (!root[list].is_array()) return {};
  const auto own = static_cast<std::ptrdiff_t>(names.size());
  for (const Json& object : root[list]) {
    if (!object.is_object() || !object.contains("name") || !object["name"].is_string()) return {};
    const std::string name = object["name"];
    if (!is_name(name) || std::find(names.begin() + own, names.end(), name) != names.end())
      return {};
    names.push_back(name);
  }
  return names;
}

/// What stands for an object of this kind without being its name.
std::vector<std::string> words_for(const std::string& kind,
                                   const std::vector<FeatureKeys>& features) {
  std::vector<std::string> words;
  for (const FeatureKeys& feature : features)
    if (const auto found = feature.words.find(kind); found != feature.words.end())
      words.insert(words.end(), found->second.begin(), found->second.end());
  return words;
}

ReadContext context_for(const fs::path& file, const SceneLoadOptions& options, Error& error) {
  ReadContext context;
  context.vocabularies["recipe"] = recipe_names(options.assets);
  context.vocabularies["body"] = bodies_of_files(options.assets);
  context.vocabularies["formulation"] = formulation_names();
  for (const std::string& name : left_out_formulations())
    context.left_out["formulation"][name] = why_left_out(name);
  const auto tissues = load_tissues(options.assets / "tissues.json");
  if (tissues) {
    std::vector<std::string>& names = context.vocabularies["tissue"];
    for (const auto& [name, tissue] : *tissues) names.push_back(name);
  } else {
    error.messages = tissues.error().messages;
  }
  const GeometrySearch search{file.parent_path(), options.search, options.assets};
  context.find_file = [search](const std::string& wanted) -> Result<std::string> {
    const Result<fs::path> found = find_geometry(wanted, search);
    if (!found) return std::unexpected(found.error());
    return found->string();
  };
  context.find_volume = [search](const std::string& wanted) -> Result<std::string> {
    const Result<fs::path> found = find_volume(wanted, search);
    if (!found) return std::unexpected(found.error());
    return found->string();
  };
  context.find_neighbour =
      [folder = file.parent_path()](const std::string& wanted) -> Result<std::string> {
    const Result<fs::path> found = path_inside(folder, wanted);
    if (!found) return std::unexpected(found.error());
    return found->string();
  };
  return context;
}

}  // namespace

Result<SceneDescription> load_scene(const fs::path& file, const SceneLoadOptions& options) {
  Result<Json> root = read_json(file);
  if (!root) return std::unexpected(root.error());

  Error error;
  ReadContext context = context_for(file, options, error);
  std::vector<std::pair<std::string, std::string>> overridden;  // path with indices, option
  for (const auto& [path, value] : options.overrides) {
    const Result<std::string> resolved = apply_override(*root, path, value);
    if (resolved)
      overridden.emplace_back(*resolved, "--set " + path + "=" + value);
    else
      error.messages.push_back(resolved.error().text());
  }

  for (const char* kind : {"organ", "instrument"})
    if (auto names = names_of(*root, std::string(kind) + "s", words_for(kind, options.features)))
      context.vocabularies[kind] = std::move(*names);
  for (const Mistake& mistake : validate(*root, scene_keys(options.features), context)) {
    const auto from = std::find_if(overridden.rbegin(), overridden.rend(), [&](const auto& entry) {
      return mistake.path == entry.first || mistake.path.starts_with(entry.first + "/");
    });
    const std::string origin = from == overridden.rend() ? "" : " (" + from->second + ")";
    const std::string at = mistake.path.empty() ? "" : mistake.path + ": ";
    error.messages.push_back(file.string() + ": " + at + mistake.text + origin);
  }
  if (!error.messages.empty()) return std::unexpected(error);

  SceneDescription scene = scene_of(*root, options.features, file);
  Hasher hasher;
  hasher.text(root->dump());
  scene.source = hasher.hex();
  return scene;
}

std::string scene_schema(const std::vector<FeatureKeys>& features) {
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"title", "Viscera scene"}};
  schema.update(json_schema(scene_keys(features)));
  return schema.dump(2) + "\n";
}

}  // namespace viscera
