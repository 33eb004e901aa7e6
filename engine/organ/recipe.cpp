#include "engine/organ/recipe.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/organ/implicit_shapes.h"
#include "engine/scene/json_file.h"
#include "engine/scene/spelling.h"

namespace viscera {
namespace {

constexpr double kMillimetre = 1e-3;
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kGreatest = 2000.0;  // [mm]: a body greater than a person is a mistake

std::string found(const Json& value) {
  const std::string text = value.dump();
  return text.size() > 60 ? text.substr(0, 60) + "..." : text;
}

std::string below(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "/" + key;
}

std::filesystem::path recipe_file(const std::filesystem::path& assets, const std::string& name) {
  return assets / "organs" / (name + ".json");
}

/// A field that is asked for the same place twice in a row, as a neighbour is that one part of a
/// recipe follows and another takes away, answers from memory.
SignedDistance remembered(SignedDistance of) {
  struct Answer {
    std::uint64_t field = 0;
    Vec3 place = Vec3::Zero();
    double value = 0.0;
  };
  static std::atomic<std::uint64_t> fields = 0;
  return [of = std::move(of), field = ++fields](const Vec3& x) {
    thread_local std::array<Answer, 16> answers;
    Answer& last = answers[field % answers.size()];
    if (last.field == field && last.place == x) return last.value;
    const double value = of(x);
    last = {field, x, value};
    return value;
  };
}

SignedDistance nowhere() {
  return [](const Vec3&) { return 1.0; };
}

// Reads shapes and collects every mistake with the path of its key.
class Reader {
 public:
  /// `within`: the recipes that lead here, outermost first, this one last.
  Reader(std::filesystem::path assets, std::vector<std::string> within, std::uint64_t seed)
      : assets_(std::move(assets)),
        within_(std::move(within)),
        source_(recipe_file(assets_, within_.back()).string()),
        seed_(seed) {}

  bool failed() const { return !error_.messages.empty(); }

  void mistake(const std::string& path, const std::string& found, const std::string& expected) {
    error_.messages.push_back(source_ + ": " + path + ": found " + found + ", expected " +
                              expected);
  }

  void allow_only(const Json& object, const std::string& path,
                  const std::vector<std::string>& keys) {
    for (const auto& [key, value] : object.items()) {
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
        mistake(below(path, key), "an unknown key",
                "one of " + joined(keys) + did_you_mean(key, keys));
      }
    }
  }

  double number(const Json& object, const std::string& path, const std::string& key, double least,
                double greatest, std::optional<double> fallback = {}) {
    const auto at = object.find(key);
    if (at == object.end() && fallback) return *fallback;
    if (at == object.end() || !at->is_number() || at->get<double>() < least ||
        at->get<double>() > greatest) {
      mistake(below(path, key), at == object.end() ? "nothing" : found(*at),
              "a number from " + found(least) + " to " + found(greatest));
      return fallback.value_or(least);
    }
    return at->get<double>();
  }

  Vec3 vector(const Json& object, const std::string& path, const std::string& key, double least,
              double greatest, std::optional<Vec3> fallback = {}) {
    const auto at = object.find(key);
    if (at == object.end() && fallback) return *fallback;
    Vec3 value = Vec3::Constant(std::max(least, 1.0));
    if (at == object.end() || !read_numbers(*at, 3, least, greatest, value.data())) {
      mistake(path + "/" + key, at == object.end() ? "nothing" : found(*at),
              "three numbers from " + found(least) + " to " + found(greatest));
    }
    return value;
  }

  SignedDistance shape(const Json& json, const std::string& path);

  Result<Recipe> recipe();

 private:
  using Make = std::function<SignedDistance(Reader&, const Json&, const std::string&)>;
  struct Kind {
    std::vector<std::string> keys;
    Make make;
  };
  static const std::map<std::string, Kind>& kinds();

  // The body of another recipe, in that recipe's own frame.
  SignedDistance other_recipe(const Json& object, const std::string& path);
  std::optional<GutFolds> folds(const Json& object, const std::string& path);
  Box box(const Json& json);

  static bool read_numbers(const Json& json, std::size_t count, double least, double greatest,
                           double* values) {
    if (!json.is_array() || json.size() != count) return false;
    for (std::size_t i = 0; i < count; ++i) {
      if (!json[i].is_number()) return false;
      values[i] = json[i].get<double>();
      if (!(values[i] >= least && values[i] <= greatest)) return false;
    }
    return true;
  }

  // A length [m] from a key in millimetres.
  double length(const Json& object, const std::string& path, const std::string& key, double least,
                std::optional<double> fallback = {}) {
    return kMillimetre * number(object, path, key, least, kGreatest, fallback);
  }

  Vec3 place(const Json& object, const std::string& path, const std::string& key,
             std::optional<Vec3> fallback = {}) {
    return kMillimetre * vector(object, path, key, -kGreatest, kGreatest, fallback);
  }

  Vec3 extent(const Json& object, const std::string& path, const std::string& key) {
    return kMillimetre * vector(object, path, key, 0.1, kGreatest);
  }

  Quaternion turn(const Json& object, const std::string& path) {
    const Vec3 degrees = vector(object, path, "turn_deg", -360.0, 360.0, Vec3(Vec3::Zero()));
    const Vec3 angles = kDegree * degrees;
    return Eigen::AngleAxisd(angles.z(), Vec3::UnitZ()) *
           Eigen::AngleAxisd(angles.y(), Vec3::UnitY()) *
           Eigen::AngleAxisd(angles.x(), Vec3::UnitX());
  }

  int axis(const Json& object, const std::string& path, const std::string& key) {
    const auto at = object.find(key);
    if (at != object.end()) {
      if (*at == "x") return 0;
      if (*at == "y") return 1;
      if (*at == "z") return 2;
    }
    mistake(path + "/" + key, at == object.end() ? "nothing" : found(*at), "\"x\", \"y\" or \"z\"");
    return 0;
  }

  std::vector<TubePoint> points(const Json& object, const std::string& path, const std::string& key,
                                std::size_t least) {
    std::vector<TubePoint> points;
    const auto at = object.find(key);
    if (at == object.end() || !at->is_array() || at->size() < least) {
      mistake(path + "/" + key, at == object.end() ? "nothing" : found(*at),
              "at least " + std::to_string(least) + " of [x, y, z, radius]");
      points.resize(least, {Vec3::Zero(), 1.0});
      return points;
    }
    for (std::size_t i = 0; i < at->size(); ++i) {
      double values[4] = {0, 0, 0, 1};
      if (!read_numbers((*at)[i], 4, -kGreatest, kGreatest, values) || values[3] <= 0.0) {
        mistake(path + "/" + key + "/" + std::to_string(i), found((*at)[i]),
                "[x, y, z, radius] with a radius above 0");
      }
      points.push_back(
          {kMillimetre * Vec3(values[0], values[1], values[2]), kMillimetre * values[3]});
    }
    return points;
  }

  SignedDistance child(const Json& object, const std::string& path, const std::string& key) {
    const auto at = object.find(key);
    if (at != object.end()) return shape(*at, path + "/" + key);
    mistake(path + "/" + key, "nothing", "a shape");
    return nowhere();
  }

  std::vector<SignedDistance> children(const Json& object, const std::string& path,
                                       const std::string& key) {
    std::vector<SignedDistance> shapes;
    const auto at = object.find(key);
    if (at == object.end() || !at->is_array() || at->empty()) {
      mistake(path + "/" + key, at == object.end() ? "nothing" : found(*at),
              "an array of at least one shape");
      return {nowhere()};
    }
    for (std::size_t i = 0; i < at->size(); ++i) {
      shapes.push_back(shape((*at)[i], path + "/" + key + "/" + std::to_string(i)));
    }
    return shapes;
  }

  template <class Operation>
  SignedDistance folded(const Json& json, const std::string& path, const std::string& key,
                        std::optional<SignedDistance> first, const Operation& operation) {
    const double smooth = length(json, path, "smooth_mm", 0.0, 0.0);
    for (SignedDistance& next : children(json, path, key)) {
      first = first ? operation(std::move(*first), std::move(next), smooth) : std::move(next);
    }
    return *first;
  }

  std::filesystem::path assets_;
  std::vector<std::string> within_;
  std::string source_;
  std::uint64_t seed_;
  std::map<std::pair<std::string, std::uint64_t>, SignedDistance> others_;
  std::uint64_t noises_ = 0;  // so that every noise of a recipe draws its own waves
  Error error_;
};

const std::map<std::string, Reader::Kind>& Reader::kinds() {
  static const std::map<std::string, Kind> table = {
      {"ellipsoid",
       {{"centre_mm", "radii_mm", "turn_deg"},
        [](Reader& r, const Json& j, const std::string& p) {
          const Pose pose{r.place(j, p, "centre_mm", Vec3(Vec3::Zero())), r.turn(j, p)};
          return moved(ellipsoid(Vec3::Zero(), r.extent(j, p, "radii_mm")), pose);
        }}},
      {"tube",
       {{"points_mm", "folds"},
        [](Reader& r, const Json& j, const std::string& p) {
          const std::vector<TubePoint> points = r.points(j, p, "points_mm", 2);
          const std::optional<GutFolds> folds = r.folds(j, p);
          return folds ? folded_tube(points, *folds) : tube(points);
        }}},
      {"metaballs",
       {{"balls_mm", "blend_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          return metaballs(r.points(j, p, "balls_mm", 1), r.length(j, p, "blend_mm", 0.1));
        }}},
      {"box",
       {{"centre_mm", "size_mm", "round_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          const Vec3 size = r.extent(j, p, "size_mm");
          const double round = r.length(j, p, "round_mm", 0.0, 0.0);
          if (round > 0.5 * size.minCoeff()) {
            r.mistake(p + "/round_mm", found(j["round_mm"]), "at most half the least edge");
          }
          return rounded_box(r.place(j, p, "centre_mm", Vec3(Vec3::Zero())), size, round);
        }}},
      {"half_space",
       {{"point_mm", "outward"},
        [](Reader& r, const Json& j, const std::string& p) {
          const Vec3 outward = r.vector(j, p, "outward", -kGreatest, kGreatest);
          if (outward.norm() == 0.0) r.mistake(p + "/outward", "[0, 0, 0]", "a direction");
          return half_space(r.place(j, p, "point_mm"), outward);
        }}},
      {"union",
       {{"of", "smooth_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          return r.folded(j, p, "of", {}, join);
        }}},
      {"intersection",
       {{"of", "smooth_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          return r.folded(j, p, "of", {}, intersect);
        }}},
      {"subtract",
       {{"from", "take", "smooth_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          return r.folded(j, p, "take", r.child(j, p, "from"), subtract);
        }}},
      {"shell",
       {{"of", "thickness_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          return shell(r.child(j, p, "of"), r.length(j, p, "thickness_mm", 0.1));
        }}},
      {"grow",
       {{"of", "by_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          return grow(r.child(j, p, "of"), r.length(j, p, "by_mm", -kGreatest));
        }}},
      {"move",
       {{"of", "by_mm", "turn_deg"},
        [](Reader& r, const Json& j, const std::string& p) {
          return moved(r.child(j, p, "of"),
                       Pose{r.place(j, p, "by_mm", Vec3(Vec3::Zero())), r.turn(j, p)});
        }}},
      {"stretch",
       {{"of", "factors"},
        [](Reader& r, const Json& j, const std::string& p) {
          return stretched(r.child(j, p, "of"), r.vector(j, p, "factors", 0.05, 20.0));
        }}},
      {"bend",
       {{"of", "along", "towards", "middle_mm", "radius_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          const int along = r.axis(j, p, "along"), towards = r.axis(j, p, "towards");
          if (along == towards) r.mistake(p + "/towards", found(j["towards"]), "another axis");
          const double radius = r.length(j, p, "radius_mm", -kGreatest);
          if (std::abs(radius) < kMillimetre) {
            r.mistake(p + "/radius_mm", found(j["radius_mm"]), "at least 1, or at most -1");
          }
          return bent(r.child(j, p, "of"), along, towards,
                      r.length(j, p, "middle_mm", -kGreatest, 0.0), radius);
        }}},
      {"taper",
       {{"of", "along", "from_mm", "to_mm", "from_scale", "to_scale"},
        [](Reader& r, const Json& j, const std::string& p) {
          Taper taper;
          taper.along = r.axis(j, p, "along");
          taper.from = r.length(j, p, "from_mm", -kGreatest);
          taper.to = r.length(j, p, "to_mm", -kGreatest);
          taper.from_scale = r.number(j, p, "from_scale", 0.05, 20.0, 1.0);
          taper.to_scale = r.number(j, p, "to_scale", 0.05, 20.0, 1.0);
          if (taper.from == taper.to) {
            r.mistake(p + "/to_mm", found(j["to_mm"]), "another place than from_mm");
          }
          return tapered(r.child(j, p, "of"), taper);
        }}},
      {"mirror",
       {{"of", "along"},
        [](Reader& r, const Json& j, const std::string& p) {
          return mirrored(r.child(j, p, "of"), r.axis(j, p, "along"));
        }}},
      {"recipe",
       {{"name", "seed"},
        [](Reader& r, const Json& j, const std::string& p) { return r.other_recipe(j, p); }}},
      {"lobules",
       {{"of", "height_mm", "size_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          const std::uint64_t stream = r.noises_++;
          return lobulated(r.child(j, p, "of"), r.length(j, p, "height_mm", 0.0),
                           r.length(j, p, "size_mm", 1.0), r.seed_, stream);
        }}},
      {"noise",
       {{"of", "amplitude_mm", "wavelength_mm"},
        [](Reader& r, const Json& j, const std::string& p) {
          const std::uint64_t stream = r.noises_++;
          return roughened(r.child(j, p, "of"), r.length(j, p, "amplitude_mm", 0.0),
                           r.length(j, p, "wavelength_mm", 1.0), r.seed_, stream);
        }}}};
  return table;
}

SignedDistance Reader::shape(const Json& json, const std::string& path) {
  std::vector<std::string> names;
  for (const auto& [name, kind] : kinds()) names.push_back(name);
  if (!json.is_object() || json.size() != 1) {
    mistake(path, found(json), "an object with one key, one of " + joined(names));
    return nowhere();
  }
  const std::string name = json.begin().key();
  const auto kind = kinds().find(name);
  if (kind == kinds().end()) {
    mistake(path + "/" + name, "an unknown kind of shape",
            "one of " + joined(names) + did_you_mean(name, names));
    return nowhere();
  }
  const Json& body = json.begin().value();
  if (!body.is_object()) {
    mistake(path + "/" + name, found(body), "an object");
    return nowhere();
  }
  allow_only(body, path + "/" + name, kind->second.keys);
  return kind->second.make(*this, body, path + "/" + name);
}

Box Reader::box(const Json& json) {
  const auto at = json.find("box_mm");
  if (at == json.end() || !at->is_array() || at->size() != 2) {
    mistake("box_mm", at == json.end() ? "nothing" : found(*at),
            "[[least corner], [greatest corner]]");
    return Box(Vec3::Zero(), Vec3::Ones());
  }
  const Json corners = {{"0", (*at)[0]}, {"1", (*at)[1]}};
  const Vec3 low = vector(corners, "box_mm", "0", -kGreatest, kGreatest);
  const Vec3 high = vector(corners, "box_mm", "1", -kGreatest, kGreatest);
  if (!((high - low).minCoeff() >= 1.0)) {
    mistake("box_mm", found(*at), "a greatest corner beyond the least one by 1 or more");
  }
  return Box(kMillimetre * low, kMillimetre * high);
}

std::optional<GutFolds> Reader::folds(const Json& object, const std::string& path) {
  const auto at = object.find("folds");
  if (at == object.end()) return {};
  const std::string here = path + "/folds";
  if (!at->is_object()) {
    mistake(here, found(*at), "an object");
    return {};
  }
  allow_only(*at, here,
             {"pitch_mm", "depth_mm", "bands", "band_depth_mm", "band_width_mm", "turn_deg"});
  GutFolds folds;
  folds.pitch = length(*at, here, "pitch_mm", 1.0);
  folds.depth = length(*at, here, "depth_mm", 0.0);
  const double bands = number(*at, here, "bands", 0, 12, 0.0);
  if (bands != std::floor(bands)) mistake(here + "/bands", found((*at)["bands"]), "a whole number");
  folds.bands = static_cast<int>(bands);
  folds.band_depth = length(*at, here, "band_depth_mm", 0.0, 0.0);
  folds.band_width = length(*at, here, "band_width_mm", 0.5, 6.0);
  folds.turn = kDegree * number(*at, here, "turn_deg", -360, 360, 0.0);
  return folds;
}

SignedDistance Reader::other_recipe(const Json& object, const std::string& path) {
  const auto at = object.find("name");
  if (at == object.end() || !at->is_string()) {
    mistake(path + "/name", at == object.end() ? "nothing" : found(*at),
            "the name of a recipe of assets/organs");
    return nowhere();
  }
  const double seed = number(object, path, "seed", 0, 1e9, -1.0);
  const std::string name = *at;
  if (std::find(within_.begin(), within_.end(), name) != within_.end()) {
    mistake(path + "/name", found(*at), "a recipe that isn't made of this one");
    return nowhere();
  }
  const std::uint64_t drawn = seed < 0.0 ? seed_ : static_cast<std::uint64_t>(seed);
  const auto known = others_.find({name, drawn});
  if (known != others_.end()) return known->second;
  std::vector<std::string> within = within_;
  within.push_back(name);
  Result<Recipe> other = Reader(assets_, std::move(within), drawn).recipe();
  if (other) return others_[{name, drawn}] = remembered(std::move(other->distance));
  for (std::string& message : other.error().messages) error_.messages.push_back(std::move(message));
  return nowhere();
}

Result<Recipe> Reader::recipe() {
  const Result<Json> json = read_json(source_);
  if (!json) return std::unexpected(json.error());
  if (!json->is_object()) return failure(source_ + ": found no object, expected a recipe");
  allow_only(*json, "", {"version", "about", "box_mm", "cell_mm", "edge_mm", "triangles", "shape"});
  number(*json, "", "version", 1, 1);

  Recipe recipe;
  recipe.name = within_.back();
  recipe.box = box(*json);
  recipe.cell = kMillimetre * number(*json, "", "cell_mm", 0.1, kGreatest, 0.0);
  if (json->contains("edge_mm") == json->contains("triangles")) {
    mistake("edge_mm", json->contains("edge_mm") ? "both edge_mm and triangles" : "nothing",
            "either edge_mm or triangles");
  } else if (json->contains("triangles")) {
    const double triangles = number(*json, "", "triangles", 20, 2e6);
    recipe.triangles = static_cast<int>(triangles);
    if (*recipe.triangles != triangles || *recipe.triangles % 2 != 0) {
      mistake("triangles", found((*json)["triangles"]), "an even whole number");
    }
  } else {
    recipe.edge = kMillimetre * number(*json, "", "edge_mm", 0.1, kGreatest);
  }
  if (json->contains("shape")) {
    recipe.distance = shape((*json)["shape"], "shape");
  } else {
    mistake("shape", "nothing", "a shape");
  }
  if (failed()) return std::unexpected(error_);
  return recipe;
}

// Adds the recipes that `json` names, whatever else it is.
void collect_named(const Json& json, std::vector<std::string>& names) {
  if (json.is_object()) {
    const auto other = json.find("recipe");
    if (other != json.end() && other->is_object() && other->contains("name") &&
        (*other)["name"].is_string())
      names.push_back((*other)["name"]);
  }
  if (!json.is_structured()) return;
  for (const Json& inner : json) collect_named(inner, names);
}

}  // namespace

Result<Recipe> load_recipe(const std::filesystem::path& assets, const std::string& name,
                           std::uint64_t seed) {
  return Reader(assets, {name}, seed).recipe();
}

std::vector<std::filesystem::path> recipe_files(const std::filesystem::path& assets,
                                                const std::string& name) {
  std::vector<std::string> names = {name};
  std::vector<std::filesystem::path> files;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i), names[i]) !=
        names.begin() + static_cast<std::ptrdiff_t>(i))
      continue;
    files.push_back(recipe_file(assets, names[i]));
    if (const Result<Json> json = read_json(files.back())) collect_named(*json, names);
  }
  return files;
}

}  // namespace viscera
