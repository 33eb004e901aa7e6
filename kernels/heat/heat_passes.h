// The passes of a step of heat as Bioheat drives them, whatever computes them: here the CPU, in
// engine/gpu/gpu_heat.h the GPU.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "kernels/heat/bioheat_passes.h"

namespace viscera {

/// What an organ's passes are of; from start() to finish().
struct HeatModel {
  const BioheatNumbers* numbers = nullptr;
  const ThermalTissue* tissue = nullptr;
  const SurfaceCooling* cooling = nullptr;
};

/// What the rates of all warm bricks sum up to.
struct HeatFlows {
  double living = 0.0;    ///< of living excess [K]
  double boundary = 0.0;  ///< of flow out to where there was no room [W/m]
  double source = 0.0;    ///< [W/m3]
  float fastest = 0.0f;   ///< rate at which a voxel follows its neighbours [1/s]
};

/// Steps the warm bricks of one organ. Between start() and finish() only the passes know the
/// fields; a device may keep them for longer, until fetch().
class HeatPasses {
 public:
  virtual ~HeatPasses() = default;

  /// Begins a step of these bricks, in their order. False: it can't, for trouble(), and nothing has
  /// happened.
  virtual bool start(std::span<HeatBrick* const> warm, const HeatModel& model) = 0;
  /// prepare_brick and find_rates. After a failure the flows are nothing.
  virtual HeatFlows prepare() = 0;
  /// find_rates, with what prepare() found.
  virtual HeatFlows rates() = 0;
  virtual void advance(double dt) = 0;  ///< advance_brick
  /// advance_stage; `dt` of the whole super step.
  virtual void advance_stage(const SuperStage& stage, int j, double dt) = 0;
  virtual void settle(double dt) = 0;  ///< settle_brick
  /// Ends the step: the bricks have their sums, vapour, greatest temperature and borders, and where
  /// `fields` their fields. False: the device failed, see trouble(), and the fields are as they
  /// were when they last came.
  virtual bool finish(bool fields) = 0;
  /// Brings fields that the device has kept; of bricks of the last step.
  virtual bool fetch(std::span<HeatBrick* const> bricks) = 0;
  virtual const std::string& trouble() const = 0;
};

class CpuHeatPasses final : public HeatPasses {
 public:
  bool start(std::span<HeatBrick* const> warm, const HeatModel& model) override;
  HeatFlows prepare() override;
  HeatFlows rates() override;
  void advance(double dt) override;
  void advance_stage(const SuperStage& stage, int j, double dt) override;
  void settle(double dt) override;
  bool finish(bool fields) override;
  bool fetch(std::span<HeatBrick* const>) override { return true; }
  const std::string& trouble() const override { return trouble_; }

 private:
  template <class Body>
  void for_warm(const Body& body);

  std::span<HeatBrick* const> warm_;  // from start() to finish()
  HeatModel model_;
  std::string trouble_;  // never
};

}  // namespace viscera
