#include "tools/bench/bench_pressure.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "engine/features/contact/contact.h"
#include "engine/features/touching/touching.h"
#include "engine/io/interrupt.h"
#include "engine/simulation/frame.h"
#include "engine/simulation/prepare.h"
#include "engine/simulator/build.h"
#include "engine/verification/uniaxial.h"
#include "kernels/base/stopwatch.h"
#include "kernels/finite/finite_solver.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

constexpr std::size_t kBlock = 0, kPlate = 2;

double force_on_plate(const World& world) {
  double force = 0.0;
  const Pool<OrganPair>& pairs = world.all<OrganPair>();
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
      if (pairs[p].organs[side] != world.model().organs()[kPlate]) continue;
      for (const Meeting& meeting : world.find<PairState>(pairs.owner(p))->meetings)
        force += (side == 0 ? 1.0 : -1.0) * meeting.force.z();
    }
  }
  return force;
}

/// How far a vertex of the block lies below the floor's face or above the plate's.
double overlap(const World& world, double press) {
  const Entity block = world.model().organs()[kBlock];
  double most = 0.0;
  for (const Vec3f& position : world.find<OrganState>(block)->positions) {
    const double z = pose_of(world, block).to_world(position.cast<double>()).z();
    most = std::max({most, -z, z - (kPressedBlockHeight - press)});
  }
  return most;
}

}  // namespace

const PressureFrame* PressureCurve::first_refused() const {
  const auto found =
      std::ranges::find_if(frames, [](const PressureFrame& frame) { return !frame.flags.empty(); });
  return found == frames.end() ? nullptr : &*found;
}

double PressureCurve::greatest_error(double from_pressure) const {
  double most = 0.0;
  for (const PressureFrame& frame : frames) {
    if (!frame.flags.empty()) break;
    if (frame.pressure >= from_pressure)
      most = std::max(most, std::abs(frame.force / frame.exact - 1.0));
  }
  return most;
}

double PressureCurve::greatest_overlap() const {
  double most = 0.0;
  for (const PressureFrame& frame : frames) {
    if (!frame.flags.empty()) break;
    most = std::max(most, frame.overlap);
  }
  return most;
}

Result<PressureCurve> press_block(const IsotropicMaterial& material, double until,
                                  BlockBetweenPlates options) {
  options.press = (1.0 - pressed_to(material, until).stretch) * kPressedBlockHeight;
  Tissue rubber;
  rubber.name = "rubber";
  rubber.elastic = material;
  std::vector<std::string> warnings;
  auto model = build_model(block_between_plates(options), {{"rubber", rubber}},
                           {assets_folder(), false}, until_interrupted(), warnings);
  if (!model) return std::unexpected(model.error());
  auto world = start_world(*std::move(model));
  if (!world) return std::unexpected(world.error());
  Trace trace(stage_names());
  PressureCurve curve{.material = material, .frames = {}};
  const Entity block = (*world)->model().organs()[kBlock],
               plate = (*world)->model().organs()[kPlate];
  const double began = pose_of(**world, plate).position.z();
  while ((*world)->time() < options.time - 1e-9) {
    if (interrupted()) return failure(kCancelled);
    PressureFrame frame;
    const Stopwatch watch;
    frame.flags = step_frame(**world, trace).flags;
    frame.took = watch.seconds();
    frame.press = began - pose_of(**world, plate).position.z();
    const UniaxialAnswer exact = uniaxial(material, 1.0 - frame.press / kPressedBlockHeight);
    frame.pressure = exact.pressure;
    frame.exact = -exact.nominal * kPressedBlockSide * kPressedBlockSide;
    frame.force = force_on_plate(**world);
    frame.overlap = overlap(**world, frame.press);
    if (const FiniteStep* step = (*world)->find<OrganTouch>(block)->solver->last_step())
      frame.residual = step->residual;
    curve.frames.push_back(std::move(frame));
  }
  return curve;
}

void print_pressure(const PressureCurve& curve, std::ostream& out) {
  const double modulus = curve.material.youngs_modulus;
  out << fmt::format("{:>12}{:>10}{:>12}{:>12}{:>9}{:>10}{:>12}  flags\n", "pressure / E",
                     "pressed", "force", "by its law", "error", "residual", "overlap");
  double next = 0.1;
  for (const PressureFrame& frame : curve.frames) {
    if (frame.pressure < (next - 1e-3) * modulus) continue;
    next += 0.1;
    out << fmt::format(
        "{:>12.2f}{:>7.2f} mm{:>10.4f} N{:>10.4f} N{:>7.1f} %{:>10.1e}{:>9.2f} mm  {}\n",
        frame.pressure / modulus, 1e3 * frame.press, frame.force, frame.exact,
        100.0 * (frame.force / frame.exact - 1.0), frame.residual, 1e3 * frame.overlap,
        fmt::join(frame.flags.names(), " "));
  }
}

}  // namespace viscera
