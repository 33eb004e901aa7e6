#include "tools/golden/golden.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>

#include "engine/features/features.h"
#include "engine/run/run.h"
#include "engine/scene/load_scene.h"
#include "engine/scene/tissues.h"

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A table of numbers with a line of names; empty where there is none.
struct Table {
  std::vector<std::string> names;
  std::vector<std::vector<double>> rows;
  std::optional<std::size_t> column(const std::string& name) const {
    const auto at = std::find(names.begin(), names.end(), name);
    if (at == names.end()) return std::nullopt;
    return static_cast<std::size_t>(at - names.begin());
  }
};

Table read_table(const std::filesystem::path& file) {
  Table table;
  std::istringstream lines(text_of(file));
  std::string line, cell;
  const auto cells = [&](const auto& take) {
    std::istringstream one(line);
    while (std::getline(one, cell, ',')) take(cell);
  };
  if (std::getline(lines, line))
    cells([&](const std::string& name) { table.names.push_back(name); });
  while (std::getline(lines, line)) {
    std::vector<double>& row = table.rows.emplace_back();
    cells([&](const std::string& value) { row.push_back(std::strtod(value.c_str(), nullptr)); });
    row.resize(table.names.size());
  }
  return table;
}

/// Of every tool of forces.csv: its greatest force, the mean over all frames, which says for how
/// long it met tissue too, and the work its tip put in. What it got back isn't taken off: of a
/// palpation hardly anything would be left.
Result<void> add_tools(const std::filesystem::path& file, std::map<std::string, double>& figures) {
  const Table table = read_table(file);
  for (const std::string& name : table.names) {
    if (!name.ends_with("_x_m")) continue;
    const std::string tool = name.substr(0, name.size() - 4);
    std::array<std::size_t, 3> place{}, force{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto at = table.column(fmt::format("{}_{}_m", tool, "xyz"[a]));
      const auto pushed = table.column(fmt::format("{}_f{}_N", tool, "xyz"[a]));
      if (!at || !pushed)
        return failure(fmt::format(
            "{}: found {} without all its columns, expected _x_m to _z_m and _fx_N to _fz_N",
            file.string(), tool));
      place[a] = *at;
      force[a] = *pushed;
    }
    double greatest = 0.0, sum = 0.0, work = 0.0;
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      double square = 0.0, put_in = 0.0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double now = table.rows[i][force[a]];
        square += now * now;
        if (i == 0) continue;
        put_in -= 0.5 * (now + table.rows[i - 1][force[a]]) *
                  (table.rows[i][place[a]] - table.rows[i - 1][place[a]]);
      }
      work += std::max(0.0, put_in);
      greatest = std::max(greatest, std::sqrt(square));
      sum += std::sqrt(square);
    }
    figures[tool + ": greatest force, N"] = greatest;
    if (!table.rows.empty())
      figures[tool + ": mean force, N"] = sum / static_cast<double>(table.rows.size());
    figures[tool + ": work put in, J"] = work;
  }
  return {};
}

Result<void> add_lesion(const std::filesystem::path& file, std::map<std::string, double>& figures) {
  const Table table = read_table(file);
  if (table.rows.empty()) return {};
  const auto depth = table.column("depth_m"), width = table.column("width_m");
  if (!depth || !width)
    return failure(file.string() + ": found no column depth_m or no width_m, expected both");
  figures["lesion: depth, m"] = table.rows.back()[*depth];
  figures["lesion: width, m"] = table.rows.back()[*width];
  return {};
}

/// Null: there is no such key, or this is no object.
const Json* member(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto at = object.find(key);
  return at == object.end() ? nullptr : &*at;
}

std::optional<double> number(const Json& object, const char* key) {
  const Json* const found = member(object, key);
  if (!found || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::optional<std::string> word(const Json& object, const char* key) {
  const Json* const found = member(object, key);
  if (!found || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

/// Nothing where it isn't one.
std::optional<GoldenScene> golden_scene(const Json& one) {
  const auto name = word(one, "scene");
  const auto duration = number(one, "duration_s");
  const Json* const figures = member(one, "figures");
  if (!name || !duration || !figures || !figures->is_object()) return std::nullopt;
  GoldenScene scene{*name, *duration, {}};
  for (const auto& [key, figure] : figures->items()) {
    const auto value = number(figure, "value"), tolerance = number(figure, "tolerance");
    if (!value || !tolerance) return std::nullopt;
    scene.figures[key] = {*value, *tolerance};
  }
  return scene;
}

/// A list of the report: the key under which an entry has its name, its figures and their names.
struct ReportList {
  const char *key, *name;
  std::vector<std::pair<const char*, const char*>> figures;
};

const std::vector<ReportList>& report_lists() {
  static const std::vector<ReportList> lists = {
      {"organs", "name", {{"greatest_displacement_m", "greatest displacement, m"}}},
      {"tissue",
       "organ",
       {{"greatest_temperature_K", "greatest temperature, K"},
        {"volume_coagulated_m3", "coagulated, m3"},
        {"vaporised_kg", "vaporised, kg"}}},
      {"haptics", "tool", {{"energy_J", "energy of its hand, J"}}},
      {"links", "name", {{"greatest_force_N", "greatest force, N"}}}};
  return lists;
}

double tolerance_of(const std::string& name) {
  if (name.ends_with(", K")) return 0.005;
  if (name.ends_with(", m3") || name.ends_with(", kg") || name.ends_with(", share")) return 0.03;
  if (name.ends_with(", J")) return 0.02;
  return 0.01;
}

}  // namespace

Result<std::vector<GoldenScene>> read_golden(const std::filesystem::path& file) {
  const Json all = Json::parse(text_of(file), nullptr, false);
  const Json* const list = member(all, "scenes");
  if (!list || !list->is_array())
    return failure(file.string() + ": found no golden figures, expected {\"scenes\": [...]}");
  std::vector<GoldenScene> scenes;
  for (const Json& one : *list) {
    auto scene = golden_scene(one);
    if (!scene)
      return failure(
          fmt::format("{}: scenes/{}: found no golden scene, expected {{\"scene\": NAME, "
                      "\"duration_s\": SECONDS, \"figures\": {{NAME: {{\"value\": NUMBER, "
                      "\"tolerance\": SHARE}}}}}}",
                      file.string(), scenes.size()));
    scenes.push_back(std::move(*scene));
  }
  return scenes;
}

std::string golden_text(const std::vector<GoldenScene>& scenes) {
  Json all;
  all["written_by"] = "viscera_golden --write";
  all["scenes"] = Json::array();
  for (const GoldenScene& scene : scenes) {
    Json one = {{"scene", scene.name}, {"duration_s", scene.duration_s}};
    one["figures"] = Json::object();
    for (const auto& [name, figure] : scene.figures)
      one["figures"][name] = {{"value", figure.value}, {"tolerance", figure.tolerance}};
    all["scenes"].push_back(std::move(one));
  }
  return all.dump(2) + "\n";
}

Result<std::map<std::string, double>> figures_of_run(const std::filesystem::path& folder) {
  const std::string file = (folder / "report.json").string();
  const Json report = Json::parse(text_of(file), nullptr, false);
  if (!report.is_object()) return failure(file + ": found no report of a run");
  const Json* const complete = member(report, "complete");
  if (!complete || *complete != true)
    return failure(file + ": found a run that ended early: " +
                   word(report, "reason").value_or("it doesn't say why"));
  std::map<std::string, double> figures;
  if (auto added = add_tools(folder / "forces.csv", figures); !added)
    return std::unexpected(added.error());
  const auto add = [&](const std::string& name, const Json& of, const char* key) {
    if (const auto value = number(of, key)) figures[name] = *value;
  };
  for (const ReportList& list : report_lists()) {
    const Json* const entries = member(report, list.key);
    if (!entries || !entries->is_array())
      return failure(fmt::format("{}: found no list \"{}\", expected one", file, list.key));
    for (const Json& entry : *entries) {
      const auto name = word(entry, list.name);
      if (!name)
        return failure(fmt::format("{}: {}: found an entry without \"{}\", expected its name", file,
                                   list.key, list.name));
      for (const auto& [key, said] : list.figures)
        add(fmt::format("{}: {}", *name, said), entry, key);
    }
  }
  if (const Json* const cautery = member(report, "cautery"))
    add("delivered to tissue, J", *cautery, "energy_delivered_J");
  if (const Json* const smoke = member(report, "smoke")) {
    for (const char* what : {"emitted", "airborne", "evacuated", "deposited"})
      add(fmt::format("smoke {}, kg", what), *smoke, fmt::format("{}_kg", what).c_str());
    add("smoke: least light through it, share", *smoke, "view_least");
    add("smoke: light through it at the end, share", *smoke, "view_at_end");
  }
  if (auto added = add_lesion(folder / "lesion.csv", figures); !added)
    return std::unexpected(added.error());
  // So little of what was emitted says which few particles came to a surface.
  constexpr double kSlightDeposit = 1e-4;
  if (figures["smoke deposited, kg"] < kSlightDeposit * figures["smoke emitted, kg"])
    figures.erase("smoke deposited, kg");
  std::erase_if(figures, [](const auto& figure) { return figure.second == 0.0; });
  return figures;
}

Result<std::map<std::string, double>> golden_run(const GoldenScene& golden,
                                                 const std::filesystem::path& root,
                                                 const std::filesystem::path& out) {
  SceneLoadOptions load;
  load.assets = root / "assets";
  load.features = feature_keys();
  load.overrides = {{"duration_s", fmt::format("{}", golden.duration_s)}};
  const auto scene = load_scene(root / "scenes" / (golden.name + ".json"), load);
  if (!scene) return std::unexpected(scene.error());
  const auto tissues = load_tissues(load.assets / "tissues.json");
  if (!tissues) return std::unexpected(tissues.error());
  RunOptions options;
  options.out = out;
  options.assets = load.assets;
  options.render = false;
  options.backend = Backend::kCpu;
  options.quiet = true;
  if (const auto report = run_scene(*scene, *tissues, options); !report)
    return std::unexpected(report.error());
  return figures_of_run(out);
}

std::vector<GoldenChange> golden_changes(const GoldenScene& old,
                                         const std::map<std::string, double>& found) {
  std::vector<GoldenChange> changes;
  std::map<std::string, std::optional<double>> all;
  for (const auto& [name, figure] : old.figures) all[name] = std::nullopt;
  for (const auto& [name, value] : found) all[name] = value;
  for (const auto& [name, value] : all) {
    const auto was = old.figures.find(name);
    if (was == old.figures.end()) {
      changes.push_back({fmt::format("{:<40} {:>12} -> {:<12.6g} new", name, "", *value), true});
    } else if (!value) {
      changes.push_back(
          {fmt::format("{:<40} {:>12.6g} -> {:<12} gone", name, was->second.value, ""), true});
    } else if (*value != was->second.value) {
      const double share = (*value - was->second.value) / std::abs(was->second.value);
      changes.push_back(
          {fmt::format("{:<40} {:>12.6g} -> {:<12.6g} {:+.3g} %  ({:g} % allowed)", name,
                       was->second.value, *value, 100.0 * share, 100.0 * was->second.tolerance),
           !(std::abs(share) <= was->second.tolerance)});
    }
  }
  return changes;
}

GoldenScene with_figures(const GoldenScene& old, const std::map<std::string, double>& found) {
  GoldenScene fresh{old.name, old.duration_s, {}};
  for (const auto& [name, value] : found) {
    const auto was = old.figures.find(name);
    fresh.figures[name] = {value,
                           was == old.figures.end() ? tolerance_of(name) : was->second.tolerance};
  }
  return fresh;
}

}  // namespace viscera
