#include "engine/systems/view.h"

#include <algorithm>
#include <cmath>

#include "engine/systems/gpu_surfaces.h"
#include "kernels/contact/deformation.h"
#include "kernels/smoke/sight.h"

namespace viscera {
namespace {

/// The shaft is drawn this far beyond its trocar: to a handle nobody sees [m].
constexpr double kShaftBeyondTrocar = 0.15;
/// What a surgeon looks at about a tip: a disc of this radius [m].
constexpr double kAroundTip = 10e-3;

template <class Value>
KeyFrames camera_path(const CameraDescription& description, Value value) {
  std::vector<double> times;
  std::vector<Vec3> values;
  for (const CameraKey& key : description.path) {
    times.push_back(key.time);
    values.push_back(value(key));
  }
  return KeyFrames(std::move(times), std::move(values));
}

InstrumentView instrument_view(const World& world, std::size_t i) {
  const Entity instrument = world.instrument_bodies.owner(i);
  const InstrumentBody& body = world.instrument_bodies[i];
  const InstrumentState& state = *world.instrument_states.find(instrument);
  InstrumentView view;
  view.id = instrument.index;
  view.name = body.description.name;
  switch (body.description.kind) {
    case InstrumentKind::kProbe:
      view.kind = InstrumentView::Kind::kProbe;
      break;
    case InstrumentKind::kGrasper:
      view.kind = InstrumentView::Kind::kGrasper;
      break;
    case InstrumentKind::kHook:
      view.kind = InstrumentView::Kind::kHook;
      break;
    case InstrumentKind::kSpatula:
      view.kind = InstrumentView::Kind::kSpatula;
      break;
  }
  if (!body.mesh.empty()) {
    view.kind = InstrumentView::Kind::kMesh;
    view.mesh = &body.mesh;
  }
  view.tip = state.tip;
  view.shaft_direction = state.shaft_direction;
  view.side_direction = state.side_direction;
  view.shaft_radius = body.description.shaft_radius;
  view.shaft_length = (body.description.trocar - state.tip).norm() + kShaftBeyondTrocar;
  view.tip_radius = body.description.tip.radius;
  view.jaw = std::clamp(state.jaw, 0.0, 1.0);
  view.energised = state.power > 0.0;
  return view;
}

/// Of what is mixed into the whole cavity [kg/m3].
double background_density(const World& world, const SmokeBody& smoke) {
  return smoke.volume.book().background / world.gas.description.cavity;
}

double background_of(const World& world) {
  double density = 0.0;
  for (const SmokeBody& smoke : world.smoke) density += background_density(world, smoke);
  return density;
}

}  // namespace

Endoscope::Endoscope(const CameraDescription& description)
    : description_(description),
      tip_(camera_path(description, [](const CameraKey& key) { return key.tip; })),
      target_(camera_path(description, [](const CameraKey& key) { return key.target; })),
      roll_(camera_path(description,
                        [](const CameraKey& key) { return Vec3(key.roll, 0.0, 0.0); })) {}

CameraView Endoscope::at(double time) const {
  CameraView view;
  view.position = tip_.at(time);
  const Vec3 axis = (target_.at(time) - view.position).normalized();
  const Vec3 upright = std::abs(axis.z()) < 0.999 ? Vec3::UnitZ() : Vec3::UnitY();
  const Vec3 right0 = axis.cross(upright).normalized();
  const Eigen::AngleAxisd roll(roll_.at(time).x(), axis);
  const Vec3 right = roll * right0;
  view.forward = Eigen::AngleAxisd(-description_.optics, right) * axis;
  view.up = right.cross(view.forward).normalized();
  view.field_of_view = description_.field_of_view;
  view.round_mask = description_.round_mask;
  return view;
}

Vec3 light_colour(double temperature) {
  // Planck's law at the peaks of the sRGB primaries; enough for a tint.
  const Vec3 wavelengths(611e-9, 549e-9, 465e-9);
  const double c2 = 1.438777e-2;  // second radiation constant [m K]
  Vec3 colour;
  for (int c = 0; c < 3; ++c)
    colour[c] = std::expm1(c2 / (wavelengths[c] * 5600.0)) /
                std::expm1(c2 / (wavelengths[c] * temperature));
  return colour / colour.maxCoeff();
}

std::optional<double> sight_of_tips(const World& world, const CameraView& camera) {
  SmokyCavity cavity;
  std::vector<const SmokeGrid*> grids;
  for (const SmokeBody& smoke : world.smoke)
    if (!smoke.grid.density.empty()) grids.push_back(&smoke.grid);
  cavity.grids = grids;
  cavity.background = background_of(world);
  cavity.optics = world.smoke_optics;
  std::optional<double> least;
  const auto look_at = [&](Entity instrument) {
    const Vec3& tip = world.instrument_states.find(instrument)->tip;
    const double seen = mean_transmittance(cavity, camera.position, tip, kAroundTip);
    least = std::min(least.value_or(1.0), seen);
  };
  for (std::size_t i = 0; i < world.burn_traces.size(); ++i) look_at(world.burn_traces.owner(i));
  if (least) return least;
  for (std::size_t i = 0; i < world.instrument_bodies.size(); ++i)
    look_at(world.instrument_bodies.owner(i));
  return least;
}

void splat_smoke(World& world) {
  for (SmokeBody& smoke : world.smoke) {
    if (smoke.volume.particles().size() == 0 && smoke.grid.density.empty()) continue;
    splat(smoke.volume, smoke.description.voxel, smoke.grid);
    if (smoke.description.look != SmokeLook::kSprites) continue;
    const SmokeParticles& particles = smoke.volume.particles();
    smoke.particle_places.clear();
    smoke.particle_radii.clear();
    for (std::size_t i = 0; i < particles.size(); ++i) {
      smoke.particle_places.push_back(particles.position(i));
      smoke.particle_radii.push_back(spread_radius(smoke.volume.parameters(), particles.age(i)));
    }
  }
}

void make_normals(const OrganModel& model, OrganState& state) {
  if (state.normals_fit || state.on_gpu) return;
  deformed_normals(model.drawn, state.positions, state.normals);
  state.normals_fit = true;
}

FrameView make_view(World& world, const SceneDescription& scene, const Endoscope& endoscope,
                    std::uint64_t picture) {
  FrameView view;
  view.camera = endoscope.at(world.time());
  view.light_intensity = scene.light.intensity;
  view.light_colour = light_colour(scene.light.colour_temperature);
  view.frame = picture;
  view.gas_temperature = scene.gas.temperature;
  for (std::size_t o = 0; o < world.organ_bodies.size(); ++o) {
    const Entity organ = world.organ_bodies.owner(o);
    const OrganBody& body = world.organ_bodies[o];
    OrganState& state = *world.organ_states.find(organ);
    make_normals(*body.model, state);
    OrganView drawn;
    drawn.id = organ.index;
    drawn.name = body.name;
    drawn.rest = &body.model->surface;
    drawn.positions = state.positions;
    drawn.normals = state.normals;
    if (state.on_gpu) drawn.device = world.gpu->surface(organ);
    drawn.surface_version = state.version;
    drawn.pose = body.pose;
    drawn.look = body.tissue.look;
    drawn.temperature = scene.gas.temperature;
    if (const OrganBurn* burn = world.organ_burns.find(organ);
        burn && burn->heat.bricks().count() > 0) {
      drawn.burn = &burn->heat.bricks();
      drawn.burn_version = burn->heat.version();
      drawn.temperature = burn->heat.options().body;
    }
    view.organs.push_back(drawn);
  }
  for (std::size_t i = 0; i < world.instrument_bodies.size(); ++i)
    view.instruments.push_back(instrument_view(world, i));
  for (const SmokeBody& smoke : world.smoke) {
    if (smoke.grid.density.empty()) continue;
    SmokeView drawn;
    drawn.domain = smoke.grid.domain;
    drawn.size = smoke.grid.size;
    drawn.density = smoke.grid.density;
    drawn.temperature = smoke.grid.temperature;
    drawn.optics = world.smoke_optics;
    drawn.background = background_density(world, smoke);
    if (smoke.description.look == SmokeLook::kSprites &&
        smoke.particle_radii.size() == smoke.volume.particles().size()) {
      drawn.look = SmokeView::Look::kSprites;
      drawn.particles = smoke.particle_places;
      drawn.particle_radii = smoke.particle_radii;
      drawn.particle_masses = smoke.volume.particles().masses;
    }
    view.smoke.push_back(drawn);
  }
  return view;
}

}  // namespace viscera
