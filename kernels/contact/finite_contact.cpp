#include "kernels/contact/finite_contact.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "kernels/base/disjoint_sets.h"
#include "kernels/base/finite.h"
#include "kernels/base/parallel.h"
#include "kernels/contact/column_sums.h"
#include "kernels/contact/deformation.h"
#include "kernels/finite/finite_limits.h"
#include "kernels/finite/touched_step.h"
#include "kernels/paff/compliance_columns.h"

namespace viscera {
namespace {

/// A body that nothing touches and that lies nearer to its rest than this comes to rest: less than
/// a pixel sees [m], and the way that it would make in a step [m/s].
constexpr double kAsleep = 1e-6, kStill = 1e-4;

Eigen::Index at(std::size_t cell) {
  return static_cast<Eigen::Index>(3 * cell);
}

/// Where columns are summed, by one thread: their sum stays in the first cache, and each column is
/// read on for long enough to be fetched ahead.
constexpr std::size_t kNodesAtOnce = 512;
/// Cells have columns of their own where these are so many times fewer than those of places, or
/// where most of many carry no force: made once, they are read some four times a frame, and for
/// long where a jaw or a link holds or organs touch.
constexpr std::size_t kFewerColumns = 2;

double greatest(const std::vector<double>& values) {
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

}  // namespace

FiniteContact::FiniteContact(const FiniteResponse& body, const IsotropicMaterial& material)
    : PatchContact(body.still, body.surface, material), body_(body) {
  state_.motion = start_ = body_.solver.at_rest();
  ungrouped_.assign(body_.solver.body().nodes(), -1);
  const MatrixX& forces = body_.moved_holds;
  for (Eigen::Index h = 0; h < forces.cols(); h += 3) {
    Mat3& sum = whole_pulls_.emplace_back(Mat3::Zero());
    for (Eigen::Index node = 0; node < forces.rows(); node += 3) sum += forces.block<3, 3>(node, h);
  }
}

void FiniteContact::go_on_from(const FiniteContact& before, const Continuation& continuation) {
  State next;
  const FiniteState& was = before.state_.motion;
  next.motion = body_.solver.at_rest();
  const auto copy = [&](const std::vector<double>& from, std::vector<double>& to,
                        std::size_t numbers) {
    for (std::size_t node = 0; node < continuation.nodes.size(); ++node)
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(
                                     numbers * static_cast<std::size_t>(continuation.nodes[node])),
                  numbers, to.begin() + static_cast<std::ptrdiff_t>(numbers * node));
  };
  copy(was.displacements, next.motion.displacements, 3);
  copy(was.velocities, next.motion.velocities, 3);
  copy(was.rotations, next.motion.rotations, 9);
  next.motion.held = was.held;
  next.motion.lost = was.lost;
  next.motion.steps_released = kStepsReleased;  // what the cut has set free
  next.memory = body_.solver.body().continued(before.body_.solver.body(), before.state_.memory,
                                              terms().size(), continuation);
  restore(std::move(next));
  start_ = state_.motion;
}

bool FiniteContact::fits(const State& state) const {
  const FiniteState& motion = state.motion;
  const std::size_t three = 3 * body_.solver.body().nodes();
  return PatchContact::fits(state) && motion.displacements.size() == three &&
         motion.velocities.size() == three && motion.loads.size() == three &&
         motion.rotations.size() == 3 * three && !first_stray(motion.displacements) &&
         !first_stray(motion.velocities) && !first_stray(motion.loads) &&
         !first_stray(motion.rotations) && motion.held >= 0 && motion.steps_released >= 0 &&
         motion.steps_since_warp >= 0 && motion.lost >= 0 &&
         std::ranges::all_of(state.felt,
                             [&](const State::FootAnswer& one) {
                               return one.place.allFinite() &&
                                      one.displacements.size() == 3 * three &&
                                      one.forces.size() % 3 == 0 &&
                                      !first_stray(one.displacements) && !first_stray(one.forces);
                             }) &&
         body_.solver.body().fits(state.memory, terms().size()) &&
         !first_stray(state.memory.points) && !first_stray(state.memory.dilatations) &&
         !first_stray(state.memory.hold) && !first_stray(state.memory.fibres) &&
         (state.memory.holds.empty() ||
          state.memory.holds.size() ==
              terms().size() * static_cast<std::size_t>(body_.moved_holds.cols())) &&
         !first_stray(state.memory.holds);
}

// --- what follows from the cells' places --------------------------------------------------------

void FiniteContact::make_response() {
  couple_places();
  const MatrixX by_places = response_;
  couple_nearby();
  still_ = response_;
  near_ = still_ - by_places;
  body_.step.need(touched());
  gather_nodes();
  gather_offsets();
  gather_groups();
  list_answers();
  step_ = coupled_by_step();
  turn(state_.motion.rotations);
  response_ = turned_step_ + turned_near_;  // what others that a spring ties to it meet in a step
}

/// As PatchContact couples cells through places, with the columns of a step.
MatrixX FiniteContact::coupled_by_step() {
  if (spread_out()) step_on_touched_.gather(body_.step, touched());
  const Eigen::Index n = coefficients().rows();
  MatrixX response(3 * n, 3 * n);
  for (Eigen::Index a = 0; a < 3; ++a)
    for (Eigen::Index b = a; b < 3; ++b) {
      MatrixX part =
          spread_out()
              ? coupled_apart(step_on_touched_.parts()[static_cast<std::size_t>(3 * a + b)])
              : coupled_by_basis(a, b);
      // Columns in single precision leave their mark; the mirror must be exact.
      if (a == b) part = (0.5 * (part + part.transpose())).eval();
      response(Eigen::seqN(a, n, 3), Eigen::seqN(b, n, 3)) = part;
      if (a != b) response(Eigen::seqN(b, n, 3), Eigen::seqN(a, n, 3)) = part.transpose();
    }
  return response;
}

MatrixX FiniteContact::coupled_by_basis(Eigen::Index a, Eigen::Index b) const {
  const auto m = static_cast<Eigen::Index>(touched().size());
  const std::size_t rows = body_.step.rows();
  MatrixX block(m, m);
  for (Eigen::Index j = 0; j < m; ++j) {
    const auto place = static_cast<std::size_t>(touched()[static_cast<std::size_t>(j)]);
    const float* column = body_.step.columns.data() +
                          (3 * place + static_cast<std::size_t>(b)) * rows +
                          static_cast<std::size_t>(a);
    for (Eigen::Index i = 0; i < m; ++i) {
      const auto other = static_cast<std::size_t>(touched()[static_cast<std::size_t>(i)]);
      block(i, j) = static_cast<double>(column[3 * body_.step.touchable[other]]);
    }
  }
  return coefficients() * (basis() * block * basis().transpose()).eval() *
         coefficients().transpose();
}

/// The fields of nodes at the cells: those of the places, shared as the cells' loads are. Of many
/// cells these shares are exact, so that a cell's answer is its own whatever others there are; by a
/// basis every cell reaches all places.
void FiniteContact::gather_nodes() {
  const SparseWeights& fields = body_.places.fields;
  const auto entries = [&](int touched_place) {
    const auto row =
        static_cast<std::size_t>(surface().places[static_cast<std::size_t>(touched_place)]);
    return std::pair(static_cast<std::size_t>(fields.row_begin[row]),
                     static_cast<std::size_t>(fields.row_begin[row + 1]));
  };
  nodes_.clear();
  for (const int place : touched()) {
    const auto [begin, end] = entries(place);
    nodes_.insert(nodes_.end(), fields.nodes.begin() + static_cast<std::ptrdiff_t>(begin),
                  fields.nodes.begin() + static_cast<std::ptrdiff_t>(end));
  }
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
  std::vector<int> local(body_.solver.body().nodes(), -1);
  for (std::size_t n = 0; n < nodes_.size(); ++n)
    local[static_cast<std::size_t>(nodes_[n])] = static_cast<int>(n);
  const auto add_place = [&](Eigen::Index row, int place, double share, MatrixX& to) {
    const auto [begin, end] = entries(touched()[static_cast<std::size_t>(place)]);
    for (std::size_t e = begin; e < end; ++e)
      to(row, local[static_cast<std::size_t>(fields.nodes[e])]) +=
          share * static_cast<double>(fields.values[e]);
  };
  const auto count = static_cast<Eigen::Index>(nodes_.size());
  const auto places = static_cast<Eigen::Index>(touched().size());
  if (!spread_out()) {
    MatrixX at_places = MatrixX::Zero(places, count);
    for (Eigen::Index j = 0; j < places; ++j) add_place(j, static_cast<int>(j), 1.0, at_places);
    shares_.noalias() = coefficients() * basis();
    fields_.noalias() = shares_ * at_places;
    return;
  }
  const auto cells = static_cast<Eigen::Index>(place_shares().size());
  shares_.setZero(cells, places);
  fields_.setZero(cells, count);
  for (Eigen::Index k = 0; k < cells; ++k)
    for (const PlaceShare& place : place_shares()[static_cast<std::size_t>(k)]) {
      shares_(k, place.touched) = place.share;
      add_place(k, place.touched, place.share, fields_);
    }
}

void FiniteContact::gather_offsets() {
  beside_.clear();
  const LoosePieces& loose = body_.solver.loose();
  if (loose.empty()) return;
  for (std::size_t k = 0; k < state_.places.size(); ++k) {
    const auto row = fields_.row(static_cast<Eigen::Index>(k));
    const auto first = std::ranges::find_if(row, [](double value) { return value != 0.0; });
    if (first == row.end() || !loose.has(static_cast<std::size_t>(
                                  nodes_[static_cast<std::size_t>(first - row.begin())]))) {
      beside_.push_back(Vec3::Zero());
      continue;
    }
    Vec3 mean = Vec3::Zero();
    for (std::size_t j = 0; j < touched().size(); ++j)
      mean += shares_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j)) *
              surface().positions[static_cast<std::size_t>(touched()[j])];
    beside_.push_back(state_.places[k].position - mean);
  }
}

/// Those of loose pieces turn already (pose).
std::vector<Vec3> FiniteContact::beside_places(std::size_t begin, std::size_t end) const {
  std::vector<Vec3> beside = PatchContact::beside_places(begin, end);
  if (beside_.empty()) return beside;
  for (std::size_t k = 0; k < beside.size(); ++k)
    if (!beside_[begin + k].isZero(0.0)) beside[k].setZero();
  return beside;
}

/// Cells that reach a node in common belong together.
void FiniteContact::gather_groups() {
  const auto count = static_cast<std::size_t>(fields_.rows());
  DisjointSets sets(count);
  std::vector<int> first_cell(nodes_.size(), -1);
  for (std::size_t k = 0; k < count; ++k)
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      if (fields_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(n)) == 0.0) continue;
      int& first = first_cell[n];
      if (first < 0) first = static_cast<int>(k);
      sets.join(first, static_cast<int>(k));
    }
  groups_.clear();
  group_of_cell_.assign(count, -1);
  for (std::size_t k = 0; k < count; ++k) {
    const auto first = static_cast<std::size_t>(sets.root(static_cast<int>(k)));
    if (first == k) {
      group_of_cell_[k] = static_cast<int>(groups_.size());
      groups_.emplace_back();
    }
    group_of_cell_[k] = group_of_cell_[first];
    groups_[static_cast<std::size_t>(group_of_cell_[k])].cells.push_back(static_cast<int>(k));
  }
  group_of_node_ = ungrouped_;
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    if (first_cell[n] < 0) continue;
    const int group = group_of_cell_[static_cast<std::size_t>(first_cell[n])];
    group_of_node_[static_cast<std::size_t>(nodes_[n])] = group;
    groups_[static_cast<std::size_t>(group)].first_node = nodes_[n];
  }
}

void FiniteContact::list_answers() {
  const auto count = static_cast<std::size_t>(shares_.rows());
  std::vector<CellShares> cells;
  if (spread_out() || kFewerColumns * count <= touched().size()) cells.resize(count);
  for (std::size_t k = 0; k < cells.size(); ++k)
    for (std::size_t j = 0; j < touched().size(); ++j) {
      const double share = shares_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j));
      if (share == 0.0) continue;
      cells[k].places.push_back(touched()[j]);
      cells[k].shares.push_back(share);
    }
  answers_.follow(std::move(cells));
}

void FiniteContact::drop_response() {
  PatchContact::drop_response();
  still_ = step_ = near_ = fields_ = shares_ = turned_step_ = turned_near_ = MatrixX();
  NodalRotations().swap(rotations_);
  std::vector<int>().swap(nodes_);
  std::vector<Vec3>().swap(beside_);
  std::vector<int>().swap(group_of_cell_);
  std::vector<int>().swap(group_of_node_);
  std::vector<Group>().swap(groups_);
  step_on_touched_ = {};
  answers_ = {};
  stands_ = false;
}

// --- as a step asks ------------------------------------------------------------------------------

std::int32_t FiniteContact::held() const {
  return static_cast<std::int32_t>(
      std::ranges::count_if(cells_, [](const ContactCell& cell) { return cell.held; }));
}

const Mat3& FiniteContact::rotation_of_cell(std::size_t cell) const {
  return groups_[static_cast<std::size_t>(group_of_cell_[cell])].rotation;
}

/// What forces on places do to the nodes: three columns each.
ColumnTriples FiniteContact::nodal_columns() const {
  const std::size_t first = 3 * body_.places.size(), rows = body_.step.rows();
  return {body_.step.columns.data() + first, rows - first, rows};
}

MatrixX FiniteContact::turned(const MatrixX& response) const {
  MatrixX result;
  turn_into(response, result);
  return result;
}

/// Into memory that is at hand: of many cells its pages take longer to get than to fill.
void FiniteContact::turn_into(const MatrixX& response, MatrixX& turned) const {
  turned.resize(response.rows(), response.cols());
  const std::size_t count = group_of_cell_.size();
  for (std::size_t l = 0; l < count; ++l)
    for (std::size_t k = 0; k < count; ++k)
      turned.block<3, 3>(at(k), at(l)).noalias() = rotation_of_cell(k) *
                                                   response.block<3, 3>(at(k), at(l)) *
                                                   rotation_of_cell(l).transpose();
}

MatrixX FiniteContact::taken_by_update(std::size_t begin, std::size_t end) const {
  MatrixX taken = PatchContact::taken_by_update(begin, end);
  for (std::size_t l = begin; taken.size() > 0 && l < end; ++l)
    for (std::size_t k = begin; k < end; ++k) {
      auto block = taken.block<3, 3>(at(k - begin), at(l - begin));
      block = (rotation_of_cell(k) * block * rotation_of_cell(l).transpose()).eval();
    }
  return taken;
}

void FiniteContact::turn(const NodalRotations& rotations) {
  rotations_ = rotations;
  for (Group& group : groups_)
    group.rotation = rotation_of(rotations, static_cast<std::size_t>(group.first_node));
  turn_into(step_, turned_step_);
  turn_into(near_, turned_near_);
  turned_near_ /= 1.0 + overstiffness(terms());
  near_before_.resize(0);
  if (near_loads_.size() == turned_near_.cols()) near_before_ = turned_near_ * near_loads_;
}

double FiniteContact::near_energy() const {
  VectorX forces(at(state_.forces.size()));
  if (forces.size() != turned_near_.cols()) return 0.0;
  for (std::size_t k = 0; k < state_.forces.size(); ++k)
    forces.segment<3>(at(k)) = state_.forces[k];
  return 0.5 * forces.dot(turned_near_ * forces);
}

VectorX FiniteContact::displaced(const VectorX& u) const {
  return cells_.empty() ? VectorX() : moved_cells(u);
}

VectorX FiniteContact::moved_cells(const VectorX& u) const {
  VectorX cells(3 * fields_.rows());
  Eigen::Matrix<double, 3, Eigen::Dynamic> nodal(3, static_cast<Eigen::Index>(nodes_.size()));
  for (std::size_t n = 0; n < nodes_.size(); ++n)
    nodal.col(static_cast<Eigen::Index>(n)) = u.segment<3>(3 * nodes_[n]);
  Eigen::Map<Eigen::Matrix3Xd>(cells.data(), 3, fields_.rows()).noalias() =
      nodal * fields_.transpose();
  return cells;
}

VectorX FiniteContact::answer_to(const VectorX& forces) const {
  return answers_to(forces);
}

/// Of several at once, columns being long to read. Of cells with columns of their own only those
/// that carry a force are asked.
MatrixX FiniteContact::answers_to(const MatrixX& forces) const {
  const Eigen::Index count = forces.cols();
  const std::size_t nodes = rotations_.size() / 9;
  const bool by_cell = !answers_.empty();
  std::vector<std::size_t> loaded;
  for (std::size_t k = 0; k < group_of_cell_.size(); ++k)
    if (!by_cell || !forces.middleRows<3>(at(k)).isZero(0.0)) loaded.push_back(k);
  if (loaded.empty()) return MatrixX::Zero(at(nodes), count);
  std::vector<Eigen::Matrix3Xf> loads;
  for (Eigen::Index c = 0; c < count; ++c) {
    Eigen::Matrix3Xd unturned(3, static_cast<Eigen::Index>(loaded.size()));
    for (std::size_t i = 0; i < loaded.size(); ++i)
      unturned.col(static_cast<Eigen::Index>(i)) =
          rotation_of_cell(loaded[i]).transpose() * forces.col(c).segment<3>(at(loaded[i]));
    loads.push_back((by_cell ? unturned : unturned * shares_).cast<float>());
  }
  std::vector<int> triples;
  if (by_cell) {
    answers_.need(loaded, nodal_columns());
    for (const std::size_t cell : loaded) triples.push_back(answers_.number(cell));
  }
  const ColumnTriples columns = by_cell ? answers_.columns() : nodal_columns();
  MatrixX moved(at(nodes), count);
  parallel_chunks(nodes, kNodesAtOnce, [&](std::size_t begin, std::size_t end) {
    const Eigen::Index first = at(begin), size = at(end) - first;
    Eigen::MatrixXf sums = Eigen::MatrixXf::Zero(size, count);
    add_column_triples({columns.values + first, static_cast<std::size_t>(size), columns.stride},
                       by_cell ? triples : touched(), loads, sums.data());
    for (std::size_t node = begin; node < end; ++node)
      for (Eigen::Index c = 0; c < count; ++c)
        moved.col(c).segment<3>(at(node)) =
            rotation_of(rotations_, node) * sums.col(c).segment<3>(at(node) - first).cast<double>();
  });
  return moved;
}

void FiniteContact::add_loads(const VectorX& forces, VectorX& loads) const {
  const Eigen::Matrix3Xd nodal =
      Eigen::Map<const Eigen::Matrix3Xd>(forces.data(), 3, fields_.rows()) * fields_;
  for (std::size_t n = 0; n < nodes_.size(); ++n)
    loads.segment<3>(3 * nodes_[n]) += nodal.col(static_cast<Eigen::Index>(n));
}

std::optional<VectorX> FiniteContact::standing() const {
  if (greatest(start_.loads) == 0.0) return VectorX(VectorX::Zero(at(cells_.size())));
  if (cells_.empty() || start_forces_.size() != cells_.size() || state_.places != start_places_)
    return std::nullopt;
  return VectorX(Eigen::Map<const VectorX>(start_forces_.front().data(), at(cells_.size())));
}

/// Cells that were there when the last step ended were where that left them, with what is finer
/// than places. What a spring's end is wanted at it need never reach.
double FiniteContact::begin(const VectorX& displaced) {
  const std::vector<Place>& places = so_far_ ? so_far_places_ : start_places_;
  const std::vector<Vec3>& displacements = so_far_ ? state_.displacements : start_displacements_;
  const bool known = displacements.size() == places.size();
  double most = 0.0;
  begun_.clear();
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const auto last = std::ranges::find(places, state_.places[k]);
    const Vec3 here = known && last != places.end()
                          ? displacements[static_cast<std::size_t>(last - places.begin())]
                          : Vec3(displaced.segment<3>(at(k)));
    begun_.push_back(here);
    const ContactCell& cell = cells_[k];
    if (yields(k)) continue;
    const double way =
        cell.held ? (cell.displacement - here).norm() : cell.depth - here.dot(cell.direction);
    if (!(way <= most)) most = way;
  }
  return most;
}

void FiniteContact::pose(const TouchQuestion& question) {
  asked_.assign(cells_.begin(), cells_.end());
  for (std::size_t k = 0; k < asked_.size(); ++k) {
    ContactCell& cell = asked_[k];
    cell.free += question.free.segment<3>(at(k));
    if (!beside_.empty()) cell.free += rotation_of_cell(k) * beside_[k] - beside_[k];
    if (near_before_.size() > 0) cell.free += near_before_.segment<3>(at(k));
    if (question.share == 1.0 || yields(k)) continue;
    const Vec3& begun = begun_[k];
    cell.displacement = begun + question.share * (cell.displacement - begun);
    const double pushed = begun.dot(cell.direction);
    if (cell.depth > pushed) cell.depth = pushed + question.share * (cell.depth - pushed);
  }
  response_ = turned_step_ + turned_near_;
  if (question.more.size() > 0) response_ += question.more;
  stands_ = false;
  response_changed();
}

std::optional<VectorX> FiniteContact::solve(const TouchQuestion& question) {
  pose(question);
  PatchContact::solve(asked_, *solution_, *answer_, backing_);
  if (!solution_->converged) return std::nullopt;
  return Eigen::Map<const VectorX>(solution_->forces.front().data(), at(cells_.size()));
}

// --- what relaxes --------------------------------------------------------------------------------

/// Once a step, and only of a body that is solved: one at rest has nothing to remember.
void FiniteContact::relax() {
  if (terms().empty() || relaxed_) return;
  relaxed_ = true;
  overstress_ = body_.solver.body().relax(start_.displacements, changed_, terms(), state_.memory);
  relax_holds();
  start_remembered_ = remembers() ? state_.remembered : std::vector<Vec3>();
  const std::vector<Vec3> forces = without_relaxation(start_forces_);
  const std::size_t cells = start_places_.size();
  for (std::size_t i = 0; i < start_remembered_.size(); ++i)
    start_remembered_[i] +=
        (1.0 - terms()[i / cells].kept) * (forces[i % cells] - start_remembered_[i]);
}

/// Of what is finer than places: a cell remembers what the nearest of the last step's does, no
/// farther off than a cell is wide; tissue that a tool has newly come to has been at rest.
void FiniteContact::remember_cells() {
  state_.remembered.clear();
  near_loads_.resize(0);
  if (terms().empty() || cells_.empty()) return;
  const std::size_t count = cells_.size(), before = start_places_.size();
  state_.remembered.assign(terms().size() * count, Vec3::Zero());
  if (start_remembered_.size() != terms().size() * before) return;
  for (std::size_t k = 0; k < count; ++k) {
    const auto distance = [&](const Place& other) {
      return (other.position - state_.places[k].position).squaredNorm();
    };
    const auto last = std::ranges::min_element(start_places_, {}, distance);
    if (last == start_places_.end() || !(distance(*last) < state_.places[k].area)) continue;
    const auto from = static_cast<std::size_t>(last - start_places_.begin());
    for (std::size_t t = 0; t < terms().size(); ++t)
      state_.remembered[t * count + k] = start_remembered_[t * before + from];
  }
  near_loads_ = VectorX::Zero(at(count));
  for (std::size_t t = 0; t < terms().size(); ++t)
    for (std::size_t k = 0; k < count; ++k)
      near_loads_.segment<3>(at(k)) += terms()[t].over * state_.remembered[t * count + k];
}

/// Forces that would do to tissue that has relaxed what these do now.
std::vector<Vec3> FiniteContact::without_relaxation(std::span<const Vec3> forces) const {
  std::vector<Vec3> elastic(forces.begin(), forces.end());
  const std::size_t count = state_.places.size();
  if (!remembers()) return elastic;
  const double stiff = 1.0 + overstiffness(terms());
  elastic.resize(count, Vec3::Zero());
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t t = 0; t < terms().size(); ++t)
      elastic[k] += terms()[t].over * state_.remembered[t * count + k];
    elastic[k] /= stiff;
  }
  return elastic;
}

VectorX FiniteContact::in_one(std::span<const Vec3> ways) const {
  VectorX all = VectorX::Zero(body_.moved_holds.cols());
  for (std::size_t h = 0; h < ways.size() && at(h) < all.size(); ++h)
    all.segment<3>(at(h)) = ways[h];
  return all;
}

void FiniteContact::pull_by_holds(const VectorX& ways) {
  if (ways.isZero(0.0))
    load_.forces.resize(0);
  else
    load_.forces = body_.moved_holds * ways;
}

/// Of a body at rest, by which one that has gone along as a whole has none.
double FiniteContact::energy_of_holds(const VectorX& ways) const {
  double energy = 0.0;
  for (std::size_t h = 0; h < whole_pulls_.size(); ++h) {
    const Vec3 way = ways.segment<3>(at(h));
    energy += 0.5 * way.dot(whole_pulls_[h] * way);
  }
  return energy;
}

/// What one has that doesn't follow in this step: what a step gains is told as a share of some
/// energy, and a body that goes along as a whole has no other.
double FiniteContact::energy_left_behind() const {
  return energy_of_holds(in_one(drive_.holds) - in_one(drive_.holds_before));
}

void FiniteContact::pull_at_once() {
  const VectorX ways = in_one(drive_.holds);
  pull_by_holds(ways);
  load_.energy = energy_of_holds(ways) + energy_left_behind();
}

/// A hold pulls as much more as tissue that has had no time to relax, and less by what has let go:
/// tissue that has followed it feels nothing of its way.
void FiniteContact::relax_holds() {
  const VectorX now = in_one(drive_.holds), before = in_one(drive_.holds_before);
  const auto ways = static_cast<std::size_t>(now.size());
  if (ways == 0) return;
  std::vector<double>& means = state_.memory.holds;
  if (means.empty()) means.assign(terms().size() * ways, 0.0);
  const double stiff = 1.0 + overstiffness(terms());
  VectorX pulling = stiff * now;
  load_.energy = stiff * energy_of_holds(now) + energy_left_behind();
  for (std::size_t t = 0; t < terms().size(); ++t) {
    Eigen::Map<VectorX> mean(means.data() + t * ways, now.size());
    mean += (1.0 - terms()[t].kept) * (before - mean);
    pulling -= terms()[t].over * mean;
    load_.energy -= terms()[t].over * energy_of_holds(mean);
  }
  pull_by_holds(pulling);
}

// --- steps ---------------------------------------------------------------------------------------

void FiniteContact::stiffen(std::shared_ptr<const StiffnessUpdate> update) {
  so_far_.reset();
  PatchContact::stiffen(std::move(update));
  note_changes();
}

void FiniteContact::note_changes() {
  changed_ =
      body_.solver.body().changed(update() ? update()->change : TissueChange(), drive_.swelling);
}

void FiniteContact::begin_step(const StepDrive& drive) {
  const double swelled = std::exchange(drive_, drive).swelling;
  if (swelled != drive.swelling) note_changes();
  std::erase_if(state_.felt, [](const State::FootAnswer& one) { return !one.asked; });
  for (State::FootAnswer& one : state_.felt) one.asked = false;
  start_ = state_.motion;
  start_places_ = state_.places;
  start_displacements_ = state_.displacements;
  start_forces_ = state_.forces;
  so_far_.reset();
  relaxed_ = false;
  load_ = BodyLoad(drive.acceleration);
  if (terms().empty()) pull_at_once();
  told_ = {};
}

bool FiniteContact::is_driven() const {
  return !drive_.acceleration.isZero(0.0) || !changed_.packs.empty() ||
         !body_.solver.body().weight().empty() ||
         std::ranges::any_of(drive_.holds, [](const Vec3& way) { return !way.isZero(0.0); });
}

bool FiniteContact::moving() const {
  return is_driven() || greatest(state_.motion.displacements) > 0.0 ||
         greatest(state_.motion.velocities) > 0.0;
}

void FiniteContact::begin_solve(std::span<const ContactCell> cells, std::size_t own, bool shared,
                                ContactSolution& solution, ContactResponse& response) {
  relax();
  state_.motion = start_;
  if (!cells.empty()) see_places(cells, true, shared);
  if (cells.empty() || state_.places != so_far_places_) so_far_.reset();
  cells_ = cells;
  own_ = own;
  asked_.clear();
  solution_ = &solution;
  answer_ = &response;
  remember_cells();
}

void FiniteContact::end_solve(std::size_t cells) {
  cells_ = {};
  so_far_places_ = state_.places;
  if (!told_.answered || told_.lost) {
    solution_->converged = false;
    solution_->forces.assign(cells, Vec3::Zero());
    state_.forces.clear();
  }
  if (cells == 0 && !is_driven() && greatest(state_.motion.displacements) < kAsleep &&
      greatest(state_.motion.velocities) < kStill) {
    const std::int32_t lost = state_.motion.lost;
    state_.motion = body_.solver.at_rest();
    state_.motion.lost = lost;
    state_.memory = {};
  }
}

void FiniteContact::solve(std::span<const ContactCell> cells, ContactSolution& solution,
                          ContactResponse& response, const MatrixX& backing) {
  const bool sound =
      std::ranges::all_of(cells, [](const ContactCell& cell) { return is_sound(cell); });
  if (cells.empty() || !sound) PatchContact::solve(cells, solution, response);
  if (!sound) return;
  backing_ = backing;
  begin_solve(cells, cells.size() - static_cast<std::size_t>(backing.rows()) / 3, false, solution,
              response);
  told_ = body_.solver.step(*this, state_.motion, load_, &so_far_);
  end_solve(cells.size());
}

/// A step whose questions others answer. One that has ended stays in touch as its last question
/// says, so that those who go on still feel it give way.
class FiniteContact::Share final : public SharedSolve {
 public:
  explicit Share(FiniteContact& body)
      : body_(body),
        cells_(body.cells_.size()),
        step_(body.body_.solver, body, body.state_.motion, body.load_, &body.so_far_, true) {
    pose();
  }
  const SharedQuestion& question() const override { return question_; }
  void answer(const VectorX* forces) override {
    step_.answer(forces ? std::optional(*forces) : std::nullopt);
    pose();
  }
  void end(const VectorX* forces, const MatrixX& backing) override {
    const std::vector<ContactCell> asked = body_.asked_;
    while (step_.question()) step_.answer(forces ? std::optional(*forces) : std::nullopt);
    body_.told_ = step_.end(forces);
    const bool good = forces && body_.told_.answered;
    body_.take(asked, good ? forces : nullptr, backing, *body_.solution_, *body_.answer_);
    body_.end_solve(cells_);
  }

 private:
  void pose() {
    const TouchQuestion* asked = step_.question();
    question_.last = !asked || asked->last;
    if (!asked) return;
    body_.pose(*asked);
    question_.response = &body_.response_;
    question_.cells = body_.asked_;
    question_.free.resize(at(cells_));
    for (std::size_t k = 0; k < cells_; ++k)
      question_.free.segment<3>(at(k)) = question_.cells[k].free;
  }

  FiniteContact& body_;
  std::size_t cells_;
  TouchedStep step_;
  SharedQuestion question_;
};

std::unique_ptr<SharedSolve> FiniteContact::share(std::span<const ContactCell> cells,
                                                  std::size_t own, ContactSolution& solution,
                                                  ContactResponse& response) {
  // Of a step that goes on, cells are where it has come.
  std::vector<Vec3> come = state_.displacements;
  if (!begin_answer(cells, solution, response)) return nullptr;
  state_.displacements = std::move(come);
  begin_solve(cells, own, true, solution, response);
  return std::make_unique<Share>(*this);
}

std::optional<OthersHold> FiniteContact::hold_of_others(std::span<const ContactCell> cells,
                                                        std::size_t begin, std::size_t end,
                                                        const MatrixX& shares) {
  if (!stands_ && !state_.places.empty()) {
    ensure_response();
    response_ = turned(still_);
    remake_matrix();
    response_changed();
    stands_ = true;
  }
  if (!remembers()) return PatchContact::hold_of_others(cells, begin, end, shares);
  // The body at rest has had all the time to relax.
  std::vector<Vec3> forces = without_relaxation(state_.forces);
  std::swap(forces, state_.forces);
  auto hold = PatchContact::hold_of_others(cells, begin, end, shares);
  std::swap(forces, state_.forces);
  return hold;
}

// --- shapes -----------------------------------------------------------------------------------

void FiniteContact::place_displacements(const ContactResponse&, std::vector<float>& displacements) {
  displacements.resize(3 * body_.places.size());
  read_places(body_.places.fields, state_.motion.displacements.data(), displacements.data());
}

/// Near fields are found where the tissue was at rest, and turned with it.
void FiniteContact::draw(std::span<const float> displacements, std::span<const ContactCell> cells,
                         const ContactSolution& solution, std::vector<Vec3f>& positions) const {
  deformed_positions(drawn(), displacements, {}, {}, {}, positions);
  if (solution.near_fields.size() != cells.size() || solution.forces.size() != cells.size() ||
      group_of_cell_.size() != cells.size())
    return;
  const std::vector<Vec3> pulls = without_relaxation(solution.forces);
  std::vector<int> vertices;
  std::vector<Vec3f> moved;
  for (const Group& group : groups_) {
    std::vector<NearField> near;
    std::vector<ContactCell> own;
    std::vector<Vec3> forces;
    for (const int cell : group.cells) {
      const auto k = static_cast<std::size_t>(cell);
      near.push_back(solution.near_fields[k]);
      own.push_back(cells[k]);
      forces.push_back(group.rotation.transpose() * pulls[k]);
    }
    near_field_on_surface(drawn(), near, own, forces, vertices, moved);
    const Eigen::Matrix3f rotation = group.rotation.cast<float>();
    for (std::size_t v = 0; v < vertices.size(); ++v)
      positions[static_cast<std::size_t>(vertices[v])] += rotation * moved[v];
  }
}

}  // namespace viscera
