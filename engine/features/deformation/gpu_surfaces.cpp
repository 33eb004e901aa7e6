#include "engine/features/deformation/gpu_surfaces.h"

#include <algorithm>

#include "engine/gpu/egl_context.h"
#include "engine/simulation/world.h"

namespace viscera {

Result<std::shared_ptr<GpuSurfaces>> GpuSurfaces::create(std::shared_ptr<EglContext> context,
                                                         const World& world) {
  std::vector<GpuOrgan> organs;
  std::vector<Entity> entities;
  for (std::size_t o = 0; o < world.all<OrganContact>().size(); ++o) {
    const Entity organ = world.all<OrganContact>().owner(o);
    const OrganBody& body = *world.find<OrganBody>(organ);
    const OrganModel& model = *body.model;
    // Hives draw it, or the CPU knows its nodes.
    if (!model.touchable_anywhere() || model.finite) continue;
    entities.push_back(organ);
    organs.push_back({.name = body.name,
                      .compliance = &model.compliance,
                      .drawn = &model.drawn,
                      .half = model.in_half_precision() ? &model.half_columns : nullptr});
  }
  if (organs.empty()) return nullptr;
  context->make_current();
  auto deformation = GpuDeformation::create(organs);
  if (!deformation) return std::unexpected(deformation.error());
  std::shared_ptr<GpuSurfaces> made(new GpuSurfaces(std::move(context), *std::move(deformation)));
  if (made->read_back_.data() == nullptr)
    return failure("organs on the GPU: no memory that the CPU reads, for their positions");
  for (std::size_t i = 0; i < organs.size(); ++i) {
    made->vertices_.push_back(organs[i].drawn->rest->vertices.size());
    const std::string& refusal = made->deformation_.refusal(i);
    if (refusal.empty())
      made->index_[entities[i].index] = i;
    else
      made->refusals_.push_back(refusal);
  }
  return made;
}

GpuSurfaces::GpuSurfaces(std::shared_ptr<EglContext> context, GpuDeformation deformation)
    : context_(std::move(context)),
      deformation_(std::move(deformation)),
      read_back_(deformation_.positions().size()) {}

GpuSurfaces::~GpuSurfaces() {
  context_->make_current();
}

std::optional<std::size_t> GpuSurfaces::index_of(Entity organ) const {
  const auto found = index_.find(organ.index);
  if (found == index_.end()) return std::nullopt;
  return found->second;
}

void GpuSurfaces::add(Entity organ, const DrawnSurface& drawn, const OrganContact& contact) {
  Added added{.organ = organ,
              .index = *index_of(organ),
              .response = &contact.response,
              .near_vertices = {},
              .near_field = {}};
  near_field_on_surface(drawn, contact.solution.near_fields, contact.cells, contact.solution.forces,
                        added.near_vertices, added.near_field);
  added_.push_back(std::move(added));
}

void GpuSurfaces::start() {
  if (added_.empty()) return;
  context_->make_current();
  std::vector<GpuLoads> loads;
  for (const Added& one : added_)
    loads.push_back({.organ = one.index,
                     .touched = one.response->touched,
                     .loads = one.response->loads,
                     .near_vertices = one.near_vertices,
                     .near_field = one.near_field});
  timer_.start();
  const Result<void> deformed = deformation_.deform(loads, &timer_);
  started_ = deformed.has_value();
  if (!started_) return fail(deformed.error().text());
  for (const Added& one : added_) {
    const std::size_t first = deformation_.first_vertex(one.index) * sizeof(Vec3f);
    read_back_.start(deformation_.positions(), first, vertices_[one.index] * sizeof(Vec3f), first);
  }
  timer_.mark("read back");
  read_back_.submit();
}

void GpuSurfaces::finish(const std::function<void(Entity, std::span<const Vec3f>)>& take) {
  if (added_.empty()) return;
  context_->make_current();
  if (started_ && !read_back_.wait()) fail("the device didn't answer");
  if (context_->lost()) fail("its context was lost");
  const bool whole = started_ && trouble_.empty();
  if (whole) note_times();
  const auto* all = static_cast<const Vec3f*>(read_back_.data());
  for (const Added& one : added_) {
    std::span<const Vec3f> positions;
    if (whole) positions = {all + deformation_.first_vertex(one.index), vertices_[one.index]};
    take(one.organ, positions);
  }
  added_.clear();
  started_ = false;
}

void GpuSurfaces::fail(const std::string& why) {
  if (trouble_.empty()) trouble_ = "organs on the GPU: " + why;
}

void GpuSurfaces::note_times() {
  for (const PassTime& pass : timer_.finish()) {
    auto known = std::find_if(passes_.begin(), passes_.end(),
                              [&](const Pass& one) { return one.name == pass.name; });
    if (known == passes_.end()) known = passes_.insert(passes_.end(), {pass.name, {}});
    known->seconds.push_back(pass.seconds);
  }
}

DeviceSurface GpuSurfaces::surface(Entity organ) const {
  const std::optional<std::size_t> index = index_of(organ);
  if (!index) return {};
  return {&deformation_.positions(), &deformation_.normals(), deformation_.first_vertex(*index)};
}

}  // namespace viscera
