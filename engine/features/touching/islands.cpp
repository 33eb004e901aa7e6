#include "engine/features/touching/islands.h"

#include <algorithm>
#include <functional>
#include <map>

#include "engine/features/beds/beds.h"
#include "engine/features/contact/contact.h"
#include "engine/features/deformation/deformation.h"
#include "engine/features/links/links.h"
#include "engine/features/touching/resting.h"
#include "engine/features/touching/touching.h"
#include "kernels/base/disjoint_sets.h"
#include "kernels/base/parallel.h"
#include "kernels/finite/finite_solver.h"

namespace viscera {
namespace {

/// Whether no step was found for a body with what touches it.
bool is_lost(const World& world, Entity organ) {
  const OrganTouch* touch = world.find<OrganTouch>(organ);
  const FiniteStep* step = touch ? touch->solver->last_step() : nullptr;
  return step && (step->lost || !step->answered);
}

class IslandSolve {
 public:
  IslandSolve(World& world, const Island& island, ContactIsland& solver)
      : world_(world), island_(island), solver_(solver) {}

  IslandFigures run() {
    std::vector<std::unique_ptr<SharedSolve>> solves(island_.organs.size());
    parallel_for_each_index(solves.size(), 1, [&](std::size_t i) {
      const Entity organ = island_.organs[i];
      OrganContact& contact = *world_.find<OrganContact>(organ);
      solves[i] = world_.find<OrganTouch>(organ)->solver->share(
          contact.cells, own_cells(world_, organ), contact.solution, contact.response);
    });
    std::vector<IslandBody> bodies;
    body_of_.clear();
    for (std::size_t i = 0; i < solves.size(); ++i) {
      const Entity organ = island_.organs[i];
      body_of_.push_back(solves[i] ? static_cast<int>(bodies.size()) : -1);
      if (solves[i])
        bodies.push_back({solves[i].get(), pose_of(world_, organ).orientation.toRotationMatrix(),
                          own_cells(world_, organ)});
    }
    std::vector<Joint> joints;
    std::vector<Vec3> forces;
    add_meetings(joints, forces);
    const std::size_t met = joints.size();
    add_springs(world_, island_.organs, body_of_, joints, forces);
    const std::size_t sprung = joints.size();
    std::vector<JointsThatYield> yielding;
    add_beds(world_, island_.organs, body_of_, joints, forces, yielding);
    const IslandFigures figures = solver_.solve(bodies, joints, forces, yielding);
    note_lost(bodies.size());
    for (std::size_t j = 0; j < joints.size(); ++j)
      if (on_lost(joints[j])) forces[j].setZero();
    take_meetings(joints, forces);
    const std::span<const Vec3> found(forces);
    take_springs(world_, island_.organs, body_of_, found.subspan(met, sprung - met));
    const bool known = figures.converged && std::ranges::none_of(lost_, std::identity());
    take_beds(world_, island_.organs, body_of_, found.subspan(sprung), known);
    return figures;
  }

 private:
  int body(Entity organ) const {
    const auto at = std::ranges::find(island_.organs, organ);
    return at == island_.organs.end()
               ? -1
               : body_of_[static_cast<std::size_t>(at - island_.organs.begin())];
  }

  void note_lost(std::size_t bodies) {
    lost_.assign(bodies, 0);
    for (std::size_t o = 0; o < body_of_.size(); ++o)
      if (body_of_[o] >= 0 && is_lost(world_, island_.organs[o]))
        lost_[static_cast<std::size_t>(body_of_[o])] = 1;
  }
  /// What was found for it isn't sound.
  bool on_lost(const Joint& joint) const {
    return std::ranges::any_of(joint.ends, [&](const Joint::End& end) {
      return end.body >= 0 && lost_[static_cast<std::size_t>(end.body)] != 0;
    });
  }

  void add_meetings(std::vector<Joint>& joints, std::vector<Vec3>& forces) const {
    const double friction = touching_of(world_.model().scene()).friction;
    for (const Entity entity : island_.pairs) {
      const OrganPair& pair = *world_.find<OrganPair>(entity);
      const PairState& state = *world_.find<PairState>(entity);
      const PairJoints& laid = *world_.find<PairJoints>(entity);
      for (std::size_t m = 0; m < state.meetings.size(); ++m) {
        Joint joint;
        for (std::size_t side = 0; side < 2; ++side)
          joint.ends[side] = {body(pair.organs[side]),
                              static_cast<int>(laid.first_cells[side] + m)};
        joint.direction = laid.normals[m];
        joint.depth = laid.depths[m];
        joint.displacement = state.meetings[m].cling;
        joint.friction = friction;
        joints.push_back(joint);
        forces.push_back(state.meetings[m].force);
      }
    }
  }

  /// By deformation, world [m].
  Vec3 displacement(Entity organ, const Joint::End& end) const {
    if (end.body < 0) return Vec3::Zero();
    return cell_displacement(world_, organ, static_cast<std::size_t>(end.cell));
  }

  void take_meetings(std::span<const Joint> joints, std::span<const Vec3> forces) {
    TouchingFigures& figures = *world_.one<TouchingFigures>();
    std::size_t j = 0;
    std::map<std::array<std::uint32_t, 2>, Vec3> sums;  // on the pair's lower organ
    for (const Entity entity : island_.pairs) {
      const OrganPair& pair = *world_.find<OrganPair>(entity);
      Vec3 sum = Vec3::Zero();
      for (Meeting& meeting : world_.find<PairState>(entity)->meetings) {
        const Joint& joint = joints[j];
        meeting.force = forces[j];
        sum += forces[j];
        ++j;
        if (joint.friction == 0.0 || on_lost(joint)) continue;  // a lost one clings to where it did
        const double push = meeting.force.dot(joint.direction);
        const double drag = (meeting.force - push * joint.direction).norm();
        if (push > 0.0 && drag < (1.0 - 1e-9) * joint.friction * push) continue;
        meeting.cling = displacement(pair.organs[0], joint.ends[0]) -
                        displacement(pair.organs[1], joint.ends[1]);
      }
      const double sign = pair.organs[0].index == pair.between()[0] ? 1.0 : -1.0;
      sums.try_emplace(pair.between(), Vec3::Zero()).first->second += sign * sum;
    }
    for (const auto& [pair, sum] : sums)
      figures.greatest_force = std::max(figures.greatest_force, sum.norm());
  }

  World& world_;
  const Island& island_;
  ContactIsland& solver_;
  std::vector<int> body_of_;  // the islands' organs, as bodies of the solve; -1: it isn't sound
  std::vector<char> lost_;    // of bodies: no step was found with these forces
};

}  // namespace

std::vector<Island> islands_of(const World& world) {
  const std::vector<Entity>& organs = world.model().organs();
  const auto index_of = [&](Entity organ) {
    return static_cast<int>(std::ranges::find(organs, organ) - organs.begin());
  };
  DisjointSets sets(organs.size());
  const Pool<OrganPair>& pairs = world.all<OrganPair>();
  std::vector<std::pair<Entity, int>> meeting;  // and an organ of it that yields
  const std::size_t asked = all_at_rest(world) ? 0 : pairs.size();
  for (std::size_t p = 0; p < asked; ++p) {
    if (world.find<PairState>(pairs.owner(p))->meetings.empty() ||
        pair_rests(world, pairs.owner(p)))
      continue;
    const bool first = yields(world, pairs[p].organs[0]),
               second = yields(world, pairs[p].organs[1]);
    if (!first && !second) continue;
    if (first && second) sets.join(index_of(pairs[p].organs[0]), index_of(pairs[p].organs[1]));
    meeting.emplace_back(pairs.owner(p), index_of(pairs[p].organs[first ? 0 : 1]));
  }
  std::vector<char> bedded(organs.size(), 0);
  for (const Entity organ : organs)
    for (const Entity other : bedded_with(world, organ)) {
      if (!yields(world, organ)) continue;
      bedded[static_cast<std::size_t>(index_of(organ))] = 1;
      if (yields(world, other)) sets.join(index_of(organ), index_of(other));
    }
  for (const Entity organ : organs)
    if (is_link_loaded(world, organ))
      for (const Entity other : linked_to(world, organ))
        if (is_link_loaded(world, other)) sets.join(index_of(organ), index_of(other));
  std::vector<Island> islands;
  std::vector<int> island_of(organs.size(), -1);
  const auto island_with = [&](int organ) -> Island& {
    int& island = island_of[static_cast<std::size_t>(sets.root(organ))];
    if (island < 0) {
      island = static_cast<int>(islands.size());
      islands.emplace_back();
    }
    return islands[static_cast<std::size_t>(island)];
  };
  for (const auto& [pair, organ] : meeting) island_with(organ).pairs.push_back(pair);
  for (std::size_t o = 0; o < organs.size(); ++o)
    if (bedded[o]) island_with(static_cast<int>(o));
  for (std::size_t o = 0; o < organs.size(); ++o)
    if (const int island = island_of[static_cast<std::size_t>(sets.root(static_cast<int>(o)))];
        island >= 0 && yields(world, organs[o]))
      islands[static_cast<std::size_t>(island)].organs.push_back(organs[o]);
  return islands;
}

void solve_islands(World& world, const ContactSolves& solves) {
  Pool<InIsland>& members = world.all<InIsland>();
  for (std::size_t o = 0; o < members.size(); ++o)
    members[o].solved = rests(world, members.owner(o));
  const std::vector<Island> islands = islands_of(world);
  TouchingFigures& figures = *world.one<TouchingFigures>();
  figures.most_islands = std::max<std::uint64_t>(figures.most_islands, islands.size());
  std::uint64_t rows = 0;
  for (const Island& island : islands) {
    ContactIsland& solver = world.one<IslandWork>()->solver;
    IslandSolve solve(world, island, solver);
    IslandFigures told = solve.run();
    const auto slides = [&] {
      bool slid = false;
      for (const Entity organ : island.organs) slid = solves.settle_held(organ) || slid;
      return slid;
    };
    for (int pass = 0; pass < kSlipPasses && slides(); ++pass) told = solve.run();
    for (const Entity organ : island.organs) {
      world.find<InIsland>(organ)->solved = true;
      solves.accept(organ);
    }
    ++figures.solves;
    figures.failed += told.converged ? 0 : 1;
    figures.residual = std::max(figures.residual, told.residual);
    rows += static_cast<std::uint64_t>(told.rows);
  }
  figures.most_rows = std::max(figures.most_rows, rows);
}

bool is_in_island(const World& world, Entity organ) {
  const InIsland* member = world.find<InIsland>(organ);
  return member && member->solved;
}

}  // namespace viscera
