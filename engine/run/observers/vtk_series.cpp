#include "engine/run/observers/vtk_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "engine/io/atomic_file.h"
#include "kernels/points/surface.h"

namespace viscera {
namespace {

bool same(const Pose& a, const Pose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

/// True when the contact's response holds for the state as it is.
bool has_forces(const OrganContact* contact, const OrganState& state) {
  return contact && !contact->cells.empty() && contact->solution.converged &&
         contact->solution.touching > 0 && !state.frozen;
}

int nearest_vertex(const TriangleSurface& surface, const Vec3& x) {
  const auto nearest = std::min_element(
      surface.vertices.begin(), surface.vertices.end(),
      [&x](const Vec3& a, const Vec3& b) { return (a - x).squaredNorm() < (b - x).squaredNorm(); });
  return static_cast<int>(nearest - surface.vertices.begin());
}

}  // namespace

ForceShares::ForceShares(const OrganModel& model) : shares_(model.touchable.places.size()) {
  std::vector<int> touchable(model.places.size(), -1);
  for (std::size_t t = 0; t < shares_.size(); ++t)
    touchable[model.touchable.places[t]] = static_cast<int>(t);
  const SparseWeights& carriers = model.drawn.carriers;
  const std::vector<double> areas = vertex_areas(model.surface);
  for (std::size_t v = 0; v < carriers.rows(); ++v) {
    for (int e = carriers.row_begin[v]; e < carriers.row_begin[v + 1]; ++e) {
      const int t = touchable[carriers.nodes[e]];
      // Weights that reproduce linear fields may be a little negative; a share of force can't.
      const double weight = areas[v] * carriers.values[e];
      if (t >= 0 && weight > 0.0)
        shares_[t].push_back({static_cast<int>(v), static_cast<float>(weight)});
    }
  }
  for (std::size_t t = 0; t < shares_.size(); ++t) {
    double sum = 0.0;
    for (const Share& share : shares_[t]) sum += share.weight;
    for (Share& share : shares_[t]) share.weight = static_cast<float>(share.weight / sum);
    if (shares_[t].empty())
      shares_[t] = {
          {nearest_vertex(model.surface, model.places.positions[model.touchable.places[t]]), 1.0f}};
  }
}

void ForceShares::add(const ContactResponse& response, std::vector<Vec3f>& forces) const {
  for (std::size_t i = 0; i < response.touched.size(); ++i)
    for (const Share& share : shares_[response.touched[i]])
      forces[share.vertex] += share.weight * response.loads[i].cast<float>();
}

VtkSeries::VtkSeries(const World& world)
    : Observer("surfaces", Looks::kWanted, RunStage::kWriteSurfaces),
      state_{.organs = std::vector<Last>(world.all<OrganBody>().size()), .entries = {}},
      shares_(world.all<OrganBody>().size()) {}

Result<void> VtkSeries::open(const std::filesystem::path& folder) {
  folder_ = folder / "vtk";
  return check_out_folder(folder_);
}

Result<void> VtkSeries::add_picture(FrameViews& views) {
  const World& world = views.world();
  for (std::size_t o = 0; o < state_.organs.size(); ++o) {
    const Entity organ = world.all<OrganBody>().owner(o);
    const OrganBody& body = world.all<OrganBody>()[o];
    const OrganState& state = *world.find<OrganState>(organ);
    const bool loaded = has_forces(world.find<OrganContact>(organ), state);
    Last& last = state_.organs[o];
    if (last.file.empty() || last.version != state.version || last.loaded != loaded ||
        !same(last.pose, pose_of(world, organ))) {
      if (auto written = write(world, o, loaded, views.number()); !written) return written;
      last.version = state.version;
      last.pose = pose_of(world, organ);
      last.loaded = loaded;
    }
    state_.entries.push_back({world.time(), static_cast<int>(o), body.name, last.file});
  }
  return {};
}

Result<void> VtkSeries::write(const World& world, std::size_t o, bool loaded,
                              std::uint64_t picture) {
  const Entity organ = world.all<OrganBody>().owner(o);
  const OrganBody& body = world.all<OrganBody>()[o];
  const OrganModel& model = *body.model;
  const OrganState& state = *world.find<OrganState>(organ);
  const std::size_t count = model.surface.vertices.size();

  Last& last = state_.organs[o];
  forces_.assign(count, Vec3f::Zero());
  if (loaded) {
    // A cut makes it another body.
    if (!shares_[o] || shares_[o]->body != body.model)
      shares_[o].emplace(Shares{body.model, ForceShares(model)});
    shares_[o]->shares.add(world.find<OrganContact>(organ)->response, forces_);
  }
  points_.resize(count);
  displacements_.resize(count);
  const Pose& pose = pose_of(world, organ);
  for (std::size_t v = 0; v < count; ++v) {
    points_[v] = pose.to_world(model.surface.vertices[v]).cast<float>();
    const Vec3f moved =
        state.deformed ? Vec3f(state.positions[v] - model.rest_positions[v]) : Vec3f(Vec3f::Zero());
    displacements_[v] = pose.direction_to_world(moved.cast<double>()).cast<float>();
    forces_[v] = pose.direction_to_world(forces_[v].cast<double>()).cast<float>();
  }
  if (last.file.empty())
    if (auto made = check_out_folder(folder_ / body.name); !made) return made;
  last.file = fmt::format("{}/{:04}.vtu", body.name, picture);
  return write_vtu(
      folder_ / last.file,
      {points_, model.surface.triangles, {{"displacement", displacements_}, {"force", forces_}}});
}

Result<void> VtkSeries::close(const World&) {
  return write_pvd(folder_ / "organs.pvd", state_.entries);
}

Result<void> VtkSeries::save_state(ByteWriter& writer) {
  return save_whole(writer, state_);
}

Result<void> VtkSeries::load_state(ByteReader& reader) {
  const std::size_t organs = state_.organs.size();
  if (auto whole = load_whole(reader, state_); !whole) return whole;
  if (state_.organs.size() != organs) return failure("expected the scene's organs");
  return {};
}

}  // namespace viscera
