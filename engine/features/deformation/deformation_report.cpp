#include "engine/features/deformation/deformation.h"
#include "engine/features/deformation/gpu_surfaces.h"
#include "engine/features/deformation/linear_limits.h"

namespace viscera {

SkippedReport skipped_elasticity(const OrganDescription& organ) {
  return {"elasticity of " + organ.name, organ.deformable
                                             ? "no instrument, link or change of gravity reaches it"
                                             : "scenery: deformable is false"};
}

std::vector<std::string> deformation_warnings(const World& world) {
  std::vector<std::string> warnings = linear_limit_warnings(world);
  const GpuOrgans* gpu = world.one<GpuOrgans>();
  if (gpu && !gpu->surfaces->trouble().empty())
    warnings.push_back(gpu->surfaces->trouble() + ": they went on on the CPU");
  return warnings;
}

}  // namespace viscera
