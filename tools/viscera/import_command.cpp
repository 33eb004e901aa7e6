#include "tools/viscera/import_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <ostream>
#include <set>

#include "engine/io/atomic_file.h"
#include "engine/io/foreign_files.h"
#include "engine/io/label_map.h"
#include "engine/io/mesh_export.h"
#include "engine/io/organ_page.h"
#include "engine/organ/figures_text.h"
#include "engine/organ/label_surface.h"
#include "engine/organ/organ_checkup.h"
#include "engine/organ/shaded_view.h"
#include "engine/organ/shape.h"
#include "engine/organ/wrap.h"
#include "engine/scene/geometry_formats.h"
#include "kernels/base/parallel.h"
#include "kernels/points/surface_checks.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kTouching = 0.25;  // share of an edge by which neighbours may overlap unsaid
constexpr int kPicture = 240;       // pixels
constexpr const char* kFallbackTissue = "liver";
constexpr const char* kFrame = "x to the patient's left, y to the head, z to the front";

// One organ on its way to the files.
struct Imported {
  std::string name, source;
  TriangleSurface surface;
  double edge = 0.0;
  std::optional<double> label_volume;
  std::vector<std::string> warnings;
  std::optional<Vec3> shift;  // of its pose [m]
  OrganDescription entry;
  OrganCheckup checkup;
};

std::optional<double> metres_per_unit(const std::string& unit) {
  if (unit == "mm") return 1e-3;
  if (unit == "cm") return 1e-2;
  if (unit == "m") return 1.0;
  return std::nullopt;
}

std::string unit_name(double metres) {
  for (const char* name : {"mm", "cm", "m"}) {
    if (*metres_per_unit(name) == metres) return name;
  }
  return fmt::format("{:g} m", metres);
}

// As scenes want names: [a-z0-9_]+.
std::string plain_name(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u)) {
      name += static_cast<char>(std::tolower(u));
    } else if (!name.empty() && name.back() != '_') {
      name += '_';
    }
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

Result<void> check_names(const ImportOptions& options, std::size_t organs) {
  Error mistakes;
  if (!options.names.empty() && options.names.size() != organs) {
    mistakes.messages.push_back(fmt::format(
        "--name: found {} names for {} labels, expected one each", options.names.size(), organs));
  }
  std::set<std::string> seen;
  for (const std::string& name : options.names) {
    if (name.empty() || plain_name(name) != name) {
      const std::string plain = plain_name(name);
      mistakes.messages.push_back(
          fmt::format("--name: found \"{}\", expected small letters, digits and _{}", name,
                      plain.empty() ? "" : fmt::format(" (\"{}\"?)", plain)));
    }
    if (!seen.insert(name).second) {
      mistakes.messages.push_back(fmt::format("--name: found \"{}\" twice", name));
    }
  }
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

// --- listing ------------------------------------------------------------------------------------

void list_map(const LabelMap& map, std::ostream& out) {
  const Vec3 spacing = 1e3 * map.spacing();
  out << fmt::format("{}: {}, {} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm, orientation {}\n",
                     map.file.string(), map.format, map.size.x(), map.size.y(), map.size.z(),
                     spacing.x(), spacing.y(), spacing.z(), map.orientation());
  if (map.unit_assumed) {
    out << "unit: the file doesn't say it; the figures below are for millimetres, and importing "
           "asks for --unit mm\n";
  } else if (map.unit_overridden) {
    out << fmt::format("unit: {}, as asked for; the file says {}\n", unit_name(map.unit),
                       unit_name(*map.unit_overridden));
  } else {
    out << fmt::format("unit: {}\n", unit_name(map.unit));
  }
  out << fmt::format("boxes in mm, {}\n\n{:>6}  {:<28}{:>9}{:>12}  {}\n", kFrame, "label", "name",
                     "voxels", "volume", "box");
  for (const auto& [label, extent] : label_extents(map)) {
    const Box box = box_of(map, extent);
    const Vec3 low = 1e3 * box.min(), high = 1e3 * box.max();
    const auto name = map.names.find(label);
    out << fmt::format(
        "{:>6}  {:<28}{:>9}{:>9.2f} ml  ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, {:.1f})\n",
        label, name == map.names.end() ? "" : name->second, extent.voxels,
        1e6 * static_cast<double>(extent.voxels) * map.voxel_volume(), low.x(), low.y(), low.z(),
        high.x(), high.y(), high.z());
  }
}

void list_surface(const fs::path& file, const TriangleSurface& surface, double unit,
                  std::ostream& out) {
  const Vec3 low = 1e3 * bounds(surface).min(), high = 1e3 * bounds(surface).max();
  out << fmt::format(
      "{}: {} triangles, unit {}, area {:.4g} cm2, box ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, "
      "{:.1f}, {:.1f}) mm\n",
      file.string(), surface.triangles.size(), unit_name(unit), 1e4 * area(surface), low.x(),
      low.y(), low.z(), high.x(), high.y(), high.z());
  const auto defects = surface_defects(surface);
  for (const std::string& defect : defects) out << "  " << defect << '\n';
  out << (defects.empty() ? "closed, manifold and in one piece\n" : "importing wraps it\n");
}

// --- reading ------------------------------------------------------------------------------------

Result<std::vector<Imported>> organs_of_map(const LabelMap& map, const ImportOptions& options,
                                            std::vector<std::string>& notes) {
  std::vector<std::int32_t> labels = options.labels;
  if (options.all) {
    labels.clear();
    for (const auto& [label, unused] : label_extents(map)) labels.push_back(label);
  }
  if (labels.empty()) {
    return failure(map.file.string() +
                   ": found no --label, expected one or more, or --all (--list shows them)");
  }
  if (std::set(labels.begin(), labels.end()).size() != labels.size()) {
    return failure("--label: found a label twice");
  }
  if (const auto named = check_names(options, labels.size()); !named) {
    return std::unexpected(named.error());
  }
  auto surfaces = label_surfaces(map, labels, {options.edge}, options.all, notes);
  if (!surfaces) return std::unexpected(surfaces.error());

  Box volume;
  for (int corner = 0; corner < 8; ++corner) {
    volume.extend(
        map.centre(Vec3((corner & 1) * (map.size.x() - 1), (corner >> 1 & 1) * (map.size.y() - 1),
                        (corner >> 2) * (map.size.z() - 1))));
  }
  const Vec3 shift = -1e-3 * (1e3 * volume.center()).array().round().matrix();
  std::vector<Imported> organs;
  for (LabelOrgan& made : *surfaces) {
    Imported organ;
    const auto known = map.names.find(made.label);
    const auto asked = std::ranges::find(labels, made.label) - labels.begin();
    if (!options.names.empty()) {
      organ.name = options.names[asked];
    } else if (known != map.names.end()) {
      organ.name = plain_name(known->second);
    }
    if (organ.name.empty()) organ.name = fmt::format("label_{}", made.label);
    if (made.piece > 1) organ.name += fmt::format("_{}", made.piece);
    organ.source =
        fmt::format("label {} of {}, {} voxels of {:.4g} x {:.4g} x {:.4g} mm", made.label,
                    map.file.filename().string(), made.voxels, 1e3 * map.spacing().x(),
                    1e3 * map.spacing().y(), 1e3 * map.spacing().z());
    organ.surface = std::move(made.surface);
    organ.edge = made.edge;
    organ.label_volume = made.label_volume;
    organ.warnings = std::move(made.warnings);
    organ.shift = shift;
    organs.push_back(std::move(organ));
  }
  // Two labels of the same name, or a label called like another's second piece.
  std::set<std::string> seen;
  for (Imported& organ : organs) {
    for (int number = 2; !seen.insert(organ.name).second; ++number) {
      organ.name += fmt::format("_{}", number);
    }
  }
  return organs;
}

Result<TriangleSurface> read_surface(const ImportOptions& options, double& unit) {
  const std::string extension = geometry_extension(options.file);
  const bool metric = extension == ".glb" || extension == ".gltf";  // metres, by their definition
  if (!metric && options.unit.empty() && fs::exists(options.file)) {
    return failure(options.file.string() + ": " + extension.substr(1) +
                   " files don't say their unit of length, expected it from --unit (mm, cm or m)");
  }
  unit = options.unit.empty() ? 1.0 : *metres_per_unit(options.unit);
  auto surface = import_surface(options.file, unit);
  if (!surface) return surface;
  if (const auto fits = check_body_size(options.file.string(), *surface, unit); !fits) {
    return std::unexpected(fits.error());
  }
  return surface;
}

Result<std::vector<Imported>> organs_of_surface(const ImportOptions& options) {
  double unit = 1.0;
  const auto original = read_surface(options, unit);
  if (!original) return std::unexpected(original.error());
  if (const auto named = check_names(options, 1); !named) return std::unexpected(named.error());
  WrapOptions wrapping;
  const double size = bounds(*original).sizes().maxCoeff();
  wrapping.voxel = options.voxel > 0.0
                       ? options.voxel
                       : std::clamp(std::round(size * 1e4 / 12.0) / 1e4, 0.3e-3, 3e-3);
  wrapping.close = options.close;
  wrapping.edge = options.edge;
  auto wrap = wrap_surface(*original, wrapping);
  if (!wrap) return failure(options.file.string() + ": " + wrap.error().text());
  Imported organ;
  organ.name =
      options.names.empty() ? plain_name(options.file.stem().string()) : options.names.front();
  if (organ.name.empty()) organ.name = "organ";
  const std::vector<std::string> notes = wrap_notes(*wrap, wrapping);
  organ.source = options.file.filename().string() + ", " + notes.front();
  organ.warnings.assign(notes.begin() + 1, notes.end());
  organ.surface = std::move(wrap->surface);
  organ.edge = wrapping.edge > 0.0 ? wrapping.edge : 2.0 * wrapping.voxel;
  std::vector<Imported> organs;
  organs.push_back(std::move(organ));
  return organs;
}

// --- checking -----------------------------------------------------------------------------------

void choose_tissue(Imported& organ, const ImportOptions& options,
                   const std::map<std::string, Tissue>& tissues) {
  if (!options.tissue.empty()) {
    organ.entry.tissue = options.tissue;
    return;
  }
  for (const auto& [tissue, unused] : tissues) {
    if (organ.name.find(tissue) != std::string::npos && tissue.size() > organ.entry.tissue.size()) {
      organ.entry.tissue = tissue;
    }
  }
  if (!organ.entry.tissue.empty()) return;
  organ.entry.tissue = kFallbackTissue;
  organ.warnings.push_back(
      fmt::format("no tissue is called like it: its entry says \"{}\"; choose one of "
                  "assets/tissues.json, or --tissue",
                  kFallbackTissue));
}

void check_all(std::vector<Imported>& organs, const ImportOptions& options,
               const std::map<std::string, Tissue>& tissues) {
  parallel_for_each_index(organs.size(), 1, [&](std::size_t o) {
    Imported& organ = organs[o];
    organ.entry.name = organ.name;
    choose_tissue(organ, options, tissues);
    organ.entry.resolution = suggested_resolution(volume(organ.surface));
    organ.entry.fixed = {back_region(bounds(organ.surface))};
    organ.checkup = check_organ(organ.surface, organ.entry, organ.label_volume);
    // What the surface's maker said about the volume needs no second time.
    for (std::string& warning : organ.checkup.warnings) {
      const bool said = warning.starts_with("its volume") &&
                        std::ranges::any_of(organ.warnings, [](const std::string& earlier) {
                          return earlier.starts_with("its volume");
                        });
      if (!said) organ.warnings.push_back(std::move(warning));
    }
  });
  for (std::size_t a = 0; a < organs.size(); ++a) {
    for (std::size_t b = a + 1; b < organs.size(); ++b) {
      const Overlap overlap = greatest_overlap(organs[a].surface, organs[b].surface);
      if (overlap.depth <= kTouching * std::max(organs[a].edge, organs[b].edge)) continue;
      for (const auto& [one, other] : {std::pair{a, b}, std::pair{b, a}}) {
        organs[one].warnings.push_back(fmt::format("it overlaps {} by up to {:.2g} mm at {}",
                                                   organs[other].name, 1e3 * overlap.depth,
                                                   place_text(overlap.place)));
      }
    }
  }
}

// --- writing ------------------------------------------------------------------------------------

Json millimetres(const Vec3& x) {
  Json list = Json::array();
  for (int c = 0; c < 3; ++c) list.push_back(std::round(1e4 * x[c]) / 10.0 + 0.0);
  return list;
}

Json entry_json(const Imported& organ) {
  Json entry = {{"name", organ.name},
                {"geometry", {{"file", organ.name + ".obj"}, {"unit", "mm"}}},
                {"tissue", organ.entry.tissue}};
  if (organ.shift) entry["pose"] = {{"position_mm", millimetres(*organ.shift)}};
  const Region& back = organ.entry.fixed.front();
  entry["fixed"] =
      Json::array({{{"half_space", {{"point_mm", millimetres(back.a)}, {"normal", {0, 0, 1}}}}}});
  entry["resolution"] = {
      {"spacing_mm", std::round(1e4 * organ.entry.resolution.spacing) / 10.0},
      {"finest_spacing_mm", std::round(1e4 * organ.entry.resolution.finest) / 10.0}};
  if (!organ.entry.deformable) entry["deformable"] = false;
  return entry;
}

OrganPage page_of(const Imported& organ) {
  const SurfaceQuality& quality = organ.checkup.quality;
  const OrganPlan& plan = organ.checkup.plan;
  const auto at = [](const Vec3& x) { return "at " + place_text(x); };
  OrganPage page;
  page.title = organ.name;
  page.source = organ.source;
  page.warnings = organ.warnings;
  const double off =
      organ.label_volume ? 100.0 * (quality.volume / *organ.label_volume - 1.0) : 0.0;
  page.figures.push_back({"volume", fmt::format("{:.2f} ml", 1e6 * quality.volume),
                          organ.label_volume ? fmt::format("the labels' {:.2f} ml {:+.2f} %",
                                                           1e6 * *organ.label_volume, off)
                                             : "",
                          std::abs(off) > 3.0});
  page.figures.push_back({"area", fmt::format("{:.1f} cm²", 1e4 * quality.area), ""});
  const Vec3 size = 1e3 * quality.box.sizes();
  page.figures.push_back(
      {"size", fmt::format("{:.1f} x {:.1f} x {:.1f} mm", size.x(), size.y(), size.z()), kFrame});
  page.figures.push_back({"triangles", std::to_string(organ.surface.triangles.size()),
                          fmt::format("edges {:.2g} to {:.2g} mm", 1e3 * quality.shortest_edge,
                                      1e3 * quality.longest_edge)});
  page.figures.push_back({"genus", std::to_string(quality.genus),
                          quality.genus == 0 ? "a ball, as far as holes go" : "holes through it",
                          quality.genus > 0});
  const double angle = quality.least_angle * 180.0 / std::numbers::pi;
  page.figures.push_back({"smallest angle", fmt::format("{:.1f}°", angle),
                          at(quality.least_angle_place), angle < 8.0});
  page.figures.push_back(
      {"thinnest wall",
       quality.thinnest_wall > 0.0 ? fmt::format("{:.2f} mm", 1e3 * quality.thinnest_wall) : "none",
       fmt::format("{}; {:.1f} % of the area is thinner than two node spacings of {:.3g} mm",
                   quality.thinnest_wall > 0.0 ? at(quality.thinnest_place) : "",
                   100.0 * quality.thin_share, 1e3 * organ.entry.resolution.spacing),
       quality.thin_share > 0.02});
  page.figures.push_back({"nodes", std::to_string(plan.nodes),
                          fmt::format("{} on the surface; spacing {:.3g} mm, {:.3g} mm where "
                                      "touched",
                                      plan.surface_nodes, 1e3 * organ.entry.resolution.spacing,
                                      1e3 * organ.entry.resolution.finest)});
  page.figures.push_back(
      {"expected memory", fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(plan.memory_bytes)),
       fmt::format("{:.0f} MB at most while preparing; touched within 20 mm of its frontmost place",
                   1e-6 * static_cast<double>(plan.preparation_bytes))});
  page.figures.push_back({"expected preparation", fmt::format("{:.1f} s", plan.prepare_s),
                          "on two cores, once; then it comes from the cache"});
  const auto view = [&](const char* caption, const Vec3& right, const Vec3& up) {
    page.pictures.push_back(
        {caption, data_uri(shaded_view(organ.surface, right, up, kPicture), kPicture)});
  };
  view("from the front", -Vec3::UnitX(), Vec3::UnitY());
  view("from the patient's left", Vec3::UnitZ(), Vec3::UnitY());
  view("from the feet", -Vec3::UnitX(), -Vec3::UnitZ());
  page.entry = entry_json(organ).dump(2);
  return page;
}

// Whether the file isn't there, or one of ours.
bool ours(const fs::path& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return true;
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line.starts_with(kObjMark);
}

Result<void> write_all(const std::vector<Imported>& organs, const fs::path& folder) {
  Error mistakes;
  for (const Imported& organ : organs) {
    if (const fs::path file = folder / (organ.name + ".obj"); !ours(file)) {
      mistakes.messages.push_back(file.string() +
                                  ": found a file that viscera didn't write, expected none");
    }
  }
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  std::vector<std::pair<fs::path, std::string>> files;
  for (const Imported& organ : organs) {
    files.emplace_back(folder / (organ.name + ".obj"),
                       obj_text(organ.surface, organ.name + ": " + organ.source + "\n" + kFrame));
    files.emplace_back(folder / (organ.name + "_nodes.ply"),
                       nodes_ply_text(organ.checkup.plan.begun->cloud));
    files.emplace_back(folder / (organ.name + ".html"), page_text(page_of(organ)));
    files.emplace_back(folder / (organ.name + ".json"), entry_json(organ).dump(2) + "\n");
  }
  if (auto usable = check_out_folder(folder); !usable) return usable;
  std::vector<PendingFile> pending;
  for (const auto& [file, text] : files) {
    pending.emplace_back(file);
    std::ofstream stream(pending.back().temporary(), std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) return failure(file.string() + ": can't be written: is the disk full?");
  }
  for (PendingFile& file : pending) {
    if (auto done = file.commit(Durable::kNo); !done) return done;
  }
  return {};
}

void print_organs(const std::vector<Imported>& organs, std::ostream& out) {
  out << fmt::format("{:<28}{:>10}{:>11}{:>11}{:>7}{:>7}{:>10}{:>12}\n", "organ", "triangles",
                     "volume", "to labels", "genus", "nodes", "memory", "preparation");
  for (const Imported& organ : organs) {
    const SurfaceQuality& quality = organ.checkup.quality;
    const OrganPlan& plan = organ.checkup.plan;
    const std::string off =
        organ.label_volume
            ? fmt::format("{:+.2f} %", 100.0 * (quality.volume / *organ.label_volume - 1.0))
            : "-";
    out << fmt::format("{:<28}{:>10}{:>8.2f} ml{:>11}{:>7}{:>7}{:>7.1f} MB{:>10.1f} s\n",
                       organ.name, organ.surface.triangles.size(), 1e6 * quality.volume, off,
                       quality.genus, plan.nodes, 1e-6 * static_cast<double>(plan.memory_bytes),
                       plan.prepare_s);
  }
  out << '\n';
  for (const Imported& organ : organs) {
    if (!organ.label_volume) out << organ.name << ": " << organ.source << '\n';
    for (const std::string& warning : organ.warnings) {
      out << "warning: " << organ.name << ": " << warning << '\n';
    }
  }
}

}  // namespace

Result<void> import_file(const ImportOptions& options, const std::map<std::string, Tissue>& tissues,
                         std::ostream& out) {
  const bool map_file = is_label_map_file(options.file);
  if (!map_file && !is_geometry_file(options.file)) {
    return failure(options.file.string() +
                   ": found another format, expected a label map (.nii, .nii.gz, .nrrd, .nhdr) or "
                   "a surface (.obj, .stl, .ply, .gltf, .glb)");
  }
  if (!options.unit.empty() && !metres_per_unit(options.unit)) {
    return failure("--unit: found \"" + options.unit + "\", expected mm, cm or m");
  }
  if (!options.tissue.empty() && !tissues.contains(options.tissue)) {
    return failure("--tissue: found \"" + options.tissue +
                   "\", expected a tissue of assets/tissues.json");
  }
  if (!options.list && options.out.empty()) {
    return failure("found no --out, expected a folder for the organs (or --list)");
  }
  std::vector<std::string> notes;
  Result<std::vector<Imported>> organs;
  if (map_file) {
    LabelMapOptions reading;
    if (!options.unit.empty()) reading.unit = metres_per_unit(options.unit);
    if (options.list) reading.assumed = 1e-3;
    const auto map = read_label_map(options.file, reading);
    if (!map) return std::unexpected(map.error());
    if (options.list) {
      list_map(*map, out);
      return {};
    }
    if (map->unit_overridden) {
      notes.push_back(fmt::format("the file says that its unit is {}; --unit says {}",
                                  unit_name(*map->unit_overridden), unit_name(map->unit)));
    }
    organs = organs_of_map(*map, options, notes);
  } else if (options.list) {
    double unit = 1.0;
    const auto surface = read_surface(options, unit);
    if (!surface) return std::unexpected(surface.error());
    list_surface(options.file, *surface, unit, out);
    return {};
  } else {
    if (!options.labels.empty() || options.all) {
      return failure("--label, --all: found a surface, expected a label map");
    }
    organs = organs_of_surface(options);
  }
  if (!organs) return std::unexpected(organs.error());
  if (organs->empty()) return failure(options.file.string() + ": found no label that is an organ");
  check_all(*organs, options, tissues);
  if (auto written = write_all(*organs, options.out); !written) return written;
  print_organs(*organs, out);
  for (const std::string& note : notes) out << "note: " << note << '\n';
  out << fmt::format(
      "\n{} organ{} in {}: NAME.obj (mm), NAME.json (entry), NAME_nodes.ply, "
      "NAME.html\n",
      organs->size(), organs->size() == 1 ? "" : "s", options.out.string());
  return {};
}

}  // namespace viscera
