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
  std::size_t column(const std::string& name) const {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
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

/// Of every tool of forces.csv: its greatest force, and the work its tip put into the tissue. What
/// it got back isn't taken off: of a palpation hardly anything would be left.
void add_tools(const Table& table, std::map<std::string, double>& figures) {
  for (const std::string& name : table.names) {
    if (!name.ends_with("_x_m")) continue;
    const std::string tool = name.substr(0, name.size() - 4);
    std::array<std::size_t, 3> place{}, force{};
    for (std::size_t a = 0; a < 3; ++a) {
      place[a] = table.column(fmt::format("{}_{}_m", tool, "xyz"[a]));
      force[a] = table.column(fmt::format("{}_f{}_N", tool, "xyz"[a]));
    }
    double greatest = 0.0, work = 0.0;
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
    }
    figures[tool + ": greatest force, N"] = greatest;
    figures[tool + ": work put in, J"] = work;
  }
}

double tolerance_of(const std::string& name) {
  if (name.ends_with(", K")) return 0.005;
  if (name.ends_with(", m3") || name.ends_with(", kg")) return 0.03;
  if (name.ends_with(", J")) return 0.02;
  return 0.01;
}

}  // namespace

Result<std::vector<GoldenScene>> read_golden(const std::filesystem::path& file) {
  const Json all = Json::parse(text_of(file), nullptr, false);
  if (!all.is_object() || !all.contains("scenes"))
    return failure(file.string() + ": found no golden figures, expected {\"scenes\": [...]}");
  std::vector<GoldenScene> scenes;
  for (const Json& one : all["scenes"]) {
    GoldenScene& scene = scenes.emplace_back();
    scene.name = one["scene"];
    scene.duration_s = one["duration_s"];
    for (const auto& [name, figure] : one["figures"].items())
      scene.figures[name] = {figure["value"], figure["tolerance"]};
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
  const Json report = Json::parse(text_of(folder / "report.json"), nullptr, false);
  if (!report.is_object())
    return failure((folder / "report.json").string() + ": found no report of a run");
  std::map<std::string, double> figures;
  add_tools(read_table(folder / "forces.csv"), figures);
  const auto add = [&](const std::string& name, const Json& of, const char* key) {
    if (of.is_object() && of.contains(key) && of[key].is_number()) figures[name] = of[key];
  };
  for (const Json& organ : report["organs"])
    add(organ["name"].get<std::string>() + ": greatest displacement, m", organ,
        "greatest_displacement_m");
  for (const Json& tissue : report["tissue"]) {
    const std::string organ = tissue["organ"];
    add(organ + ": greatest temperature, K", tissue, "greatest_temperature_K");
    add(organ + ": coagulated, m3", tissue, "volume_coagulated_m3");
    add(organ + ": vaporised, kg", tissue, "vaporised_kg");
  }
  for (const Json& hand : report["haptics"])
    add(hand["tool"].get<std::string>() + ": energy of its hand, J", hand, "energy_J");
  for (const Json& link : report["links"])
    add(link["name"].get<std::string>() + ": greatest force, N", link, "greatest_force_N");
  add("delivered to tissue, J", report["cautery"], "energy_delivered_J");
  for (const char* what : {"emitted", "airborne", "evacuated", "deposited"})
    add(fmt::format("smoke {}, kg", what), report["smoke"], fmt::format("{}_kg", what).c_str());
  const Table lesion = read_table(folder / "lesion.csv");
  if (!lesion.rows.empty()) {
    figures["lesion: depth, m"] = lesion.rows.back()[lesion.column("depth_m")];
    figures["lesion: width, m"] = lesion.rows.back()[lesion.column("width_m")];
  }
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
