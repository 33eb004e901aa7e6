#include "kernels/hive/hive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "kernels/baselines/hive/collocated_nodes.h"
#include "kernels/baselines/hive/pinned_nodes.h"
#include "kernels/contact/facing.h"
#include "kernels/contact/half_space.h"
#include "kernels/hive/hive_nodes.h"
#include "kernels/hive/interior_field.h"
#include "kernels/hive/layered_stiffness.h"
#include "kernels/hive/pressed_cells.h"
#include "kernels/hive/spread_response.h"

namespace viscera {
namespace {

constexpr int kFewestNodes = 14, kMostNodes = 512, kMostCells = 127, kMostPaperNodes = 200;
constexpr std::size_t kMostPlaces = 4096;
/// Cells may lie out to the middle between the last free ring and the periphery.
double usable_share(const HivePattern& pattern) {
  const auto radius_of = [&](int ring) {
    return pattern.places()[static_cast<std::size_t>(ring == 0 ? 0 : 1 + 3 * ring * (ring - 1))]
        .norm();
  };
  return 0.5 * (radius_of(pattern.rings() - 1) + radius_of(pattern.rings()));
}

/// A hive that finds no room is tried so much smaller, down to this share of its radius.
constexpr double kSmaller = 0.7, kSmallest = 0.4;

double disc_radius(double area) {
  return std::sqrt(area / std::numbers::pi);
}

}  // namespace

std::string_view name_of(HiveFormulation formulation) {
  return formulation == HiveFormulation::kPaper ? "paper" : "subtracted";
}

std::string_view name_of(HivePeriphery periphery) {
  constexpr std::string_view names[] = {"coupled", "boussinesq", "fixed"};
  return names[static_cast<int>(periphery)];
}

namespace {

/// A half-space under one place whose modulus changes with depth, over that of its material: what
/// is spread over the nodes meets `wide`, a cell `narrow`, and what lies between the bells.
/// As near_response (near_modulus.h) sums up, but for what the nodes carry, with as many bands
/// whatever the cells.
struct LayeredGround {
  struct Bell {
    double sigma = 0.0, softness = 0.0;
  };
  double wide = 1.0, narrow = 1.0;
  double tool = 1.0;  ///< that of a uniform one that answers the tool alike
  std::array<Bell, NearModulus::kBands - 1> bells;
  std::size_t count = 0;  ///< of the bells

  /// To a cell's own kernels at that distance; `spread`: 1, or where the answer is a mean over a
  /// bell, too, sqrt(2).
  RadialKernels answer(const RadialKernels& cell, double r, double spread) const {
    if (count == 0) return cell;
    RadialKernels sum = cell * (1.0 / narrow);
    for (std::size_t i = 0; i < count; ++i)
      sum = sum - gaussian_to_point(r, spread * bells[i].sigma) * -bells[i].softness;
    return sum;
  }
};

}  // namespace

/// What building takes besides the hive itself, and what hives of a kind have in common.
struct Hive::Workshop {
  HivePattern pattern;
  InteriorField interior;
  std::optional<LayeredStiffness> stiffness;
  std::optional<SpreadResponse> spread;
  std::optional<CollocatedNodes> collocated;  ///< `paper`
  MatrixX loads, held;

  Workshop(const HiveBody& on, const HiveSettings& wanted)
      : pattern(wanted.nodes), interior(wanted.material) {
    const int b = 3 * pattern.free_nodes();
    if (wanted.formulation == HiveFormulation::kPaper) {
      collocated.emplace(pattern);
    } else if (wanted.periphery == HivePeriphery::kCoupled) {
      spread.emplace(*on.compliance, *on.touchable, wanted.material, pattern.ring_nodes(),
                     kMostPlaces);
    } else {
      const bool fixed = wanted.periphery == HivePeriphery::kFixed;
      stiffness.emplace(pattern, fixed ? b : 0);
      loads.resize(b, b);
      if (fixed) held = MatrixX::Zero(3 * pattern.nodes(), b);
    }
    disc_to_disc(0.0, 1.0);  // fills its table
  }
  int unknowns() const {
    return stiffness ? stiffness->unknowns() : collocated ? collocated->unknowns() : 0;
  }
};

struct Hive::Data {
  HiveBody body;
  HiveSettings settings;
  std::shared_ptr<Workshop> workshop;
  const HivePattern& pattern;
  HiveNodes nodes;
  HalfSpace half_space;
  PressedCells pressed;
  std::optional<PinnedNodes> pinned;  ///< `paper`
  /// Surface nodes that are moved by more than the half-space, the first n of m: without a
  /// periphery of its own all of them, else those inside it.
  int moved = 0;
  /// w at these per force on each, (3 n) x (3 n) [m/N]; `paper`: all of u
  MatrixX correction;
  LayeredGround ground;
  double usable = 0.0;
  bool is_built = false, is_seated = false;
  HiveFigures figures;

  std::vector<ContactCell> cells;
  std::vector<double> cell_forces;   ///< of the last press [N]
  std::vector<PatternPlace> places;  ///< of the cells
  HoldBlend hold;                    ///< of others, about them
  MatrixX held, give;                ///< of the cells in it, 18 x cells and 2 x cells
  bool holds_all = false;            ///< what it takes off was bearable
  MatrixX images;                    ///< correction times the cells' weights, (3 n) x cells
  VectorX node_forces;               ///< of the last press, (3 m) [N]

  Data(const HiveBody& on, const HiveSettings& wanted, std::shared_ptr<Workshop> shop,
       int most_cells)
      : body(on),
        settings(wanted),
        workshop(std::move(shop)),
        pattern(workshop->pattern),
        nodes(pattern),
        half_space(wanted.material),
        pressed(most_cells),
        moved(workshop->spread ? pattern.ring_nodes() : pattern.free_nodes()) {
    if (workshop->collocated) pinned.emplace(pattern.free_nodes());
    correction = MatrixX::Zero(3 * moved, 3 * moved);
    const auto most = static_cast<std::size_t>(most_cells);
    cells.reserve(most);
    cell_forces.reserve(most);
    places.reserve(most);
    images.resize(3 * moved, most_cells);
    held.resize(18, most_cells);
    give.resize(2, most_cells);
    node_forces = VectorX::Zero(3 * pattern.ring_nodes());
    usable = usable_share(pattern) * wanted.radius;
    figures.nodes = pattern.nodes();
    figures.surface_nodes = pattern.ring_nodes();
    figures.unknowns = workshop->unknowns();
  }

  void look_down() noexcept;
  bool condense_to_surface() noexcept;
  void fill_compliance(bool all) noexcept;
  double alone(Eigen::Index k, Eigen::Index l) const noexcept;
  PatternPlace locate(const Vec3& point) const noexcept;
};

/// w between surface nodes by the hive's own equations: on the surface the half-space's tractions
/// taken off, which are where the surface isn't the plane; on the periphery 0, or the half-space's
/// displacement taken off.
bool Hive::Data::condense_to_surface() noexcept {
  const InteriorField& interior = workshop->interior;
  LayeredStiffness& stiffness = *workshop->stiffness;
  MatrixX &loads = workshop->loads, &held = workshop->held;
  const int m = pattern.ring_nodes(), free = pattern.free_nodes(), lowest = pattern.layers() - 1;
  loads.setZero();
  for (int j = 0; j < free; ++j) {
    const auto at = static_cast<std::size_t>(j);
    const Vec3 inward = -nodes.normals[at];
    for (int i = 0; i < free; ++i) {
      if (i == j) continue;
      const auto on = static_cast<std::size_t>(i);
      loads.block<3, 3>(3 * i, 3 * j) =
          -nodes.areas[on] *
          interior.traction(nodes.positions[on] - nodes.positions[at], inward, nodes.normals[on]);
    }
    if (held.size() == 0) continue;
    for (int p = 0; p < pattern.nodes(); ++p) {
      if (p % m < free && p / m != lowest) continue;
      held.block<3, 3>(3 * p, 3 * j) = -interior.displacement(
          nodes.positions[static_cast<std::size_t>(p)] - nodes.positions[at], inward);
    }
  }
  if (!stiffness.assemble(pattern, nodes.positions, settings.material,
                          held.size() > 0 ? &held : nullptr))
    return false;
  if (!stiffness.solve(loads)) return false;
  for (Eigen::Index j = 0; j < loads.cols(); ++j)
    for (Eigen::Index i = 0; i <= j; ++i)
      correction(i, j) = correction(j, i) = 0.5 * (loads(i, j) + loads(j, i));
  return true;
}

/// What the tissue about the centre is made of, down from it.
void Hive::Data::look_down() noexcept {
  ground = {};
  if (!body.touchable || body.touchable->modulus.empty()) return;
  const Vec3 &at = nodes.centre.position, &normal = nodes.centre.normal;
  const double spread = PatchContact::spread_factor();
  const double usual = spread * spacing_at(*body.touchable, at);
  const NearModulus bands = near_modulus_at(*body.touchable, at, normal, spread, usual);
  ground.wide = bands.pressed.front();
  ground.narrow = bands.pressed.back();
  for (std::size_t j = 1; j < NearModulus::kBands; ++j) {
    const double change = 1.0 / bands.pressed[j - 1] - 1.0 / bands.pressed[j];
    if (std::abs(change) < kSameModulus / bands.pressed[j]) continue;
    ground.bells[ground.count++] = {std::ldexp(usual, -static_cast<int>(j)), change};
  }
  const double radius = settings.pressed > 0.0 ? settings.pressed : 0.125 * settings.radius;
  const double sigma = std::max(usual, PatchContact::narrowest_bell() * radius);
  ground.tool = effective_modulus(settings.material, sigma, radius,
                                  near_modulus_at(*body.touchable, at, normal, spread, sigma));
}

/// The seated cells' compliance along their directions, with what the hold leaves of it, `all`:
/// less what it takes off; lower triangle.
void Hive::Data::fill_compliance(bool all) noexcept {
  const int n = static_cast<int>(cells.size());
  Eigen::Ref<MatrixX> matrix = pressed.begin(n);
  const bool holds = !hold.none();
  holds_all = all && holds;
  for (int k = 0; k < n; ++k) {
    const ContactCell& one = cells[static_cast<std::size_t>(k)];
    const PatternPlace& place = places[static_cast<std::size_t>(k)];
    HoldBlend::Vector18 taken = HoldBlend::Vector18::Zero();
    if (holds_all) taken = held.col(k).cwiseProduct(hold.signs());
    for (int l = 0; l <= k; ++l) {
      const ContactCell& other = cells[static_cast<std::size_t>(l)];
      double amount = 0.0;
      for (std::size_t a = 0; a < 3; ++a)
        if (place.nodes[a] < moved)
          amount +=
              place.weights[a] * one.direction.dot(images.col(l).segment<3>(3 * place.nodes[a]));
      const double share = facing(one.normal.dot(other.normal));
      if (share > 0.0) {
        const Vec3 offset = one.position - other.position;
        const double radius = disc_radius(0.5 * (one.area + other.area));
        const RadialKernels kernels =
            ground.answer(disc_to_disc(offset.norm(), radius), offset.norm(), std::numbers::sqrt2);
        amount += share *
                  one.direction.dot(half_space.displacement(
                      kernels, offset, (one.normal + other.normal).normalized(), other.direction));
      }
      if (holds) amount *= give.col(k).dot(give.col(l));
      if (holds_all) amount -= taken.dot(held.col(l));
      matrix(k, l) = amount;
    }
  }
}

/// What that would be without any hold, between cells k and l <= k.
double Hive::Data::alone(Eigen::Index k, Eigen::Index l) const noexcept {
  double amount = pressed.matrix()(k, l);
  if (hold.none()) return amount;
  if (holds_all) amount += held.col(k).cwiseProduct(hold.signs()).dot(held.col(l));
  return amount / give.col(k).dot(give.col(l));
}

PatternPlace Hive::Data::locate(const Vec3& point) const noexcept {
  PatternPlace place = pattern.locate(nodes.in_disc(point));
  if (settings.periphery != HivePeriphery::kFixed) return place;
  // Held, w is smooth but not zero at the rim, where no load can act: carried on from inside.
  double sum = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (place.nodes[a] >= pattern.free_nodes()) place.weights[a] = 0.0;
    sum += place.weights[a];
  }
  if (sum > 1e-6) {
    for (double& weight : place.weights) weight /= sum;
  } else {
    place = {{0, 0, 0}, {1.0, 0.0, 0.0}};
  }
  return place;
}

Hive::Hive(std::unique_ptr<Data> data) : data_(std::move(data)) {}
Hive::Hive(Hive&&) noexcept = default;
Hive& Hive::operator=(Hive&&) noexcept = default;
Hive::~Hive() = default;

Result<Hive> Hive::create(const HiveBody& body, const HiveSettings& settings, int most_cells) {
  auto one = create_some(body, settings, most_cells, 1);
  if (!one) return std::unexpected(one.error());
  return std::move(one->front());
}

Result<std::vector<Hive>> Hive::create_some(const HiveBody& body, const HiveSettings& settings,
                                            int most_cells, int count) {
  Error mistakes;
  const auto mistake = [&](std::string text) {
    mistakes.messages.push_back("hive: " + std::move(text));
  };
  const IsotropicMaterial& material = settings.material;
  if (!body.surface) mistake("found no surface to stand on, expected one");
  if (!(settings.radius > 0.0) || !std::isfinite(settings.radius))
    mistake("radius: found " + std::to_string(settings.radius) + " m, expected above 0");
  if (!(settings.depth >= 0.0) || !std::isfinite(settings.depth))
    mistake("depth: found " + std::to_string(settings.depth) + " m, expected 0 or above");
  if (settings.nodes < kFewestNodes || settings.nodes > kMostNodes)
    mistake("nodes: found " + std::to_string(settings.nodes) + ", expected from " +
            std::to_string(kFewestNodes) + " to " + std::to_string(kMostNodes));
  if (most_cells < 1 || most_cells > kMostCells)
    mistake("cells: found " + std::to_string(most_cells) + ", expected from 1 to " +
            std::to_string(kMostCells));
  if (!(material.youngs_modulus > 0.0) || !std::isfinite(material.youngs_modulus))
    mistake("Young's modulus: found " + std::to_string(material.youngs_modulus) +
            " Pa, expected above 0");
  if (!(material.poisson_ratio >= 0.0 && material.poisson_ratio < 0.5))
    mistake("Poisson's ratio: found " + std::to_string(material.poisson_ratio) +
            ", expected from 0 to below 0.5");
  if (settings.formulation == HiveFormulation::kPaper) {
    if (settings.nodes > kMostPaperNodes)
      mistake("nodes: found " + std::to_string(settings.nodes) + ", expected at most " +
              std::to_string(kMostPaperNodes) + " with formulation \"paper\"");
    if (settings.periphery == HivePeriphery::kCoupled)
      mistake(
          "periphery: found coupled, expected boussinesq or fixed with formulation \"paper\": its "
          "periphery lies inside the body, where no compliance is stored");
  } else if (settings.periphery == HivePeriphery::kCoupled) {
    if (!body.compliance || !body.touchable)
      mistake("periphery \"coupled\" needs a precomputed compliance, found none; use boussinesq");
    else if (!body.compliance->symmetric)
      mistake("periphery \"coupled\" needs a symmetric compliance: of another formulation");
  }
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  const auto workshop = std::make_shared<Workshop>(body, settings);
  std::vector<Hive> hives;
  for (int i = 0; i < count; ++i)
    hives.push_back(Hive(std::make_unique<Data>(body, settings, workshop, most_cells)));
  return hives;
}

HiveVerdict Hive::build(const SurfaceSpot& centre) noexcept {
  Data& d = *data_;
  d.is_built = d.is_seated = false;
  double radius = d.settings.radius;
  const auto place = [&] {
    return d.nodes.place(d.pattern, *d.body.surface, centre, radius, d.settings.depth);
  };
  HiveVerdict placed = place();
  // Where the body itself moves its edge, a smaller one answers as well, and finds room beside
  // walls of cuts, edges and folds.
  while (placed == HiveVerdict::kFolded && d.workshop->spread &&
         radius > kSmallest * d.settings.radius) {
    radius *= kSmaller;
    placed = place();
  }
  if (placed != HiveVerdict::kSound) return placed;
  d.usable = usable_share(d.pattern) * radius;
  Workshop& shop = *d.workshop;
  d.look_down();
  if (shop.spread) {
    if (!shop.spread->gather({d.nodes.positions.data(), d.nodes.normals.size()}, d.nodes.normals,
                             d.ground.wide, d.correction))
      return HiveVerdict::kTooWide;
  } else if (shop.collocated) {
    if (!shop.collocated->condense(
            d.pattern, d.nodes, d.settings.material,
            d.settings.periphery == HivePeriphery::kBoussinesq ? &shop.interior : nullptr,
            d.correction))
      return HiveVerdict::kFolded;
  } else if (!d.condense_to_surface()) {
    return HiveVerdict::kFolded;
  }
  // Equations of its own have one modulus, by which it may be taken out of them.
  if (!shop.spread && d.ground.wide != 1.0) d.correction /= d.ground.wide;
  if (!d.correction.allFinite()) return HiveVerdict::kNotFinite;
  d.is_built = true;
  return HiveVerdict::kSound;
}

HiveVerdict Hive::seat(std::span<const ContactCell> cells, const HoldBlend& hold) noexcept {
  Data& d = *data_;
  d.is_seated = false;
  if (!d.is_built) return HiveVerdict::kNotBuilt;
  if (cells.size() > static_cast<std::size_t>(d.pressed.most())) return HiveVerdict::kTooMany;
  for (const ContactCell& cell : cells) {
    if (!cell.position.allFinite() || !cell.normal.allFinite() || !cell.direction.allFinite() ||
        !(cell.area > 0.0) || !std::isfinite(cell.area) || !(cell.direction.squaredNorm() > 0.0))
      return HiveVerdict::kNotFinite;
    if ((cell.position - d.nodes.centre.position).norm() > d.usable ||
        facing(cell.normal.dot(d.nodes.centre.normal)) == 0.0)
      return HiveVerdict::kTooWide;
  }
  d.cells.assign(cells.begin(), cells.end());
  d.cell_forces.assign(cells.size(), 0.0);
  d.node_forces.setZero();
  d.hold = hold;
  if (d.pinned) {
    d.pinned->seat(cells, d.nodes, d.pattern.free_nodes(), d.correction);
    d.is_seated = true;
    return HiveVerdict::kSound;
  }
  d.places.clear();
  const int n = static_cast<int>(cells.size());
  d.images.leftCols(n).setZero();
  for (int k = 0; k < n; ++k) {
    const ContactCell& cell = cells[static_cast<std::size_t>(k)];
    const PatternPlace place = d.locate(cell.position);
    d.places.push_back(place);
    for (std::size_t a = 0; a < 3; ++a) {
      if (place.nodes[a] >= d.moved) continue;
      for (int c = 0; c < 3; ++c)
        d.images.col(k) +=
            (place.weights[a] * cell.direction[c]) * d.correction.col(3 * place.nodes[a] + c);
    }
  }
  for (int k = 0; k < n && !hold.none(); ++k) {
    const ContactCell& cell = cells[static_cast<std::size_t>(k)];
    d.held.col(k) = hold.share_at(cell.position, cell.direction);
    d.give.col(k) = hold.give_at(cell.position);
  }
  d.fill_compliance(true);
  bool positive = d.pressed.check();
  if (!positive && !hold.none()) {
    d.fill_compliance(false);
    positive = d.pressed.check();
  }
  if (!positive) return HiveVerdict::kNotPositive;
  d.figures.lifted = d.pressed.lifted();
  d.figures.smallest_pivot = d.pressed.smallest_pivot();
  d.is_seated = true;
  return HiveVerdict::kSound;
}

HiveForce Hive::press(std::span<const double> depths) noexcept {
  Data& d = *data_;
  HiveForce out;
  if (!d.is_seated) return out;
  if (depths.size() != d.cells.size()) {
    out.verdict = HiveVerdict::kTooMany;
    return out;
  }
  for (const double depth : depths) {
    if (std::isfinite(depth)) continue;
    out.verdict = HiveVerdict::kNotFinite;
    return out;
  }
  d.node_forces.setZero();
  std::fill(d.cell_forces.begin(), d.cell_forces.end(), 0.0);
  const auto add = [&](std::size_t cell, double amount) {
    const Vec3 on_tissue = amount * d.cells[cell].direction;
    d.cell_forces[cell] += amount;
    out.force -= on_tissue;
    out.moment -= (d.cells[cell].position - d.nodes.centre.position).cross(on_tissue);
    return on_tissue;
  };
  if (d.pinned) {
    if (!d.pinned->solve(depths)) {
      out.verdict = HiveVerdict::kNotPositive;
      return out;
    }
    for (std::size_t i = 0; i < d.pinned->nodes().size(); ++i) {
      const auto cell = static_cast<std::size_t>(d.pinned->cells()[i]);
      const double amount = d.pinned->forces()[i];
      d.node_forces.segment<3>(3 * d.pinned->nodes()[i]) += add(cell, amount);
      out.energy += 0.5 * amount * std::max(0.0, depths[cell]);
      out.touching += amount != 0.0;
    }
    out.verdict = HiveVerdict::kSound;
    return out;
  }
  const PressedCells::Figures figures = d.pressed.solve(depths);
  out.factorisations = figures.factorisations;
  if (!figures.converged) {
    out.verdict = HiveVerdict::kNotPositive;
    return out;
  }
  const std::span<const double> forces = d.pressed.forces();
  for (std::size_t k = 0; k < forces.size(); ++k) {
    if (forces[k] == 0.0) continue;
    const Vec3 on_tissue = add(k, forces[k]);
    for (std::size_t a = 0; a < 3; ++a)
      d.node_forces.segment<3>(3 * d.places[k].nodes[a]) += d.places[k].weights[a] * on_tissue;
  }
  out.energy = figures.energy;
  out.touching = figures.touching;
  out.verdict = HiveVerdict::kSound;
  return out;
}

void Hive::load(std::span<const double> forces) noexcept {
  Data& d = *data_;
  if (!d.is_seated || d.pinned || forces.size() != d.cells.size()) return;
  d.node_forces.setZero();
  for (std::size_t k = 0; k < forces.size(); ++k) {
    d.cell_forces[k] = forces[k];
    for (std::size_t a = 0; a < 3; ++a)
      d.node_forces.segment<3>(3 * d.places[k].nodes[a]) +=
          (d.places[k].weights[a] * forces[k]) * d.cells[k].direction;
  }
}

double Hive::relative_modulus() const noexcept {
  return data_->ground.tool;
}

std::span<const double> Hive::cell_forces() const noexcept {
  return data_->cell_forces;
}

Vec3 Hive::displacement(const SurfaceSpot& spot) const noexcept {
  const Data& d = *data_;
  Vec3 sum = Vec3::Zero();
  if (!d.is_seated) return sum;
  const std::span<const double> forces = d.cell_forces;
  for (std::size_t k = 0; k < forces.size() && !d.pinned; ++k) {
    if (forces[k] == 0.0) continue;
    const ContactCell& cell = d.cells[k];
    const double share = facing(cell.normal.dot(spot.normal));
    if (share == 0.0) continue;
    const Vec3 offset = spot.position - cell.position;
    const RadialKernels kernels =
        d.ground.answer(disc_to_point(offset.norm(), disc_radius(cell.area)), offset.norm(), 1.0);
    sum += d.half_space.displacement(kernels, offset, (cell.normal + spot.normal).normalized(),
                                     (share * forces[k]) * cell.direction);
  }
  return sum + corrected(spot.position, d.node_forces);
}

Vec3 Hive::corrected(const Vec3& place, const VectorX& node_loads) const noexcept {
  const Data& d = *data_;
  const PatternPlace at = d.locate(place);
  const auto forces_on = node_loads.head(3 * d.moved);
  Vec3 sum = Vec3::Zero();
  for (std::size_t a = 0; a < 3; ++a) {
    if (at.nodes[a] >= d.moved) continue;
    for (int c = 0; c < 3; ++c)
      sum[c] += at.weights[a] * d.correction.row(3 * at.nodes[a] + c).dot(forces_on);
  }
  return sum;
}

VectorX Hive::node_loads(std::span<const Vec3> places, std::span<const Vec3> forces) const {
  const Data& d = *data_;
  VectorX loads = VectorX::Zero(d.node_forces.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    const PatternPlace at = d.locate(places[k]);
    for (std::size_t a = 0; a < 3; ++a)
      loads.segment<3>(3 * at.nodes[a]) += at.weights[a] * forces[k];
  }
  return loads;
}

MatrixX Hive::correction(std::span<const Vec3> places) const {
  const Data& d = *data_;
  const auto n = static_cast<Eigen::Index>(places.size());
  std::vector<PatternPlace> at;
  for (const Vec3& place : places) at.push_back(d.locate(place));
  MatrixX weights = MatrixX::Zero(n, d.moved);
  for (Eigen::Index k = 0; k < n; ++k)
    for (std::size_t a = 0; a < 3; ++a) {
      const PatternPlace& one = at[static_cast<std::size_t>(k)];
      if (one.nodes[a] < d.moved) weights(k, one.nodes[a]) += one.weights[a];
    }
  MatrixX out(3 * n, 3 * n);
  for (Eigen::Index a = 0; a < 3; ++a)
    for (Eigen::Index b = 0; b < 3; ++b) {
      const MatrixX part = d.correction(Eigen::seqN(a, d.moved, 3), Eigen::seqN(b, d.moved, 3));
      out(Eigen::seqN(a, n, 3), Eigen::seqN(b, n, 3)) = weights * part * weights.transpose();
    }
  return 0.5 * (out + out.transpose());
}

double Hive::work_of_hold(const HoldBlend& before) const noexcept {
  Data& d = *data_;
  if (!d.is_seated || d.pinned || (before.none() && d.hold.none())) return 0.0;
  HoldBlend::Vector18 taken = HoldBlend::Vector18::Zero(), was = taken;
  const auto n = static_cast<Eigen::Index>(d.cells.size());
  for (Eigen::Index k = 0; k < n; ++k) {
    const double force = d.cell_forces[static_cast<std::size_t>(k)];
    if (force == 0.0) continue;
    const ContactCell& cell = d.cells[static_cast<std::size_t>(k)];
    if (d.hold.none())
      d.give.col(k) = d.hold.give_at(cell.position);
    else
      taken += force * d.held.col(k);
    was += force * before.share_at(cell.position, cell.direction);
  }
  double given = 0.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (d.cell_forces[i] == 0.0) continue;
    const Vec2 gave = before.give_at(d.cells[i].position);
    for (Eigen::Index l = 0; l <= k; ++l) {
      const auto j = static_cast<std::size_t>(l);
      if (d.cell_forces[j] == 0.0) continue;
      const double change =
          gave.dot(before.give_at(d.cells[j].position)) - d.give.col(k).dot(d.give.col(l));
      given += (l < k ? 2.0 : 1.0) * d.cell_forces[i] * d.cell_forces[j] * d.alone(k, l) * change;
    }
  }
  return 0.5 * (given + taken.dot(d.hold.signs().cwiseProduct(taken)) -
                was.dot(before.signs().cwiseProduct(was)));
}

/// Of forces f on cells with the compliance C that energy changes by -1/2 f^T dC f, as these move.
/// Not of what others hold and strain takes: that is smooth, and the hive's own compliance, from
/// which it is taken, changes as much from place to place.
Vec3 Hive::drawn_aside() const noexcept {
  const Data& d = *data_;
  Vec3 force = Vec3::Zero();
  if (!d.is_seated || d.pinned || d.hold.none()) return force;
  const auto n = static_cast<Eigen::Index>(d.cells.size());
  const double to = d.hold.share;
  for (const auto& [hold, share, row] :
       {std::tuple(&d.hold.from, 1.0 - to, 0), std::tuple(&d.hold.to, to, 1)}) {
    if (hold->none() || share == 0.0 || (hold->least == 0.0 && hold->most == 0.0)) continue;
    FootHold::Vector9 pushed = FootHold::Vector9::Zero();
    Vec3 near = Vec3::Zero();  // of the cells within reach: beyond it nothing changes
    Vec2 growth = Vec2::Zero();
    for (Eigen::Index k = 0; k < n; ++k) {
      const double amount = d.cell_forces[static_cast<std::size_t>(k)];
      if (amount == 0.0) continue;
      const ContactCell& cell = d.cells[static_cast<std::size_t>(k)];
      pushed += amount * hold->weights(cell.position, cell.direction);
      if (hold->is_within(cell.position)) near += amount * cell.direction;
      const Vec2 give_slopes = hold->give_slopes(cell.position);
      if (give_slopes.isZero(0.0)) continue;
      double moved = 0.0;
      for (Eigen::Index l = 0; l < n; ++l)
        moved += d.cell_forces[static_cast<std::size_t>(l)] * d.give(row, l) *
                 d.alone(std::max(k, l), std::min(k, l));
      growth += std::sqrt(share) * amount * moved * give_slopes;
    }
    const auto moved_by = hold->divided_times(pushed);
    growth -= share * Vec2(near.dot(moved_by.head<3>()), near.dot(moved_by.tail<3>()));
    force += growth.x() * hold->along_x + growth.y() * hold->along_y;
  }
  return force;
}

Eigen::Ref<const MatrixX> Hive::compliance() const noexcept {
  return data_->pressed.matrix();
}
const SurfaceSpot& Hive::centre() const noexcept {
  return data_->nodes.centre;
}
const HiveSettings& Hive::settings() const noexcept {
  return data_->settings;
}
double Hive::usable_radius() const noexcept {
  return data_->usable;
}
const HiveFigures& Hive::figures() const noexcept {
  return data_->figures;
}
std::span<const Vec3> Hive::nodes() const noexcept {
  return data_->nodes.positions;
}

Hive::State Hive::state() const {
  const Data& d = *data_;
  // What is left of an earlier seat means nothing: one that was restored hasn't got it.
  State state = idle_state();
  state.built = d.is_built;
  state.seated = d.is_seated;
  if (d.is_built) state.centre = d.nodes.centre.point;
  if (d.is_seated) {
    state.smallest_pivot = d.figures.smallest_pivot;
    state.lifted = d.figures.lifted;
    state.cells = d.cells;
    state.hold = d.hold;
    state.cell_forces = d.cell_forces;
    state.node_forces.assign(d.node_forces.begin(), d.node_forces.end());
    state.pressed = d.pressed.state();
  }
  return state;
}

Hive::State Hive::idle_state() const {
  State state;
  state.node_forces.assign(static_cast<std::size_t>(data_->node_forces.size()), 0.0);
  state.pressed.active = data_->pressed.state().active;
  return state;
}

void Hive::restore(const State& state) {
  Data& d = *data_;
  const SurfacePoint& there = d.nodes.centre.point;
  const bool stands = d.is_built && there.triangle == state.centre.triangle &&
                      there.weights == state.centre.weights;
  if (!state.built)
    d.is_built = false;
  else if (!stands)
    build({.point = state.centre});
  d.is_seated = false;
  if (state.seated) seat(state.cells, state.hold);
  d.pressed.restore(state.pressed);
  d.cell_forces.assign(state.cell_forces.begin(), state.cell_forces.end());
  std::copy(state.node_forces.begin(), state.node_forces.end(), d.node_forces.begin());
  d.figures.smallest_pivot = state.smallest_pivot;
  d.figures.lifted = state.lifted;
}

bool Hive::fits(const State& state) const noexcept {
  const Data& d = *data_;
  const std::size_t most = static_cast<std::size_t>(d.pressed.most());
  if (!d.body.surface->has(state.centre) || (state.built && state.centre.triangle < 0))
    return false;
  if (state.cells.size() > most || state.cell_forces.size() > most) return false;
  if (state.seated && (!state.built || state.cells.size() != state.cell_forces.size()))
    return false;
  if (state.node_forces.size() != static_cast<std::size_t>(d.node_forces.size())) return false;
  if (!state.hold.is_sound()) return false;
  if (!d.pressed.fits(state.pressed)) return false;
  // A factor is of the seated cells' matrix.
  if (!state.pressed.factored.empty() && (!state.seated || d.pinned)) return false;
  return !state.seated || d.pinned || state.pressed.active.size() == state.cells.size();
}

}  // namespace viscera
