#include "engine/organ/region_arrays.h"

namespace viscera {

std::vector<double> flat(std::span<const Vec3> vectors) {
  std::vector<double> numbers;
  numbers.reserve(3 * vectors.size());
  for (const Vec3& v : vectors) numbers.insert(numbers.end(), v.data(), v.data() + 3);
  return numbers;
}

std::vector<Vec3> vectors(std::span<const double> numbers) {
  std::vector<Vec3> all;
  all.reserve(numbers.size() / 3);
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    all.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return all;
}

void keep_points(const ElasticRegion& region, const std::string& prefix, CacheArrays& arrays) {
  arrays[prefix + "moduli"] =
      std::vector<double>{region.shear_modulus, region.pointwise_lambda, region.averaged_lambda};
  arrays[prefix + "nodes"] = region.nodes;
  arrays[prefix + "weights"] = region.weights;
  arrays[prefix + "modulus"] = region.modulus;
  if (!region.fibres.empty()) {
    std::vector<double> fibres;
    for (const auto& [direction, modulus] : region.fibres)
      fibres.insert(fibres.end(), {direction.x(), direction.y(), direction.z(), modulus});
    arrays[prefix + "fibres"] = std::move(fibres);
  }
  arrays[prefix + "begin"] = std::vector<int>(region.begin.begin(), region.begin.end());
  arrays[prefix + "point_nodes"] = region.point_nodes;
  arrays[prefix + "gradients"] = flat(region.gradients);
  arrays[prefix + "cell"] = region.cell;
  arrays[prefix + "psi"] = region.psi;
}

void take_points(TakenArrays& arrays, ElasticRegion& region) {
  std::vector<double> moduli, gradients, fibres;
  std::vector<int> begin;
  arrays.take("moduli", moduli);
  arrays.take("nodes", region.nodes);
  arrays.take("weights", region.weights);
  arrays.take("modulus", region.modulus);
  arrays.take_if_there("fibres", fibres);
  arrays.take("begin", begin);
  arrays.take("point_nodes", region.point_nodes);
  arrays.take("gradients", gradients);
  arrays.take("cell", region.cell);
  arrays.take("psi", region.psi);
  arrays.expect(moduli.size() == 3 && gradients.size() % 3 == 0 &&
                (fibres.empty() || fibres.size() == 4 * region.weights.size()));
  if (!arrays.whole()) return;
  region.shear_modulus = moduli[0];
  region.pointwise_lambda = moduli[1];
  region.averaged_lambda = moduli[2];
  for (std::size_t i = 0; i < fibres.size(); i += 4)
    region.fibres.push_back({Vec3::Map(fibres.data() + i), fibres[i + 3]});
  region.gradients = vectors(gradients);
  region.begin.assign(begin.begin(), begin.end());
}

}  // namespace viscera
