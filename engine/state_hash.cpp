#include "engine/state_hash.h"

namespace viscera {
namespace {

void add(Hasher& hasher, const Vec3& v) {
  hasher.bytes(v.data(), 3 * sizeof(double));
}

template <class T>
void add_all(Hasher& hasher, const std::vector<T>& values) {
  hasher.value<std::uint64_t>(values.size());
  hasher.bytes(values.data(), values.size() * sizeof(T));
}

}  // namespace

void StateHash::add_frame(const World& world) {
  hasher_.value(world.tick);
  for (std::size_t i = 0; i < world.instrument_states.size(); ++i) {
    add(hasher_, world.instrument_states[i].tip);
    add(hasher_, world.instrument_contacts[i].force);
  }
  for (const SmokeBody& smoke : world.smoke)
    hasher_.value<std::uint64_t>(smoke.volume.particles().size());
}

std::string StateHash::finish(const World& world) {
  for (const OrganState& organ : world.organ_states) {
    add_all(hasher_, organ.displacements);
    add_all(hasher_, organ.positions);
  }
  for (const OrganContact& contact : world.organ_contacts)
    for (const Cling& cling : contact.clings) {
      add(hasher_, cling.tip);
      hasher_.value(cling.pitch).value(cling.followed);
      hasher_.value<std::uint64_t>(cling.spots.size());
      for (const Cling::Spot& spot : cling.spots) {
        add(hasher_, spot.rest);
        add(hasher_, spot.displacement);
      }
    }
  for (const Link& link : world.links)
    for (const Link::Spring& spring : link.springs) add(hasher_, spring.force);
  for (const OrganBurn& burn : world.organ_burns)
    for (std::size_t b = 0; b < burn.heat.bricks().count(); ++b) {
      const HeatBrick& brick = burn.heat.bricks().brick(b);
      hasher_.bytes(brick.index.data(), sizeof(int) * 3);
      for (const HeatBrick::Values* values : {&brick.damage, &brick.water, &brick.charred})
        hasher_.bytes(values->data(), sizeof(HeatBrick::Values));
      if (brick.warm) hasher_.bytes(brick.warm->excess.data(), sizeof(HeatBrick::Values));
    }
  for (const BurnTrace& trace : world.burn_traces) hasher_.value(trace.tip.excess());
  for (const SmokeBody& smoke : world.smoke) {
    const SmokeParticles& p = smoke.volume.particles();
    add_all(hasher_, p.positions);
    add_all(hasher_, p.velocities);
    add_all(hasher_, p.masses);
    add_all(hasher_, p.ids);
  }
  return hasher_.hex();
}

}  // namespace viscera
