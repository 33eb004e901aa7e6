#include "engine/run/view.h"

#include <algorithm>
#include <cmath>

#include "engine/features/bag/bag_keys.h"
#include "engine/features/cautery/cautery.h"
#include "engine/features/clips/clips.h"
#include "engine/features/deformation/deformation.h"
#include "engine/features/deformation/gpu_surfaces.h"
#include "engine/features/gas/gas.h"
#include "engine/features/parting/parting.h"
#include "engine/features/smoke/smoke.h"
#include "engine/run/strands.h"
#include "kernels/contact/deformation.h"
#include "kernels/smoke/fog.h"
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
  const Entity instrument = world.all<InstrumentBody>().owner(i);
  const InstrumentBody& body = world.all<InstrumentBody>()[i];
  const InstrumentState& state = *world.find<InstrumentState>(instrument);
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
    case InstrumentKind::kScalpel:
      view.kind = InstrumentView::Kind::kScalpel;
      break;
    case InstrumentKind::kScissors:
      view.kind = InstrumentView::Kind::kScissors;
      break;
    case InstrumentKind::kClipApplier:
      view.kind = InstrumentView::Kind::kClipApplier;
      break;
    case InstrumentKind::kBag:
      view.kind = InstrumentView::Kind::kBag;
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
  if (const BladeDescription* blade = blade_of(body.description)) view.blade_length = blade->length;
  if (const BagDescription* bag = bag_of(body.description)) {
    view.mouth_radius = 0.5 * bag->mouth;
    view.sack_depth = bag->depth;
  }
  view.jaw = std::clamp(state.jaw, 0.0, 1.0);
  view.energised = state.power > 0.0;
  return view;
}

/// All clips that an applier was loaded with: on organs, one between its jaws while these are open,
/// the others in its shaft.
void add_clips(const World& world, std::size_t i, std::vector<InstrumentView>& views) {
  const Entity applier = world.all<AppliedClips>().owner(i);
  const AppliedClips& applied = world.all<AppliedClips>()[i];
  const InstrumentDescription& tool = world.find<InstrumentBody>(applier)->description;
  const InstrumentState& state = *world.find<InstrumentState>(applier);
  const ClipsDescription& clips = *clips_of(tool);
  constexpr double kInShaft = 40e-3;  // behind the tip [m]
  constexpr std::uint32_t kIds = 1u << 31, kIdsEach = 32;
  for (std::size_t c = 0; c < static_cast<std::size_t>(clips.count); ++c) {
    InstrumentView view;
    view.id = kIds + static_cast<std::uint32_t>(i) * kIdsEach + static_cast<std::uint32_t>(c);
    view.name = tool.name + " clip " + std::to_string(c + 1);
    view.kind = InstrumentView::Kind::kClip;
    view.tip_radius = 0.5 * clips.width;
    view.blade_length = clips.length;
    if (c < applied.clips.size()) {
      const Clip& clip = applied.clips[c];
      const Pose& pose = pose_of(world, clip.organ);
      view.tip = pose.to_world(clip.pose.centre);
      view.shaft_direction = pose.direction_to_world(clip.pose.axes.col(0));
      view.side_direction = pose.direction_to_world(clip.pose.axes.col(1));
      view.jaw = clip.apart;
    } else {
      const bool next = c == applied.clips.size() && !applied.closed;
      view.shaft_direction = state.shaft_direction;
      view.side_direction = state.side_direction;
      view.tip = state.tip + (next ? 0.5 * clips.length : kInShaft) * state.shaft_direction;
      view.jaw = next ? clips.opening : 0.0;
    }
    views.push_back(std::move(view));
  }
}

/// Of what is mixed into the whole cavity [kg/m3].
double background_density(const World& world, const SmokeBody& smoke) {
  return smoke.volume.book().background / gas_of(world.model().scene()).cavity;
}

const SmokeOptics& optics_of(const World& world) {
  static const SmokeOptics kUnread;
  const SmokeSight* sight = world.one<SmokeSight>();
  return sight ? sight->optics : kUnread;
}

double background_of(const World& world) {
  double density = 0.0;
  for (const SmokeBody& smoke : world.all<SmokeBody>()) density += background_density(world, smoke);
  return density;
}

/// Where walls of a cut meet the skin the normal is the skin's: its triangles there are long, and
/// would be shaded as walls in part.
void take_normals_of_skin(const TriangleSurface& surface, std::span<const float> depths,
                          std::span<const Vec3f> positions, std::vector<Vec3f>& normals) {
  const auto each = [&](const auto& visit) {
    for (const std::array<int, 3>& corners : surface.triangles)
      visit(corners, std::ranges::any_of(corners, [&](int corner) {
              return depths[static_cast<std::size_t>(corner)] > 0.0f;
            }));
  };
  std::vector<char> meets_wall(normals.size(), 0);
  each([&](const std::array<int, 3>& corners, bool wall) {
    if (!wall) return;
    for (const int corner : corners) meets_wall[static_cast<std::size_t>(corner)] = 1;
  });
  std::vector<Vec3f> of_skin(normals.size(), Vec3f::Zero());
  each([&](const std::array<int, 3>& corners, bool wall) {
    if (wall) return;
    const auto at = [&](std::size_t c) -> const Vec3f& {
      return positions[static_cast<std::size_t>(corners[c])];
    };
    const Vec3f area = (at(1) - at(0)).cross(at(2) - at(0));
    for (const int corner : corners) of_skin[static_cast<std::size_t>(corner)] += area;
  });
  for (std::size_t v = 0; v < normals.size(); ++v)
    if (meets_wall[v] && of_skin[v].norm() > 0.0f) normals[v] = of_skin[v].normalized();
}

/// The world's smoke as light goes through it; points into `smoke`.
struct SmokeInSight {
  SmokeInSight(const World& world, std::span<const ShownSmoke> smoke) {
    for (const ShownSmoke& shown : smoke)
      if (!shown.grid.density.empty()) grids.push_back(&shown.grid);
    cavity = {grids, background_of(world), optics_of(world)};
  }
  SmokeInSight(const SmokeInSight&) = delete;

  std::vector<const SmokeGrid*> grids;
  SmokyCavity cavity;
};

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
  view.distance = (target_.at(time) - view.position).norm();
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

std::optional<double> sight_of_tips(const World& world, std::span<const ShownSmoke> smoke,
                                    const CameraView& camera) {
  const SmokeInSight in_sight(world, smoke);
  const SmokyCavity& cavity = in_sight.cavity;
  std::optional<double> least;
  const auto look_at = [&](Entity instrument) {
    const Vec3& tip = world.find<InstrumentState>(instrument)->tip;
    const double seen = mean_transmittance(cavity, camera.position, tip, kAroundTip);
    least = std::min(least.value_or(1.0), seen);
  };
  for (std::size_t i = 0; i < world.all<BurnTrace>().size(); ++i)
    look_at(world.all<BurnTrace>().owner(i));
  if (least) return least;
  for (std::size_t i = 0; i < world.all<InstrumentBody>().size(); ++i)
    look_at(world.all<InstrumentBody>().owner(i));
  return least;
}

double sight_of_view(const World& world, std::span<const ShownSmoke> smoke,
                     const CameraView& camera) {
  const SmokeInSight in_sight(world, smoke);
  return mean_transmittance(in_sight.cavity, camera.position,
                            camera.position + camera.distance * camera.forward,
                            camera.distance * std::tan(0.5 * camera.field_of_view));
}

void splat_smoke(const World& world, std::vector<ShownSmoke>& shown) {
  const Pool<SmokeSource>& sources = world.all<SmokeSource>();
  shown.resize(sources.size());
  const SmokeOptics& optics = optics_of(world);
  for (std::size_t s = 0; s < shown.size(); ++s) {
    const SmokeDescription& description = sources[s].description;
    const SmokeBody& smoke = *world.find<SmokeBody>(sources.owner(s));
    ShownSmoke& one = shown[s];
    one.optics = optics;
    one.particle_places.clear();
    one.particle_radii.clear();
    if (smoke.most_particles == 0) {
      one.grid = {};
      continue;
    }
    splat(smoke.volume, description.voxel, one.grid);
    if (description.look != SmokeLook::kSprites) continue;
    const SmokeParticles& particles = smoke.volume.particles();
    for (std::size_t i = 0; i < particles.size(); ++i) {
      one.particle_places.push_back(particles.position(i));
      one.particle_radii.push_back(spread_radius(smoke.volume.parameters(), particles.age(i)));
    }
  }
  const GasBody* gas = world.one<GasBody>();
  const SmokeSight* sight = world.one<SmokeSight>();
  if (!gas || !gas->grid || !sight || !sight->fog) return;
  ShownSmoke fog;
  fog.optics = {optics.mass_extinction, 1.0, 0.0};
  fog.grid = fog_of(*gas->grid, *sight->fog, optics.mass_extinction, fog.optics.asymmetry);
  if (!fog.grid.density.empty()) shown.push_back(std::move(fog));
}

std::span<const Vec3f> ShownNormals::of(const World& world, std::size_t organ) {
  const OrganState& state = *world.find<OrganState>(world.all<OrganBody>().owner(organ));
  if (state.normals_fit || state.on_gpu) return state.normals;
  made_.resize(std::max(made_.size(), world.all<OrganBody>().size()));
  Made& made = made_[organ];
  if (!made.fits || made.version != state.version) {
    const OrganModel& model = *world.all<OrganBody>()[organ].model;
    deformed_normals(model.drawn, state.positions, made.normals);
    const OrganLeft* left = world.find<OrganLeft>(world.all<OrganBody>().owner(organ));
    if (left && !left->depths.empty())
      take_normals_of_skin(model.surface, left->depths, state.positions, made.normals);
    made.version = state.version;
    made.fits = true;
  }
  return made.normals;
}

FrameView make_view(const World& world, Shown& shown, const SceneDescription& scene,
                    const Endoscope& endoscope, std::uint64_t picture) {
  FrameView view;
  view.camera = endoscope.at(world.time());
  view.light_intensity = scene.light.intensity;
  view.light_colour = light_colour(scene.light.colour_temperature);
  view.frame = picture;
  view.gas_temperature = gas_of(scene).temperature;
  for (std::size_t o = 0; o < world.all<OrganBody>().size(); ++o) {
    const Entity organ = world.all<OrganBody>().owner(o);
    const OrganBody& body = world.all<OrganBody>()[o];
    const OrganState& state = *world.find<OrganState>(organ);
    OrganView drawn;
    drawn.id = organ.index;
    drawn.name = body.name;
    drawn.rest = &body.model->surface;
    drawn.positions = state.positions;
    drawn.normals = shown.normals.of(world, o);
    if (const OrganLeft* left = world.find<OrganLeft>(organ)) drawn.depths = left->depths;
    if (state.on_gpu) drawn.device = world.one<GpuOrgans>()->surfaces->surface(organ);
    drawn.surface_version = state.version;
    drawn.pose = pose_of(world, organ);
    drawn.look = body.tissue.look;
    drawn.temperature = view.gas_temperature;
    if (const OrganBurn* burn = world.find<OrganBurn>(organ);
        burn && burn->heat.bricks().count() > 0) {
      drawn.burn = &burn->heat.bricks();
      drawn.burn_version = burn->heat.version();
      drawn.temperature = burn->heat.options().body;
    }
    view.organs.push_back(drawn);
  }
  for (std::size_t i = 0; i < world.all<InstrumentBody>().size(); ++i)
    view.instruments.push_back(instrument_view(world, i));
  for (std::size_t i = 0; i < world.all<AppliedClips>().size(); ++i)
    add_clips(world, i, view.instruments);
  const Pool<Bed>& beds = world.all<Bed>();
  shown.strands.resize(beds.size());
  for (std::size_t b = 0; b < beds.size(); ++b) {
    shown.strands[b] = strand_halves(world, beds.owner(b));
    view.beds.push_back({beds.owner(b).index, beds[b].name, shown.strands[b]});
  }
  const Pool<SmokeSource>& sources = world.all<SmokeSource>();
  for (std::size_t s = 0; s < std::min(shown.smoke.size(), sources.size()); ++s) {
    const SmokeBody& smoke = *world.find<SmokeBody>(sources.owner(s));
    const ShownSmoke& as_shown = shown.smoke[s];
    const SmokeGrid& grid = as_shown.grid;
    if (grid.density.empty()) continue;
    SmokeView drawn;
    drawn.domain = grid.domain;
    drawn.size = grid.size;
    drawn.density = grid.density;
    drawn.temperature = grid.temperature;
    drawn.optics = as_shown.optics;
    drawn.background = background_density(world, smoke);
    if (sources[s].description.look == SmokeLook::kSprites &&
        as_shown.particle_radii.size() == smoke.volume.particles().size()) {
      drawn.look = SmokeView::Look::kSprites;
      drawn.particles = as_shown.particle_places;
      drawn.particle_radii = as_shown.particle_radii;
      drawn.particle_masses = smoke.volume.particles().masses;
    }
    view.smoke.push_back(drawn);
  }
  for (std::size_t s = sources.size(); s < shown.smoke.size(); ++s) {
    const ShownSmoke& fog = shown.smoke[s];
    SmokeView drawn;
    drawn.domain = fog.grid.domain;
    drawn.size = fog.grid.size;
    drawn.density = fog.grid.density;
    drawn.optics = fog.optics;
    view.smoke.push_back(drawn);
  }
  return view;
}

}  // namespace viscera
