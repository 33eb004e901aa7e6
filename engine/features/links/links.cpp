#include "engine/features/links/links.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/features/breathing/breathing.h"
#include "engine/features/contact/contact.h"
#include "engine/features/contact/make_contact.h"
#include "engine/features/deformation/deformation.h"
#include "engine/features/links/link_places.h"

namespace viscera {
namespace {

/// Turns of all organs of a group that tools press, at most. Tools at two organs some centimetres
/// apart settle to a thousandth in two.
constexpr int kRounds = 5;
/// Springs' forces that change less than this, over the greatest, are settled; where a turn is a
/// step at finite strain, whose own forces err by as much, the second holds.
constexpr double kSettled = 1e-5, kSettledInSteps = 1e-3;

/// Springs end on the drawn surface, up to round-off [m].
constexpr double kOnSurface = 1e-3;

Eigen::Index at(std::size_t tie) {
  return static_cast<Eigen::Index>(3 * tie);
}

double sign_of(const OrganTies::Tie& tie) {
  return tie.side == 0 ? 1.0 : -1.0;
}

LinkState::Spring& spring_of(World& world, const OrganTies::Tie& tie) {
  return world.find<LinkState>(tie.link)->springs[tie.spring];
}

/// Gravity or shrinkage has moved the organ, though nothing touches it.
bool sags(const World& world, Entity organ) {
  const FreeShape* shape = world.find<FreeShape>(organ);
  return shape && shape->moves;
}

/// How far breathing has taken an organ's frame from its pose [m].
Vec3 frame_shift(const World& world, Entity organ) {
  const OrganMotion* motion = world.find<OrganMotion>(organ);
  if (!motion) return Vec3::Zero();
  return pose_of(world, organ).position - motion->pose.position;
}

// --- set-up -------------------------------------------------------------------------------------

/// The cell of a spring's end on an organ. Springs share the surface inside the region between
/// them; a cell wider than its load's spreading would not be positive (tissue_contact.cpp, lift).
ContactCell link_cell(const OrganModel& model, const Pose& pose, const Vec3& position,
                      const Vec3& normal, double area) {
  ContactCell cell;
  cell.held = true;
  cell.position = pose.to_local(position);
  cell.normal = pose.direction_to_local(normal);
  cell.area = area;
  if (!model.touchable_anywhere()) return cell;
  const double sigma = PatchContact::spread_factor() * spacing_at(model.touchable, cell.position);
  cell.area = std::min(area, std::numbers::pi * sigma * sigma);
  return cell;
}

void add_link(const LinkDescription& description, const LinkPlaces& places,
              const std::array<std::size_t, 2>& organs, SceneModel& model) {
  Store& constants = model.constants();
  const double count = static_cast<double>(places.springs.size());
  Link link;
  link.name = description.name;
  link.softness = count / description.stiffness;
  link.springs = places.springs.size();
  const Entity entity = model.add_entity();
  std::array<const OrganBody*, 2> bodies{};
  for (std::size_t end = 0; end < 2; ++end) {
    if (organs[end] >= model.organs().size()) continue;
    link.ends[end] = model.organs()[organs[end]];
    bodies[end] = constants.all<OrganBody>().find(link.ends[end]);
    const auto contact = make_contact(model, link.ends[end]);
    if (contact && contact->abilities().springs && !constants.all<OrganTies>().find(link.ends[end]))
      constants.all<OrganTies>().add(link.ends[end], {});
  }
  std::array<OrganTies*, 2> ties{};
  std::array<std::size_t, 2> first{};
  for (std::size_t end = 0; end < 2; ++end) {
    ties[end] = constants.all<OrganTies>().find(link.ends[end]);
    if (ties[end]) first[end] = ties[end]->ties.size();
  }
  for (std::size_t end = 0; end < 2; ++end) {
    if (!ties[end]) continue;
    const OrganModel& organ = *bodies[end]->model;
    const CollisionSurface surface(organ.surface, organ.rest_positions);
    for (std::size_t s = 0; s < places.springs.size(); ++s) {
      OrganTies::Tie tie{entity, s, static_cast<int>(end), {}, 0};
      if (ties[1 - end]) {
        tie.other = link.ends[1 - end];
        tie.other_tie = first[1 - end] + s;
      }
      ties[end]->ties.push_back(tie);
      ties[end]->cells.push_back(
          link_cell(organ, model.scene().organs[organs[end]].pose, places.springs[s].positions[end],
                    places.springs[s].normals[end], places.areas[end] / count));
      ties[end]->points.push_back(
          surface.closest(ties[end]->cells.back().position, kOnSurface)->point);
    }
  }
  constants.all<Link>().add(entity, std::move(link));
}

/// Puts the ties' cells at the end of what a solver sees, and lets it see them once.
void anchor_ties(TissueContact& solver, const OrganTies& ties) {
  ContactSolution solution;
  ContactResponse response;
  const std::vector<Vec3> none(ties.cells.size(), Vec3::Zero());
  solver.anchor(ties.cells);
  solver.load(ties.cells, none, solution, response);
}

Mat3 turn_of(const SceneModel& model, Entity organ) {
  return model.scene().organs[organ.index].pose_at(0.0).orientation.toRotationMatrix();
}

/// Displacement of the last `ties` cells per force on each; world.
MatrixX tie_response(TissueContact& tissue, std::size_t ties, const Mat3& turn) {
  const Eigen::Index size = at(ties);
  MatrixX response = tissue.cell_response().bottomRightCorner(size, size);
  for (Eigen::Index i = 0; i < response.rows(); i += 3)
    for (Eigen::Index j = 0; j < response.cols(); j += 3)
      response.block<3, 3>(i, j) = (turn * response.block<3, 3>(i, j) * turn.transpose()).eval();
  // What stands behind a spring must not make a symmetric problem unsymmetric.
  return 0.5 * (response + response.transpose());
}

void put_compliances_behind(SceneModel& model) {
  Pool<OrganTies>& all = model.constants().all<OrganTies>();
  std::vector<MatrixX> responses;
  for (std::size_t o = 0; o < all.size(); ++o) {
    const auto tissue = make_contact(model, all.owner(o));
    anchor_ties(*tissue, all[o]);
    responses.push_back(tie_response(*tissue, all[o].ties.size(), turn_of(model, all.owner(o))));
  }
  for (std::size_t o = 0; o < all.size(); ++o) {
    OrganTies& ties = all[o];
    const auto size = at(ties.ties.size());
    ties.behind.setZero(size, size);
    for (std::size_t p = 0; p < all.size(); ++p)
      for (std::size_t i = 0; i < ties.ties.size(); ++i)
        for (std::size_t j = 0; j < ties.ties.size(); ++j)
          if (ties.ties[i].other == all.owner(p) && ties.ties[j].other == all.owner(p))
            ties.behind.block<3, 3>(at(i), at(j)) =
                responses[p].block<3, 3>(at(ties.ties[i].other_tie), at(ties.ties[j].other_tie));
    const Mat3 turn = turn_of(model, all.owner(o));
    ties.backing = ties.behind;
    for (std::size_t i = 0; i < ties.ties.size(); ++i) {
      for (std::size_t j = 0; j < ties.ties.size(); ++j)
        ties.backing.block<3, 3>(at(i), at(j)) =
            (turn.transpose() * ties.behind.block<3, 3>(at(i), at(j)) * turn).eval();
      ties.backing.block<3, 3>(at(i), at(i)).diagonal().array() +=
          model.constants().all<Link>().find(ties.ties[i].link)->softness;
    }
    ties.backing = (0.5 * (ties.backing + ties.backing.transpose())).eval();
  }
}

/// Organs that links connect, over any number of others.
std::vector<std::vector<Entity>> groups_of(const Pool<OrganTies>& all) {
  std::vector<std::vector<Entity>> groups;
  std::vector<Entity> seen;
  const auto is_in = [](const std::vector<Entity>& some, Entity one) {
    return std::find(some.begin(), some.end(), one) != some.end();
  };
  for (std::size_t o = 0; o < all.size(); ++o) {
    if (is_in(seen, all.owner(o))) continue;
    std::vector<Entity> group = {all.owner(o)};
    for (std::size_t i = 0; i < group.size(); ++i)
      for (const OrganTies::Tie& tie : all.find(group[i])->ties)
        if (all.find(tie.other) && !is_in(group, tie.other)) group.push_back(tie.other);
    seen.insert(seen.end(), group.begin(), group.end());
    groups.push_back(std::move(group));
  }
  return groups;
}

// --- a frame ------------------------------------------------------------------------------------

bool is_frozen(const World& world, Entity organ) {
  return world.find<OrganState>(organ)->frozen;
}

std::size_t first_link_cell(const OrganContact& contact, const OrganTies& ties) {
  return contact.cells.size() - ties.ties.size();
}

/// One group in one frame.
class GroupSolve {
 public:
  GroupSolve(World& world, const std::vector<Entity>& group) : world_(world), group_(group) {
    // A step at finite strain costs some ten times a linear answer: these come first.
    std::ranges::stable_partition(group_, [&](Entity organ) { return !moves(organ); });
    for (std::size_t i = 0; i < group.size(); ++i) follows_.push_back(only_follows(i));
    steps_ = std::ranges::any_of(group, [&](Entity organ) { return moves(organ); });
  }

  void run(const ContactSolves& solves) {
    meet_hives();
    if (steps_) go_on_as_before();
    const auto turns = std::count_if(group_.begin(), group_.end(), [&](Entity organ) {
      return !is_frozen(world_, organ) && !follows(organ);
    });
    answered_.assign(group_.size(), false);
    // Turns since springs' forces last changed: all but the one that changed them are settled then.
    std::ptrdiff_t still = 0;
    bool settled = false;
    for (int round = 0; round < (turns > 1 ? kRounds : 1) && !settled; ++round) {
      double greatest = 0.0, change = 0.0;
      for (std::size_t i = 0; i < group_.size() && !settled; ++i) {
        if (is_frozen(world_, group_[i]) || follows_[i]) continue;
        const Behind behind = behind_of(group_[i]);
        aim(group_[i], behind.compliance);
        solves.alone(group_[i], behind.backing);
        answered_[i] = world_.find<OrganContact>(group_[i])->solution.converged;
        if (!answered_[i]) continue;
        double own_greatest = 0.0, own_change = 0.0;
        take_forces(group_[i], own_greatest, own_change);
        greatest = std::max(greatest, own_greatest);
        change = std::max(change, own_change);
        still = own_change <= kSettledInSteps * own_greatest ? still + 1 : 0;
        for (std::size_t j = 0; j < group_.size(); ++j)
          if (j != i && answered_[j] && !moves(group_[j])) load(group_[j]);
        settled = steps_ && round > 0 && still + 1 >= turns;
      }
      settled = settled || change <= (steps_ ? kSettledInSteps : kSettled) * greatest;
    }
    for (std::size_t i = 0; i < group_.size(); ++i)
      if (follows_[i]) load(group_[i]);
  }

 private:
  /// No tool presses it, and all its links go to one organ that is solved: that solve holds its
  /// answer.
  bool only_follows(std::size_t i) const {
    if (is_frozen(world_, group_[i])) return false;
    if (own_cells(world_, group_[i]) > 0 || moves(group_[i])) return false;
    const std::vector<OrganTies::Tie>& ties = world_.find<OrganTies>(group_[i])->ties;
    const Entity leader = ties.front().other;
    if (!world_.find<OrganTies>(leader) || is_frozen(world_, leader) || follows(leader))
      return false;
    return std::all_of(ties.begin(), ties.end(),
                       [&](const OrganTies::Tie& tie) { return tie.other == leader; });
  }

  /// Springs begin where they were going: of organs that move smoothly, the first turn then finds
  /// what a second would.
  void go_on_as_before() {
    for (const Entity organ : group_)
      for (const OrganTies::Tie& tie : world_.find<OrganTies>(organ)->ties) {
        if (tie.side == 1 && world_.find<OrganTies>(tie.other)) continue;  // the other's, too
        LinkState::Spring& spring = spring_of(world_, tie);
        const LinkState::Spring now = spring;
        spring.force += now.force - now.force_before;
        for (std::size_t end = 0; end < 2; ++end)
          spring.displacements[end] += now.displacements[end] - now.displacements_before[end];
        spring.force_before = now.force;
        spring.displacements_before = now.displacements;
      }
  }

  /// It has a motion of its own: forces alone don't say where it is.
  bool moves(Entity organ) const {
    return world_.find<OrganTouch>(organ)->solver->abilities().moves;
  }

  bool follows(Entity organ) const {
    for (std::size_t i = 0; i < follows_.size(); ++i)
      if (group_[i] == organ) return follows_[i];
    return false;
  }

  /// What stands behind an organ's springs.
  struct Behind {
    const MatrixX &compliance, &backing;  ///< as OrganTies::behind and backing
  };

  /// A local organ's answer depends on where its hives stand, and so on the tools of this frame.
  bool is_local(Entity organ) const {
    const OrganBody* body = world_.find<OrganBody>(organ);
    return body && !body->model->touchable_anywhere();
  }

  /// Local organs see this frame's cells before anybody asks what they yield.
  void meet_hives() {
    for (const Entity organ : group_)
      if (is_local(organ) && !is_frozen(world_, organ)) load(organ);
  }

  /// As prepared, or, where the other end is local, as it is now: turns of organs that hold each
  /// other for stiffer or softer than they are needn't come to an end.
  Behind behind_of(Entity organ) {
    const OrganTies& ties = *world_.find<OrganTies>(organ);
    if (std::ranges::none_of(group_, [&](Entity other) { return is_local(other); }))
      return {ties.behind, ties.backing};
    compliance_ = ties.behind;
    backing_ = ties.backing;
    const Mat3 turn = pose_of(world_, organ).orientation.toRotationMatrix();
    for (const Entity other : group_) {
      if (other == organ || !is_local(other) || is_frozen(world_, other)) continue;
      const MatrixX response = tie_response(*world_.find<OrganTouch>(other)->solver,
                                            world_.find<OrganTies>(other)->ties.size(),
                                            pose_of(world_, other).orientation.toRotationMatrix());
      for (std::size_t i = 0; i < ties.ties.size(); ++i)
        for (std::size_t j = 0; j < ties.ties.size(); ++j) {
          if (ties.ties[i].other != other || ties.ties[j].other != other) continue;
          const Mat3 block =
              response.block<3, 3>(at(ties.ties[i].other_tie), at(ties.ties[j].other_tie));
          const Mat3 more = block - compliance_.block<3, 3>(at(i), at(j));
          compliance_.block<3, 3>(at(i), at(j)) = block;
          backing_.block<3, 3>(at(i), at(j)) += turn.transpose() * more * turn;
        }
    }
    return {compliance_, backing_};
  }

  /// Where each link cell would be held if the other ends felt nothing of its forces.
  void aim(Entity organ, const MatrixX& behind) {
    const OrganTies& ties = *world_.find<OrganTies>(organ);
    const Pose& pose = pose_of(world_, organ);
    OrganContact& contact = *world_.find<OrganContact>(organ);
    const std::size_t begin = first_link_cell(contact, ties);
    VectorX forces(at(ties.ties.size()));
    for (std::size_t i = 0; i < ties.ties.size(); ++i)
      forces.segment<3>(at(i)) = sign_of(ties.ties[i]) * spring_of(world_, ties.ties[i]).force;
    const VectorX given_way = behind * forces;
    for (std::size_t i = 0; i < ties.ties.size(); ++i) {
      const OrganTies::Tie& tie = ties.ties[i];
      Vec3 wanted = sign_of(tie) * world_.find<LinkState>(tie.link)->shift;
      if (follows(tie.other))
        wanted += free_end(tie);
      else if (world_.find<OrganTies>(tie.other))
        wanted += spring_of(world_, tie).displacements[static_cast<std::size_t>(1 - tie.side)] +
                  given_way.segment<3>(at(i));
      contact.cells[begin + i].displacement = pose.direction_to_local(wanted);
    }
  }

  /// Where the other end of a tie would be without forces; world.
  Vec3 free_end(const OrganTies::Tie& tie) const {
    const OrganContact& contact = *world_.find<OrganContact>(tie.other);
    const std::size_t begin = first_link_cell(contact, *world_.find<OrganTies>(tie.other));
    return pose_of(world_, tie.other).direction_to_world(contact.cells[begin + tie.other_tie].free);
  }

  void take_forces(Entity organ, double& greatest, double& change) {
    const OrganTies& ties = *world_.find<OrganTies>(organ);
    const Pose& pose = pose_of(world_, organ);
    const OrganContact& contact = *world_.find<OrganContact>(organ);
    const std::size_t begin = first_link_cell(contact, ties);
    for (std::size_t i = 0; i < ties.ties.size(); ++i) {
      Vec3& force = spring_of(world_, ties.ties[i]).force;
      const Vec3 now =
          sign_of(ties.ties[i]) * pose.direction_to_world(contact.solution.forces[begin + i]);
      greatest = std::max(greatest, now.norm());
      change = std::max(change, (now - force).norm());
      force = now;
    }
    note_displacements(organ);
  }

  void note_displacements(Entity organ) {
    const OrganTies& ties = *world_.find<OrganTies>(organ);
    const std::size_t begin = first_link_cell(*world_.find<OrganContact>(organ), ties);
    for (std::size_t i = 0; i < ties.ties.size(); ++i)
      spring_of(world_, ties.ties[i]).displacements[static_cast<std::size_t>(ties.ties[i].side)] =
          cell_displacement(world_, organ, begin + i);
  }

  /// The links' forces as they are now, beside the tools' of its last solve.
  void load(Entity organ) {
    const OrganTies& ties = *world_.find<OrganTies>(organ);
    const Pose& pose = pose_of(world_, organ);
    OrganContact& contact = *world_.find<OrganContact>(organ);
    const std::size_t begin = first_link_cell(contact, ties);
    std::vector<Vec3> forces = contact.solution.forces;
    forces.resize(contact.cells.size(), Vec3::Zero());
    for (std::size_t i = 0; i < ties.ties.size(); ++i)
      forces[begin + i] =
          pose.direction_to_local(sign_of(ties.ties[i]) * spring_of(world_, ties.ties[i]).force);
    world_.find<OrganTouch>(organ)->solver->load(contact.cells, forces, contact.solution,
                                                 contact.response);
    note_displacements(organ);
  }

  World& world_;
  std::vector<Entity> group_;
  std::vector<char> follows_, answered_;  // per organ of the group
  bool steps_ = false;                    // some organ moves by itself
  MatrixX compliance_, backing_;          // of behind_of(), where some organ is local
};

void reach(const SceneDescription& scene, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  for (const LinkDescription& link : links_of(scene))
    if (link.stiffness > 0.0 && (link.between[0] == organ.name || link.between[1] == organ.name))
      reach.attach(link.region, organ);
}

/// The errors name the keys of the scene.
Result<void> prepare(SceneModel& model) {
  const SceneDescription& scene = model.scene();
  const std::span<const LinkDescription> links = links_of(scene);
  if (links.empty()) return {};
  std::vector<const TriangleSurface*> surfaces;
  for (const OrganBody& body : model.constants().all<OrganBody>())
    surfaces.push_back(&body.model->surface);
  Error error;
  for (std::size_t l = 0; l < links.size(); ++l) {
    const LinkDescription& description = links[l];
    auto places = place_springs(scene, l, surfaces);
    if (!places) {
      error.messages.insert(error.messages.end(), places.error().messages.begin(),
                            places.error().messages.end());
      continue;
    }
    if (description.stiffness == 0.0) continue;
    std::array<std::size_t, 2> organs{};
    for (std::size_t end = 0; end < 2; ++end)
      organs[end] =
          static_cast<std::size_t>(std::find_if(scene.organs.begin(), scene.organs.end(),
                                                [&](const OrganDescription& o) {
                                                  return o.name == description.between[end];
                                                }) -
                                   scene.organs.begin());
    add_link(description, *places, organs, model);
  }
  if (!error.messages.empty()) return std::unexpected(error);
  put_compliances_behind(model);
  model.constants().all<LinkGroups>().add(kWhole, {groups_of(model.constants().all<OrganTies>())});
  return {};
}

/// LinkState.shift, and the link cells of every organ whose group a tool touches or breathing
/// stretches: after those of the tools in OrganContact.cells. Other groups' links come to rest.
void add_link_cells(World& world, const FrameContext&) {
  const Pool<Link>& links = world.all<Link>();
  for (std::size_t l = 0; l < links.size(); ++l) {
    LinkState& state = *world.find<LinkState>(links.owner(l));
    state.shift = frame_shift(world, links[l].ends[1]) - frame_shift(world, links[l].ends[0]);
    state.force = 0.0;
  }
  for (const std::vector<Entity>& group : world.one<LinkGroups>()->groups) {
    bool loaded = false;
    for (const Entity organ : group) {
      loaded = loaded || !world.find<OrganContact>(organ)->cells.empty() ||
               is_frozen(world, organ) || sags(world, organ) ||
               world.find<OrganTouch>(organ)->solver->moving();
      for (const OrganTies::Tie& tie : world.find<OrganTies>(organ)->ties)
        loaded = loaded || !world.find<LinkState>(tie.link)->shift.isZero(0.0);
    }
    for (const Entity organ : group) {
      const OrganTies& ties = *world.find<OrganTies>(organ);
      LoadedTies& here = *world.find<LoadedTies>(organ);
      here.loaded = loaded && !is_frozen(world, organ);
      OrganContact& contact = *world.find<OrganContact>(organ);
      here.joined = false;
      if (!loaded)
        for (const OrganTies::Tie& tie : ties.ties) spring_of(world, tie) = {};
      if (!here.loaded) continue;
      contact.held_points.insert(contact.held_points.end(), ties.points.begin(), ties.points.end());
      contact.cells.insert(contact.cells.end(), ties.cells.begin(), ties.cells.end());
      contact.solution.forces.assign(contact.cells.size(), Vec3::Zero());
    }
  }
}

void solve_linked(World& world, const ContactSolves& solves) {
  for (const std::vector<Entity>& group : world.one<LinkGroups>()->groups) {
    const bool loaded = std::any_of(group.begin(), group.end(), [&](Entity organ) {
      const LoadedTies& ties = *world.find<LoadedTies>(organ);
      return ties.loaded && !ties.joined;
    });
    if (loaded) GroupSolve(world, group).run(solves);
  }
  for (LinkState& link : world.all<LinkState>()) {
    Vec3 sum = Vec3::Zero();
    for (const LinkState::Spring& spring : link.springs) sum += spring.force;
    link.force = sum.norm();
    link.greatest_force = std::max(link.greatest_force, link.force);
  }
}

Result<void> start(World& world) {
  const Pool<Link>& links = world.all<Link>();
  for (std::size_t l = 0; l < links.size(); ++l)
    world.all<LinkState>().add(
        links.owner(l),
        {.springs = std::vector<LinkState::Spring>(links[l].springs), .shift = Vec3::Zero()});
  const Pool<OrganTies>& ties = world.all<OrganTies>();
  for (std::size_t o = 0; o < ties.size(); ++o) {
    world.all<LoadedTies>().add(ties.owner(o), {});
    anchor_ties(*world.find<OrganTouch>(ties.owner(o))->solver, ties[o]);
  }
  if (ties.size() > 0) bind(world, {solve_linked, is_link_loaded});
  return {};
}

}  // namespace

bool is_link_loaded(const World& world, Entity organ) {
  const LoadedTies* ties = world.find<LoadedTies>(organ);
  return ties && ties->loaded;
}

std::vector<Entity> linked_to(const World& world, Entity organ) {
  std::vector<Entity> others;
  if (const OrganTies* ties = world.find<OrganTies>(organ))
    for (const OrganTies::Tie& tie : ties->ties)
      if (world.find<OrganTies>(tie.other)) others.push_back(tie.other);
  return others;
}

namespace {

/// Calls each(spring, link, organs that yield at its ends with their cells) for every spring of
/// these organs, once.
template <class Each>
void for_each_spring(World& world, std::span<const Entity> organs, std::span<const int> bodies,
                     const Each& each) {
  const auto body = [&](Entity organ) {
    const auto at = std::ranges::find(organs, organ);
    return at == organs.end() ? -1 : bodies[static_cast<std::size_t>(at - organs.begin())];
  };
  for (const Entity organ : organs) {
    const OrganTies* ties = world.find<OrganTies>(organ);
    if (!ties || body(organ) < 0 || !world.find<LoadedTies>(organ)->loaded) continue;
    const std::size_t begin = first_link_cell(*world.find<OrganContact>(organ), *ties);
    for (std::size_t i = 0; i < ties->ties.size(); ++i) {
      const OrganTies::Tie& tie = ties->ties[i];
      const auto side = static_cast<std::size_t>(tie.side);
      const OrganTies* others = world.find<OrganTies>(tie.other);
      const int other = others ? body(tie.other) : -1;
      if (other >= 0 && side == 1) continue;  // the other organ's turn
      std::array<Joint::End, 2> ends;
      ends[side] = {body(organ), static_cast<int>(begin + i)};
      if (other >= 0)
        ends[1 - side] = {
            other, static_cast<int>(first_link_cell(*world.find<OrganContact>(tie.other), *others) +
                                    tie.other_tie)};
      each(spring_of(world, tie), tie.link,
           std::array<Entity, 2>{side == 0 ? organ : tie.other, side == 0 ? tie.other : organ},
           ends);
    }
  }
}

}  // namespace

void add_springs(World& world, std::span<const Entity> organs, std::span<const int> bodies,
                 std::vector<Joint>& joints, std::vector<Vec3>& forces) {
  for (const Entity organ : organs)
    if (LoadedTies* ties = world.find<LoadedTies>(organ)) ties->joined = true;
  for_each_spring(world, organs, bodies,
                  [&](LinkState::Spring& spring, Entity link, const auto&, const auto& ends) {
                    Joint joint;
                    joint.ends = ends;
                    joint.held = true;
                    joint.softness = world.find<Link>(link)->softness;
                    joint.displacement = world.find<LinkState>(link)->shift;
                    if (ends[0].body < 0) joint.displacement -= spring.displacements[0];
                    if (ends[1].body < 0) joint.displacement += spring.displacements[1];
                    joints.push_back(joint);
                    forces.push_back(spring.force);
                  });
}

void take_springs(World& world, std::span<const Entity> organs, std::span<const int> bodies,
                  std::span<const Vec3> forces) {
  std::size_t next = 0;
  for_each_spring(
      world, organs, bodies,
      [&](LinkState::Spring& spring, Entity, const std::array<Entity, 2>& tied, const auto& ends) {
        spring.force = forces[next++];
        for (std::size_t end = 0; end < 2; ++end) {
          if (ends[end].body < 0) continue;
          spring.displacements[end] =
              cell_displacement(world, tied[end], static_cast<std::size_t>(ends[end].cell));
        }
        // Should the organs come apart, their links go on from here.
        spring.force_before = spring.force;
        std::ranges::copy(spring.displacements, spring.displacements_before.begin());
      });
}

Feature links_feature() {
  return {.name = "links",
          .keys = links_keys(),
          .reach = reach,
          .prepare = prepare,
          .start = start,
          .states = {state_type<LinkState>()},
          .stages = {{.name = "tie organs",
                      .reads = {"contact cells", "organ poses", "free shapes"},
                      .writes = {"contact cells"},
                      .changes = {"links"},
                      .needed = [](const World& world) { return world.has<OrganTies>(); },
                      .run = add_link_cells}},
          .report = links_report};
}

}  // namespace viscera
