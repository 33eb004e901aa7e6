#include "engine/verification/body_references.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "engine/verification/number_table.h"

namespace viscera {
namespace {

constexpr std::array kLoads = {BodyLoad::kStick, BodyLoad::kFlat, BodyLoad::kBall, BodyLoad::kPlate,
                               BodyLoad::kPress};

std::string file_of(const std::string& body, BodyLoad load) {
  return fmt::format("{}_{}.csv", body, name_of(load));
}

}  // namespace

Result<std::vector<KnownBodyReference>> read_body_references(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "forces.csv";
  std::ifstream file(path);
  if (!file) return failure(path.string() + ": can't be read");
  std::vector<KnownBodyReference> all;
  std::map<std::string, std::vector<std::vector<double>>> tables;
  std::string line;
  std::getline(file, line);
  for (int number = 2; std::getline(file, line); ++number) {
    std::istringstream words(line);
    std::string body, load, poisson, force;
    std::getline(words, body, ',');
    std::getline(words, load, ',');
    std::getline(words, poisson, ',');
    std::getline(words, force);
    const auto known = std::ranges::find(kLoads, load, [](BodyLoad l) { return name_of(l); });
    char *poisson_end = nullptr, *force_end = nullptr;
    KnownBodyReference one;
    one.body = body;
    one.poisson_ratio = std::strtod(poisson.c_str(), &poisson_end);
    one.reference.force = std::strtod(force.c_str(), &force_end);
    if (body.empty() || known == kLoads.end() || poisson.empty() || *poisson_end != '\0' ||
        force.empty() || *force_end != '\0')
      return failure(
          fmt::format("{}:{}: found \"{}\", expected a body, a load, Poisson's ratio and a force",
                      path.string(), number, line));
    one.load = *known;
    const std::string name = file_of(body, one.load);
    if (!tables.contains(name)) {
      auto table = read_number_table(folder / name, 8);
      if (!table) return std::unexpected(table.error());
      tables[name] = *std::move(table);
    }
    for (const auto& row : tables[name])
      if (std::abs(row[0] - one.poisson_ratio) < 1e-6)
        one.reference.samples.push_back(
            {Vec3(row[1], row[2], row[3]), Vec3(row[4], row[5], row[6]), row[7]});
    if (one.reference.samples.empty())
      return failure(fmt::format("{}: found no row of Poisson's ratio {:g}, expected some",
                                 (folder / name).string(), one.poisson_ratio));
    all.push_back(std::move(one));
  }
  return all;
}

std::vector<std::pair<std::string, std::string>> body_reference_files(
    const std::vector<KnownBodyReference>& all) {
  std::string forces = "body,load,poisson,force\n";
  std::map<std::string, std::string> tables;
  for (const KnownBodyReference& one : all) {
    forces += fmt::format("{},{},{:.2f},{:.6g}\n", one.body, name_of(one.load), one.poisson_ratio,
                          one.reference.force);
    std::string& table = tables[file_of(one.body, one.load)];
    if (table.empty()) table = "poisson,x,y,z,ux,uy,uz,weight\n";
    for (const BodyReference::Sample& sample : one.reference.samples) {
      const Vec3 &x = sample.place, &u = sample.displacement;
      table +=
          fmt::format("{:.2f},{:.5g},{:.5g},{:.5g},{:.5g},{:.5g},{:.5g},{:.4g}\n",
                      one.poisson_ratio, x.x(), x.y(), x.z(), u.x(), u.y(), u.z(), sample.weight);
    }
  }
  std::vector<std::pair<std::string, std::string>> files = {{"forces.csv", forces}};
  files.insert(files.end(), tables.begin(), tables.end());
  return files;
}

const BodyReference* find_reference(const std::vector<KnownBodyReference>& all,
                                    const std::string& body, BodyLoad load, double poisson_ratio) {
  for (const KnownBodyReference& one : all)
    if (one.body == body && one.load == load && std::abs(one.poisson_ratio - poisson_ratio) < 1e-6)
      return &one.reference;
  return nullptr;
}

}  // namespace viscera
