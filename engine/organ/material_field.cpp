#include "engine/organ/material_field.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/organ/part_shapes.h"

namespace viscera {
namespace {

std::string place_text(const Vec3& x) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) mm", 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
}

Error at_part(std::size_t number, const Error& error) {
  Error named;
  for (const std::string& message : error.messages)
    named.messages.push_back(fmt::format("parts/{}: {}", number, message));
  return named;
}

/// The first vertex where the map says nothing.
Result<void> covers(const ModulusMap& map, const TriangleSurface& surface) {
  for (const Vec3& vertex : surface.vertices)
    if (!map.known_at(vertex))
      return failure(fmt::format(
          "field: found no modulus at {} of the organ's surface, expected one in this voxel of {} "
          "or in one beside it: it must cover the organ",
          place_text(vertex), map.file().string()));
  return {};
}

}  // namespace

Result<MaterialField::Part> MaterialField::part_of(const PartDescription& description,
                                                   const TriangleSurface& surface,
                                                   const std::filesystem::path& assets,
                                                   double youngs_modulus) {
  Part part;
  part.stiffens = description.youngs_modulus.has_value();
  part.weighs = description.density.has_value();
  part.fibres = description.fibres;
  if (part.stiffens) part.modulus = *description.youngs_modulus / youngs_modulus;
  if (const auto* map = std::get_if<ModulusMapPart>(&description.where)) {
    auto read = ModulusMap::read(map->file, map->unit);
    if (!read) return std::unexpected(read.error());
    if (auto covered = covers(*read, surface); !covered) return std::unexpected(covered.error());
    part.share = [](const Vec3&, double) { return 1.0; };
    part.map = [read = std::make_shared<const ModulusMap>(std::move(*read)), youngs_modulus](
                   const Vec3& x, double edge) { return read->mean(x, edge) / youngs_modulus; };
    part.stiffens = true;
    return part;
  }
  auto share = part_share(description, surface, assets);
  if (!share) return std::unexpected(share.error());
  part.share = std::move(*share);
  return part;
}

Result<std::shared_ptr<const MaterialField>> MaterialField::make(
    const OrganDescription& organ, const Tissue& tissue, const TriangleSurface& surface,
    const std::filesystem::path& assets) {
  if (organ.parts.empty()) return std::shared_ptr<const MaterialField>();
  std::shared_ptr<MaterialField> field(new MaterialField());
  field->fibres_ = tissue.fibres;
  for (std::size_t p = 0; p < organ.parts.size(); ++p) {
    auto part = part_of(organ.parts[p], surface, assets, tissue.elastic.youngs_modulus);
    if (!part) return std::unexpected(at_part(p, part.error()));
    if (part->weighs) part->density = *organ.parts[p].density / tissue.density;
    field->parts_.push_back(std::move(*part));
  }
  return std::shared_ptr<const MaterialField>(std::move(field));
}

double MaterialField::modulus(const Vec3& x, double edge) const {
  double mean = 1.0;
  for (const Part& part : parts_) {
    if (!part.stiffens) continue;
    const double share = part.share(x, edge);
    if (share > 0.0) mean += share * ((part.map ? part.map(x, edge) : part.modulus) - mean);
  }
  return mean;
}

double MaterialField::density(const Vec3& x, double edge) const {
  double mean = 1.0;
  for (const Part& part : parts_)
    if (part.weighs) mean += part.share(x, edge) * (part.density - mean);
  return mean;
}

bool MaterialField::has_fibres() const {
  return fibres_.modulus > 0.0 || std::ranges::any_of(parts_, [](const Part& part) {
           return part.fibres && part.fibres->modulus > 0.0;
         });
}

Fibres MaterialField::fibres(const Vec3& x, double edge) const {
  const auto stiffness = [](const Fibres& of) -> Mat3 {
    return of.modulus * of.direction * of.direction.transpose();
  };
  Mat3 sum = stiffness(fibres_);
  const Fibres* only = &fibres_;  // null: several meet
  for (const Part& part : parts_) {
    if (!part.fibres) continue;
    const double share = part.share(x, edge);
    if (!(share > 0.0)) continue;
    sum += share * (stiffness(*part.fibres) - sum);
    only = share == 1.0 ? &*part.fibres : nullptr;
  }
  if (only) return *only;
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(sum);
  return {axes.eigenvectors().col(2), std::max(0.0, axes.eigenvalues()[2])};
}

Result<void> MaterialField::check(const PointCloud& cloud) const {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    bool meets = false;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      // Cubes of two spacings about nodes leave no tissue out.
      const Vec3& x = cloud.positions[i];
      const double edge = 2.0 * cloud.spacings[i];
      meets = meets || parts_[p].share(x, edge) > 0.0;
      if (parts_[p].map && std::isnan(parts_[p].map(x, edge)))
        return failure(fmt::format(
            "parts/{}: field: found no modulus at {} in the organ, expected one: it must cover it",
            p, place_text(x)));
    }
    if (!meets)
      return failure(fmt::format(
          "parts/{}: found nothing of it in the organ, expected a part that lies there, in the "
          "organ's own frame",
          p));
  }
  return {};
}

}  // namespace viscera
