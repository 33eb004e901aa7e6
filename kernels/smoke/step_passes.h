// The passes of a step as SmokeVolume drives them, whatever computes them: here the CPU, in
// engine/gpu/gpu_smoke.h the GPU.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kernels/smoke/bin.h"
#include "kernels/smoke/collide.h"
#include "kernels/smoke/smoke_particles.h"
#include "kernels/smoke/smoke_passes.h"
#include "kernels/smoke/splat.h"
#include "kernels/smoke/surface_cells.h"
#include "kernels/smoke/surrounding_gas.h"
#include "kernels/smoke/viscosity.h"

namespace viscera {

/// When in a step surfaces are met, and how near.
struct SurfaceMeeting {
  double fraction = 1.0;  ///< of the step that surfaces have made
  double dt = 0.0;        ///< of the whole step [s]
  float cell = 0.0f;      ///< edge of the surface cells [m]
  SurfaceReach reach;     ///< in which surfaces count
};

/// Holds a volume's particles from start() to finish(); between them only the passes know where
/// these are. One object may serve several volumes, one after another.
class SmokePasses {
 public:
  virtual ~SmokePasses() = default;

  /// Takes the particles over. False: it can't, for trouble(), and nothing has happened.
  virtual bool start(SmokeParticles& particles) = 0;
  /// bin and viscosity: the neighbours' accelerations, for all integrations until the next.
  /// `parameters.particles` is filled in here, as in the other passes.
  virtual void exchange(float cell, ViscosityParameters parameters) = 0;
  /// integrate; where gas is given, with its velocity.
  virtual void integrate(IntegrateParameters parameters, std::span<const SwirlWave> waves,
                         SurroundingGas* gas) = 0;
  /// collide, with the cells built around the particles where they are now. The counts' deposited
  /// mass may be left to finish().
  virtual CollideCounts collide(SurfaceCells& cells, const SurfaceMeeting& meeting,
                                std::span<const SmokeCapsule> capsules,
                                CollideParameters parameters) = 0;
  virtual float greatest_speed() = 0;          ///< now [m/s]
  virtual std::uint64_t isolated() const = 0;  ///< particles, in the last exchange
  /// Gives the particles back, in any order, with their fates. The mass that touching ones have
  /// left on surfaces since start() [kg]; nothing: the device failed, see trouble(), and the
  /// particles are as they were at start().
  virtual std::optional<double> finish(SmokeParticles& particles,
                                       std::vector<SmokeFate>& fates) = 0;
  /// splat.h, of particles that the caller has. False: it can't, and the grid holds nothing of use.
  virtual bool splat(const SmokeParticles& particles, SplatParameters& parameters,
                     SmokeGrid& grid) = 0;
  virtual const std::string& trouble() const = 0;
  virtual std::size_t memory_bytes() const = 0;  ///< of the CPU
};

class CpuSmokePasses final : public SmokePasses {
 public:
  bool start(SmokeParticles& particles) override;
  void exchange(float cell, ViscosityParameters parameters) override;
  void integrate(IntegrateParameters parameters, std::span<const SwirlWave> waves,
                 SurroundingGas* gas) override;
  CollideCounts collide(SurfaceCells& cells, const SurfaceMeeting& meeting,
                        std::span<const SmokeCapsule> capsules,
                        CollideParameters parameters) override;
  float greatest_speed() override;
  std::uint64_t isolated() const override { return viscosity_.isolated(); }
  std::optional<double> finish(SmokeParticles& particles, std::vector<SmokeFate>& fates) override;
  bool splat(const SmokeParticles& particles, SplatParameters& parameters,
             SmokeGrid& grid) override;
  const std::string& trouble() const override { return trouble_; }
  std::size_t memory_bytes() const override;

  /// Adds what "bin", "viscosity", "integrate" (without what the gas is asked), "collide" (with
  /// the surface cells) and "splat" take to `seconds`; null: nothing is timed.
  void time_with(std::map<std::string, double>* seconds) { seconds_ = seconds; }

 private:
  template <class Pass>
  void timed(const char* name, const Pass& pass);

  std::map<std::string, double>* seconds_ = nullptr;
  SmokeParticles* particles_ = nullptr;  // from start() to finish()
  std::vector<SmokeFate> fates_;
  double deposited_ = 0.0;
  SmokeBins bins_;
  ViscosityPass viscosity_;
  std::vector<Float4> gas_;  // u; w: eddies
  std::string trouble_;
};

}  // namespace viscera
