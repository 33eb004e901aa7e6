// Organs' shapes: the contact problem's forces, what they displace, and the drawn surface.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "engine/features/deformation/deformation_flags.h"
#include "engine/simulation/feature.h"

namespace viscera {

class GpuSurfaces;

/// Deforms drawn surfaces; none: the CPU does.
struct GpuOrgans {
  std::shared_ptr<GpuSurfaces> surfaces;
};

/// Solves contact on one organ, its last cells held by what yields as this matrix says.
using SolveContact = std::function<void(Entity organ, const MatrixX& backing)>;

/// What ties organs together, so that their contact is solved as one: links.
struct Binding {
  void (*solve)(World&, const SolveContact&) = nullptr;  ///< of all bound organs
  bool (*solves)(const World&, Entity organ) = nullptr;  ///< whether that answered for this one
};

/// The device has failed: from now on all organs are the CPU's, which makes what their last shapes
/// lack. Nothing to do where none is on the GPU.
void leave_gpu(World& world, const std::string& why);
/// Shapes whose displacements lie on a device count as the CPU's, without them.
void forget_device_shapes(World& world);

/// That and why an organ's elasticity isn't prepared.
SkippedReport skipped_elasticity(const OrganDescription& organ);
std::vector<std::string> deformation_warnings(const World& world);

Feature deformation_feature();

}  // namespace viscera
