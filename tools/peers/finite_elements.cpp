#include "tools/peers/finite_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>

#include "engine/io/atomic_file.h"
#include "tools/common/bench_figures.h"
#include "tools/peers/bent_block_calculix.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

constexpr double kHair = 1e-6;

/// Edge middles that gmsh numbers otherwise: 01 12 20 03 23 13.
constexpr std::array<int, 10> kFromGmsh = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8};
/// Corners and opposite middles of the four faces, counter-clockwise seen from outside.
constexpr int kFaces[4][6] = {
    {0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 8, 7}, {1, 2, 3, 5, 9, 8}, {2, 0, 3, 6, 7, 9}};

std::string geometry(const MeshOptions& options) {
  std::string text =
      "SetFactory(\"OpenCASCADE\");\n"
      "Sphere(1) = {0, 0, 0, 1, 0, Pi/2, 2*Pi};\n";
  // The rim of the contact becomes edges of the mesh, in the dome's own surface.
  if (options.contact > 0.0)
    text += fmt::format(
        "Circle(500) = {{0, 0, {:.15g}, {:.15g}, 0, 2*Pi}};\n"
        "BooleanFragments{{ Volume{{1}}; Delete; }}{{ Curve{{500}}; Delete; }}\n",
        std::sqrt(1.0 - options.contact * options.contact), options.contact);
  text +=
      "Mesh.MeshSizeExtendFromBoundary = 0;\n"
      "Mesh.MeshSizeFromPoints = 0;\n"
      "Mesh.MeshSizeFromCurvature = 0;\n";
  if (options.slope <= 0.0)
    return text + fmt::format("Mesh.MeshSizeMin = {0};\nMesh.MeshSizeMax = {0};\n", options.finest);
  constexpr double kZone = 0.3;
  return text + fmt::format(
                    "Point(1000) = {{0, 0, 1, 1}};\n"
                    "Field[1] = Distance;\nField[1].PointsList = {{1000}};\n"
                    "Field[2] = Threshold;\nField[2].InField = 1;\n"
                    "Field[2].SizeMin = {};\nField[2].SizeMax = {};\n"
                    "Field[2].DistMin = {};\nField[2].DistMax = {};\nBackground Field = 2;\n",
                    options.finest, options.coarsest, kZone,
                    kZone + (options.coarsest - options.finest) / options.slope);
}

/// Nodes and tetrahedra of a file of gmsh's format 2.2; nodes that no tetrahedron uses go.
Result<TetrahedralMesh> read_gmsh(const fs::path& path, bool quadratic) {
  std::ifstream file(path);
  TetrahedralMesh mesh;
  mesh.quadratic = quadratic;
  std::map<int, Vec3> all;
  std::vector<std::array<int, 10>> elements;
  const int wanted = quadratic ? 11 : 4;
  const std::size_t count = quadratic ? 10 : 4;
  for (std::string line; std::getline(file, line);) {
    std::size_t number = 0;
    if (line == "$Nodes") {
      for (file >> number; number > 0 && file; --number) {
        int id = 0;
        Vec3 x;
        file >> id >> x[0] >> x[1] >> x[2];
        all[id] = x;
      }
    } else if (line == "$Elements") {
      file >> number;
      std::getline(file, line);
      for (; number > 0 && std::getline(file, line); --number) {
        std::istringstream words(line);
        int id = 0, type = 0, tags = 0, ignored = 0;
        words >> id >> type >> tags;
        for (int i = 0; i < tags; ++i) words >> ignored;
        if (type != wanted) continue;
        std::array<int, 10> read{}, element{};
        for (std::size_t i = 0; i < count; ++i) words >> read[i];
        for (std::size_t i = 0; i < count; ++i)
          element[i] = read[static_cast<std::size_t>(kFromGmsh[i])];
        elements.push_back(element);
      }
    }
  }
  if (elements.empty())
    return failure(path.string() + ": found no tetrahedra, expected gmsh to write some");
  std::map<int, int> place_of;
  for (auto& element : elements) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto [entry, fresh] = place_of.try_emplace(element[i], mesh.nodes.size());
      if (fresh) mesh.nodes.push_back(all[element[i]]);
      element[i] = entry->second;
    }
  }
  mesh.elements = std::move(elements);
  return mesh;
}

/// Faces that belong to one tetrahedron alone.
void find_surface(TetrahedralMesh& mesh) {
  std::map<std::array<int, 3>, std::pair<int, std::array<int, 6>>> faces;
  for (const auto& element : mesh.elements) {
    for (const auto& face : kFaces) {
      std::array<int, 6> nodes{};
      for (std::size_t i = 0; i < (mesh.quadratic ? 6 : 3); ++i)
        nodes[i] = element[static_cast<std::size_t>(face[i])];
      std::array<int, 3> key = {nodes[0], nodes[1], nodes[2]};
      std::sort(key.begin(), key.end());
      auto& entry = faces[key];
      ++entry.first;
      entry.second = nodes;
    }
  }
  std::set<int> on_surface;
  for (const auto& [key, entry] : faces) {
    if (entry.first != 1) continue;
    const auto& n = entry.second;
    for (std::size_t i = 0; i < (mesh.quadratic ? 6 : 3); ++i) on_surface.insert(n[i]);
    const auto height = [&](int i) { return mesh.nodes[static_cast<std::size_t>(i)].z(); };
    if (height(n[0]) < kHair && height(n[1]) < kHair && height(n[2]) < kHair) continue;
    if (!mesh.quadratic) {
      mesh.dome.push_back({n[0], n[1], n[2]});
      continue;
    }
    mesh.dome.push_back({n[0], n[3], n[5]});
    mesh.dome.push_back({n[3], n[1], n[4]});
    mesh.dome.push_back({n[5], n[4], n[2]});
    mesh.dome.push_back({n[3], n[4], n[5]});
  }
  mesh.surface_nodes = on_surface.size();
}

void write_set(std::string& text, const char* name, const std::vector<int>& nodes) {
  text += fmt::format("*NSET, NSET={}\n", name);
  for (const int node : nodes) text += fmt::format("{},\n", node + 1);
}

enum class Printed { kForceAlone, kForceAndDisplacements };

/// A job whose every step moves the patch by as much again.
std::string input(const TetrahedralMesh& mesh, double poisson_ratio, double a_over_R,
                  CalculixSolver solver, int steps, Printed printed) {
  std::string text = "*NODE, NSET=ALL\n";
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    const Vec3& x = mesh.nodes[i];
    text += fmt::format("{},{:.12e},{:.12e},{:.12e}\n", i + 1, x.x(), x.y(), x.z());
  }
  text += fmt::format("*ELEMENT, TYPE={}, ELSET=BODY\n", mesh.quadratic ? "C3D10" : "C3D4");
  for (std::size_t e = 0; e < mesh.elements.size(); ++e) {
    text += std::to_string(e + 1);
    for (std::size_t i = 0; i < (mesh.quadratic ? 10 : 4); ++i)
      text += fmt::format(",{}", mesh.elements[e][i] + 1);
    text += '\n';
  }
  write_set(text, "BASE", base_nodes(mesh));
  write_set(text, "PATCH", patch_nodes(mesh, a_over_R));
  text += fmt::format("*MATERIAL, NAME=TISSUE\n*ELASTIC\n1.,{}\n", poisson_ratio);
  text += "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE\n*BOUNDARY\nBASE,1,3\n";
  for (int step = 1; step <= steps; ++step) {
    text += "*STEP\n";
    text += fmt::format("*STATIC, SOLVER={}\n",
                        solver == CalculixSolver::kSpooles ? "SPOOLES" : "ITERATIVE CHOLESKY");
    text += fmt::format("*BOUNDARY\nPATCH,1,2,0.\nPATCH,3,3,{}\n", -kHemisphereDepth * step);
    text += "*NODE PRINT, NSET=PATCH, TOTALS=ONLY\nRF\n";
    if (printed == Printed::kForceAndDisplacements) text += "*NODE PRINT, NSET=ALL\nU\n";
    text += "*END STEP\n";
  }
  return text;
}

/// The tables of a .dat file: the total force on the patch and the displacement of every node.
Result<void> read_output(const fs::path& path, FiniteElementAnswer& answer) {
  std::ifstream file(path);
  bool force_next = false, displacements_next = false, has_force = false;
  std::size_t found = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.find("total force") != std::string::npos) {
      force_next = true;
      displacements_next = false;
      continue;
    }
    if (line.find("displacements") != std::string::npos) {
      displacements_next = true;
      continue;
    }
    std::istringstream words(line);
    double a = 0.0, b = 0.0, c = 0.0, d = 0.0;
    if (force_next && words >> a >> b >> c) {
      answer.force_over_ERdelta = -c / kHemisphereDepth;
      force_next = false;
      has_force = true;
    } else if (displacements_next && words >> a >> b >> c >> d) {
      const auto node = static_cast<std::size_t>(a) - 1;
      if (node >= answer.displacements.size()) continue;
      answer.displacements[node] = Vec3(b, c, d);
      ++found;
    }
  }
  if (has_force && found == answer.displacements.size()) return {};
  return failure(fmt::format("{}: found {} displacements, expected {} and a total force",
                             path.string(), found, answer.displacements.size()));
}

/// "Total CalculiX Time: 1.23" of what it printed [s].
std::optional<double> own_time(const fs::path& log) {
  constexpr std::string_view kWords = "Total CalculiX Time:";
  std::ifstream file(log);
  std::optional<double> found;
  for (std::string line; std::getline(file, line);)
    if (const auto at = line.find(kWords); at != std::string::npos) {
      std::istringstream words(line.substr(at + kWords.size()));
      double seconds = 0.0;
      if (words >> seconds) found = seconds;
    }
  return found;
}

/// Time of a further solution: what a job of several steps takes longer than one of one.
Result<std::optional<double>> own_solution_time(const TetrahedralMesh& mesh, double poisson_ratio,
                                                double a_over_R, CalculixSolver solver,
                                                const fs::path& folder) {
  constexpr int kMore = 3;
  std::optional<double> seconds[2];
  for (const int steps : {1, 1 + kMore}) {
    if (auto written = write_file(folder / "again.inp", input(mesh, poisson_ratio, a_over_R, solver,
                                                              steps, Printed::kForceAlone));
        !written)
      return std::unexpected(written.error());
    const CommandResult done = run_program({"ccx", "-i", "again"}, folder / "again.log", folder);
    if (done.code != 0) return failure(fmt::format("CalculiX failed with code {}", done.code));
    seconds[steps > 1] = own_time(folder / "again.log");
  }
  if (!seconds[0] || !seconds[1]) return std::optional<double>();
  return std::optional(std::max(0.0, *seconds[1] - *seconds[0]) / kMore);
}

}  // namespace

bool finite_elements_installed() {
  return run_program({"gmsh", "--version"}).code == 0 && calculix_installed();
}

Result<TetrahedralMesh> mesh_hemisphere(const MeshOptions& options, const fs::path& folder) {
  if (auto written = write_file(folder / "mesh.geo", geometry(options)); !written)
    return std::unexpected(written.error());
  const CommandResult done = run_program({"gmsh", "-3", "-order", options.quadratic ? "2" : "1",
                                          "-format", "msh2", "-o", "mesh.msh", "mesh.geo"},
                                         folder / "gmsh.log", folder);
  if (done.code != 0) return failure(fmt::format("gmsh failed with code {}", done.code));
  auto mesh = read_gmsh(folder / "mesh.msh", options.quadratic);
  if (!mesh) return mesh;
  find_surface(*mesh);
  mesh->mesh_s = done.wall_s;
  return mesh;
}

Result<FiniteElementAnswer> solve_calculix(const TetrahedralMesh& mesh, double poisson_ratio,
                                           double a_over_R, CalculixSolver solver,
                                           const fs::path& folder) {
  std::error_code ignored;
  fs::remove(folder / "job.dat", ignored);
  const std::string job =
      input(mesh, poisson_ratio, a_over_R, solver, 1, Printed::kForceAndDisplacements);
  if (auto written = write_file(folder / "job.inp", job); !written)
    return std::unexpected(written.error());
  const CommandResult done = run_program({"ccx", "-i", "job"}, folder / "ccx.log", folder);
  if (done.code != 0) return failure(fmt::format("CalculiX failed with code {}", done.code));
  FiniteElementAnswer answer;
  answer.process_s = done.wall_s;
  answer.peak_memory_bytes = done.peak_memory_bytes;
  answer.displacements.resize(mesh.nodes.size(), Vec3::Zero());
  if (auto read = read_output(folder / "job.dat", answer); !read)
    return std::unexpected(read.error());
  auto own = own_solution_time(mesh, poisson_ratio, a_over_R, solver, folder);
  if (!own) return std::unexpected(own.error());
  answer.own_s = *own;
  return answer;
}

double dome_error(const TetrahedralMesh& mesh, const std::vector<Vec3>& displacements,
                  const HemisphereProfile& reference) {
  std::vector<double> areas(mesh.nodes.size(), 0.0);
  for (const auto& corners : mesh.dome) {
    const auto at = [&](std::size_t i) { return mesh.nodes[static_cast<std::size_t>(corners[i])]; };
    const double area = 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
    for (const int corner : corners) areas[static_cast<std::size_t>(corner)] += area / 3.0;
  }
  double error = 0.0, size = 0.0;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    if (areas[i] <= 0.0) continue;
    const Vec3 exact = reference.at(mesh.nodes[i].normalized());
    error += areas[i] * (displacements[i] - exact).squaredNorm();
    size += areas[i] * exact.squaredNorm();
  }
  return std::sqrt(error / size);
}

std::vector<int> patch_nodes(const TetrahedralMesh& mesh, double a_over_R) {
  std::set<int> nodes;
  for (const auto& corners : mesh.dome) {
    for (const int corner : corners) {
      const Vec3& x = mesh.nodes[static_cast<std::size_t>(corner)];
      if (std::hypot(x.x(), x.y()) <= a_over_R + kHair) nodes.insert(corner);
    }
  }
  return {nodes.begin(), nodes.end()};
}

std::vector<int> base_nodes(const TetrahedralMesh& mesh) {
  std::vector<int> nodes;
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    if (mesh.nodes[i].z() < kHair) nodes.push_back(static_cast<int>(i));
  return nodes;
}

}  // namespace viscera
