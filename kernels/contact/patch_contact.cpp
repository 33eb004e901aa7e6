#include "kernels/contact/patch_contact.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "kernels/base/archive.h"
#include "kernels/base/parallel.h"
#include "kernels/base/wide.h"
#include "kernels/contact/column_sums.h"
#include "kernels/contact/deformation.h"
#include "kernels/contact/facing.h"
#include "kernels/contact/half_columns.h"
#include "kernels/contact/same_side.h"

namespace viscera {
namespace {

/// Weights of all cells are written in a common basis that misses none of them by more than this
/// share: cells of one tip differ little, so the basis is several times smaller than their number.
constexpr double kBasisTolerance = 5e-4;
/// More cells than a tool or two lay: those of organs that touch, which differ from each other. A
/// basis would be as large as their number.
constexpr std::size_t kMostOfTools = 96;
/// A patch that has not moved for this many solves is taken to stay; the columns of so many of its
/// cells are then put together in a call, each for about what the sum over all touched places
/// costs.
constexpr int kStaysAfter = 3;
constexpr std::size_t kCellsPerCall = 2;
/// The narrowest bell that spreads the load of a cell, over its disc's radius a: 3 pi^(3/2) / 32,
/// with which a half-space answers itself as softly as with the disc, 16 / (3 pi a) = sqrt(pi) / (2
/// sigma). A narrower one takes more off a cell's own response than a body that is stiffer there
/// than a half-space has given, and the response turns negative: seen where two nodes at random
/// stand so near each other that the spacing there is a third of a wide cell's radius.
constexpr double kNarrowestBell = 0.5220;

/// C += A B for A (m x m), B and C (m x columns), column-major: four columns of A at a time, read
/// once.
VISCERA_WIDE void add_product(const float* a, const float* b, float* c, Eigen::Index m,
                              Eigen::Index columns) {
  Eigen::Index j = 0;
  for (; j + 4 <= m; j += 4) {
    const float *p = a + j * m, *q = p + m, *r = q + m, *s = r + m;
    for (Eigen::Index k = 0; k < columns; ++k) {
      const float* f = b + k * m + j;
      const float fp = f[0], fq = f[1], fr = f[2], fs = f[3];
      float* __restrict sum = c + k * m;
#pragma GCC ivdep
      for (Eigen::Index i = 0; i < m; ++i) {
        sum[i] += (p[i] * fp + q[i] * fq) + (r[i] * fr + s[i] * fs);
      }
    }
  }
  for (; j < m; ++j) {
    const float* p = a + j * m;
    for (Eigen::Index k = 0; k < columns; ++k) {
      const float fp = b[k * m + j];
      float* __restrict sum = c + k * m;
#pragma GCC ivdep
      for (Eigen::Index i = 0; i < m; ++i) sum[i] += p[i] * fp;
    }
  }
}

}  // namespace

// Measured on a block of 40 x 40 x 24 mm bonded to its base, nu 0.45, spacings 2.5 / 3.5 / 4.5 / 6
// mm: a ball tip of 1 mm pressed 0.5 mm deep (37 cells) at 24 places along three spacings, mean
// force against that on a cloud graded to 0.35 mm, ripple (greatest less smallest force over the
// mean), and the mean force of a flat punch of 2.9 mm against the same.
//   factor   tip: error of the mean, %     ripple, %              punch: error, %
//   0.5      1.3 / 1.0 / 0.8 / 0.6         .47 / .30 / .16 / .14  -0.2 / -0.1 /  0.2 /  0.3
//   0.7      0.6 / 0.4 / 0.4 / 0.3         .21 / .08 / .06 / .04  -0.7 / -0.7 / -0.6 / -0.9
//   0.85     0.4 / 0.3 / 0.3 / 0.2         .07 / .05 / .07 / .05  -0.8 / -0.9 / -1.0 / -1.4
//   1.0      0.4 / 0.3 / 0.2 / 0.1         .06 / .03 / .07 / .07  -0.9 / -1.1 / -1.4 / -2.0
//   1.5      0.2 / 0.1 /-0.1 /-0.5         .06 / .06 / .09 / .12  -1.2 / -1.8 / -2.6 / -4.6
// Narrower, the nodes are felt; wider, the half-space is asked where the body isn't one any more,
// and the cost grows with the square.
double PatchContact::spread_factor() {
  return 0.85;
}

double PatchContact::narrowest_bell() {
  return kNarrowestBell;
}

PatchContact::PatchContact(const SurfaceCompliance& compliance, const TouchableSurface& surface,
                           const IsotropicMaterial& material)
    : TissueContact(compliance.symmetric),
      compliance_(compliance),
      surface_(surface),
      material_(material) {
  local_of_.assign(compliance.touchable.size(), -1);
}

void PatchContact::draw_on(const DrawnSurface& drawn, const HalfColumns* half) {
  drawn_ = &drawn;
  half_ = half;
}

TissueAbilities PatchContact::abilities() const {
  return {.springs = compliance_.symmetric, .shapes = true, .stiffens = compliance_.symmetric};
}

bool PatchContact::touchable(const Vec3& place) const {
  return is_touchable(surface_, place);
}

NearField PatchContact::any_near_field() const {
  return {material_, surface_.spacings.front()};
}

IsotropicMaterial PatchContact::material_of(double stiffness) const {
  return {stiffness * material_.youngs_modulus, material_.poisson_ratio};
}

/// Cells that stay: C S^T of them is known, so that what they share with other cells is a product
/// with the weights of these.
struct PatchContact::Anchors {
  std::vector<ContactCell> cells;
  std::vector<Place> places;
  std::vector<NearField> near_fields;
  std::vector<double> stiffness;
  std::vector<NearModulus> modulus;
  int beyond_touchable = 0;
  std::vector<int> touched;    // touchable places under them, ascending (m)
  MatrixX weights;             // S: anchors x m
  std::vector<float> columns;  // C S^T: rows x (3 anchors)
  MatrixX response;            // among each other
};

double PatchContact::bell_of(const Place& cell) {
  return cell.bell > 0.0f ? static_cast<double>(cell.bell) : spread_factor();
}

/// S: the share of each touched place in the load of each cell. Where a narrow bell holds no place
/// the usual one serves.
void PatchContact::spread_cells(std::span<const Place> cells) {
  near_fields_.clear();
  stiffness_.clear();
  modulus_.clear();
  beyond_touchable_ = 0;
  spread_.resize(std::max(spread_.size(), cells.size()));
  touched_.clear();
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const Place& cell = cells[k];
    const double h = spacing_at(surface_, cell.position),
                 narrowest = kNarrowestBell * std::sqrt(cell.area / std::numbers::pi);
    double sigma = std::max(bell_of(cell) * h, narrowest);
    bool found = spread_load(surface_, cell.position, cell.normal, sigma, spread_[k]);
    if (!found && cell.bell > 0.0f) {
      sigma = std::max(spread_factor() * h, narrowest);
      found = spread_load(surface_, cell.position, cell.normal, sigma, spread_[k]);
    }
    if (!found) ++beyond_touchable_;
    stiffness_.push_back(stiffness_about(cell.position, spread_[k]));
    double modulus = stiffness_.back();
    if (!surface_.modulus.empty()) {
      modulus_.push_back(
          near_modulus_at(surface_, cell.position, cell.normal, spread_factor(), sigma));
      modulus *= effective_modulus(material_, sigma, std::sqrt(cell.area / std::numbers::pi),
                                   modulus_.back());
    }
    near_fields_.emplace_back(material_of(modulus), sigma);
    if (found)
      near_fields_.back().set_place(surface_.places[static_cast<std::size_t>(
          std::ranges::max_element(spread_[k], {}, &LoadShare::share)->place)]);
    for (const LoadShare& share : spread_[k]) {
      int& local = local_of_[static_cast<std::size_t>(share.place)];
      if (local >= 0) continue;
      local = 0;
      touched_.push_back(share.place);
    }
  }
  std::sort(touched_.begin(), touched_.end());
  compliance_.need(touched_);
  for (std::size_t i = 0; i < touched_.size(); ++i) {
    local_of_[static_cast<std::size_t>(touched_[i])] = static_cast<int>(i);
  }
  weights_.setZero(static_cast<Eigen::Index>(cells.size()),
                   static_cast<Eigen::Index>(touched_.size()));
  for (std::size_t k = 0; k < cells.size(); ++k) {
    for (const LoadShare& share : spread_[k]) {
      weights_(static_cast<Eigen::Index>(k), local_of_[static_cast<std::size_t>(share.place)]) +=
          share.share;
    }
  }
  for (const int place : touched_) local_of_[static_cast<std::size_t>(place)] = -1;
}

/// Of the tissue about a cell, over that of the same tissue when it was sound: by a bell over the
/// places that carry its load.
double PatchContact::stiffness_about(const Vec3& position,
                                     const std::vector<LoadShare>& shares) const {
  if (!update_ || update_->stiffness.empty()) return 1.0;
  double sum = 0.0, whole = 0.0;
  for (const LoadShare& share : shares) {
    const auto place = static_cast<std::size_t>(share.place);
    const double distance =
        (surface_.positions[place] - position).norm() / (kFeltSpacings * surface_.spacings[place]);
    const double weight = std::exp(-0.5 * distance * distance);
    sum += weight * static_cast<double>(update_->stiffness[place]);
    whole += weight;
  }
  return whole > 0.0 ? sum / whole : 1.0;
}

void PatchContact::gather_compliance() {
  const bool changed = prepared_.gather(compliance_, touched_);
  if (!update_ || update_->rank == 0 ||
      !(changed || block_[0].rows() != static_cast<Eigen::Index>(touched_.size())))
    return;
  block_ = prepared_.parts();
  take_off_blocks();
}

const Eigen::MatrixXf& PatchContact::block(std::size_t part) const {
  return update_ && update_->rank > 0 ? block_[part] : prepared_.parts()[part];
}

/// V V^T among the touched places.
void PatchContact::take_off_blocks() {
  const auto m = static_cast<Eigen::Index>(touched_.size());
  const auto rank = static_cast<Eigen::Index>(update_->rank);
  const std::size_t height = 3 * surface_.size();
  for (std::size_t a = 0; a < 3; ++a) {
    modes_[a].resize(rank, m);
    for (Eigen::Index j = 0; j < m; ++j) {
      const std::size_t row =
          3 * static_cast<std::size_t>(touched_[static_cast<std::size_t>(j)]) + a;
      for (Eigen::Index k = 0; k < rank; ++k) {
        modes_[a](k, j) = update_->touchable[static_cast<std::size_t>(k) * height + row];
      }
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a; b < 3; ++b)
      block_[3 * a + b].noalias() -= modes_[a].transpose() * modes_[b];
  }
}

/// S = coefficients * basis by Gram and Schmidt, taking the worst represented cell first.
void PatchContact::compress_weights() {
  const Eigen::Index n = weights_.rows(), m = weights_.cols();
  spread_out_ = state_.shared || static_cast<std::size_t>(n) > kMostOfTools;
  if (spread_out_) {
    basis_ = weights_;
    coefficients_.setIdentity(n, n);
    return list_place_shares();
  }
  MatrixX rest = weights_;
  VectorX left = rest.rowwise().squaredNorm();
  const VectorX whole = left;
  const Eigen::Index most = std::min(n, m);
  basis_.resize(most, m);
  coefficients_.setZero(n, most);
  Eigen::Index rank = 0;
  for (; rank < most; ++rank) {
    Eigen::Index worst = 0;
    const double error = (left.array() / whole.array()).maxCoeff(&worst);
    if (rank > 0 && error < kBasisTolerance * kBasisTolerance) break;
    // Twice is enough: the second pass removes what round-off left of the earlier directions.
    VectorX direction = rest.row(worst).transpose();
    direction -= basis_.topRows(rank).transpose() * (basis_.topRows(rank) * direction);
    direction.normalize();
    basis_.row(rank) = direction.transpose();
    const VectorX amount = rest * direction;
    coefficients_.col(rank) = amount;
    rest.noalias() -= amount * direction.transpose();
    left = rest.rowwise().squaredNorm();
  }
  basis_.conservativeResize(rank, Eigen::NoChange);
  coefficients_.conservativeResize(Eigen::NoChange, rank);
}

void PatchContact::list_place_shares() {
  place_shares_.resize(static_cast<std::size_t>(weights_.rows()));
  for (Eigen::Index k = 0; k < weights_.rows(); ++k) {
    std::vector<PlaceShare>& shares = place_shares_[static_cast<std::size_t>(k)];
    shares.clear();
    for (Eigen::Index j = 0; j < weights_.cols(); ++j)
      if (weights_(k, j) != 0.0) shares.push_back({static_cast<int>(j), weights_(k, j)});
  }
}

/// S C S^T of one component of C, by the few places under each cell.
MatrixX PatchContact::coupled_apart(const Eigen::MatrixXf& block) const {
  const std::size_t n = place_shares_.size();
  MatrixX part(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  parallel_for_each_index(n, 8, [&](std::size_t l) {
    Eigen::VectorXf image = Eigen::VectorXf::Zero(block.rows());
    for (const PlaceShare& place : place_shares_[l])
      image += static_cast<float>(place.share) * block.col(place.touched);
    for (std::size_t k = 0; k < n; ++k) {
      double sum = 0.0;
      for (const PlaceShare& place : place_shares_[k])
        sum += place.share * static_cast<double>(image[place.touched]);
      part(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) = sum;
    }
  });
  return part;
}

/// The body's part of the cells' response: S C S^T.
void PatchContact::couple_cells() {
  const Eigen::MatrixXf basis = basis_.cast<float>();
  const Eigen::MatrixXf transposed = basis.transpose();
  Eigen::MatrixXf image;
  const Eigen::Index n = weights_.rows();
  response_.resize(3 * n, 3 * n);
  const auto component = [&](Eigen::Index a, Eigen::Index b) {
    return response_(Eigen::seqN(a, n, 3), Eigen::seqN(b, n, 3));
  };
  for (Eigen::Index a = 0; a < 3; ++a) {
    for (Eigen::Index b = compliance_.symmetric ? a : 0; b < 3; ++b) {
      const Eigen::MatrixXf& values = block(static_cast<std::size_t>(3 * a + b));
      MatrixX part;
      if (spread_out_) {
        part = coupled_apart(values);
      } else {
        image.setZero(values.rows(), transposed.cols());
        add_product(values.data(), transposed.data(), image.data(), values.rows(),
                    transposed.cols());
        const MatrixX small = (basis * image).cast<double>();
        part = coefficients_ * small * coefficients_.transpose();
      }
      component(a, b) = part;
      if (compliance_.symmetric && a != b) component(b, a) = part.transpose();
      // Products in single precision leave their mark; the mirror must be exact.
      if (compliance_.symmetric && a == b) component(a, a) = 0.5 * (part + part.transpose());
    }
  }
}

/// What is finer than places between two cells; nothing: air parts them, or they face away.
std::optional<Mat3> PatchContact::near_pair(std::size_t k, std::size_t l) const {
  const std::vector<Place>& cells = state_.places;
  if (facing(cells[k].normal.dot(cells[l].normal)) == 0.0 || !see_each_other(k, l))
    return std::nullopt;
  return near_between(k, l);
}

/// Of all pairs of which one moves, where cells are many; else empty. What was found for cells that
/// are where they were is kept.
const std::vector<std::optional<Mat3>>& PatchContact::near_pairs(std::size_t moving) {
  if (!spread_out_) {
    near_known_ = {};
    return near_known_.pairs;
  }
  const std::vector<Place>& cells = state_.places;
  std::vector<int> before(cells.size(), -1);
  for (std::size_t k = 0, next = 0; k < cells.size(); ++k) {
    // Those that stay mostly stand in the same order.
    const std::vector<Place>& known = near_known_.places;
    for (std::size_t tried = 0; tried < known.size(); ++tried) {
      const std::size_t at = (next + tried) % known.size();
      if (!(known[at] == cells[k])) continue;
      before[k] = static_cast<int>(at);
      next = at + 1;
      break;
    }
  }
  const auto at = [](std::size_t k, std::size_t l) { return k * (k + 1) / 2 + l; };
  NearPairs found;
  found.places = cells;
  found.pairs.resize(at(cells.size(), 0));
  found.anchored = anchored_;
  const bool anchored = anchored_ == near_known_.anchored;
  parallel_for_each_index(cells.size(), 4, [&](std::size_t k) {
    for (std::size_t l = 0; l < std::min(k + 1, moving); ++l) {
      const bool kept = anchored && before[k] >= 0 && before[l] >= 0 && before[l] <= before[k];
      found.pairs[at(k, l)] = kept ? near_known_.pairs[at(static_cast<std::size_t>(before[k]),
                                                          static_cast<std::size_t>(before[l]))]
                                   : near_pair(k, l);
    }
  });
  near_known_ = std::move(found);
  return near_known_.pairs;
}

/// Adds the near field, about the mean of both normals, so that it stays reciprocal; that among the
/// anchors they have in them.
void PatchContact::couple_nearby() {
  const std::vector<Place>& cells = state_.places;
  const std::size_t moving = moving_cells();
  sound_near_.assign(update_ ? moving * (moving + 1) / 2 : 0, Mat3::Zero());
  const std::vector<std::optional<Mat3>>& pairs = near_pairs(moving);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    for (std::size_t l = 0; l < std::min(k + 1, moving); ++l) {
      const double faces = facing(cells[k].normal.dot(cells[l].normal));
      if (faces == 0.0) continue;
      const std::optional<Mat3> found =
          pairs.empty() ? near_pair(k, l) : pairs[k * (k + 1) / 2 + l];
      if (!found) continue;
      // The tissue about each counts by its root, so that the whole stays positive.
      const double share = faces / std::sqrt(stiffness_[k] * stiffness_[l]);
      const Mat3& near = *found;
      if (update_ && k < moving) sound_near_[k * (k + 1) / 2 + l] = faces * near;
      const Mat3 response = share * near;
      const auto row = static_cast<Eigen::Index>(3 * k), column = static_cast<Eigen::Index>(3 * l);
      response_.block<3, 3>(row, column) += response;
      if (k != l) response_.block<3, 3>(column, row) += response.transpose();
    }
  }
}

/// S V V^T S^T of these cells, and what their near field lost as the tissue about them stiffened.
MatrixX PatchContact::taken_by_update(std::size_t begin, std::size_t end) const {
  if (!update_ || end > moving_cells() || weights_.rows() < static_cast<Eigen::Index>(end))
    return {};
  const auto first = static_cast<Eigen::Index>(begin), m = static_cast<Eigen::Index>(end) - first;
  MatrixX taken = MatrixX::Zero(3 * m, 3 * m);
  if (update_->rank > 0) {
    MatrixX modes(3 * m, static_cast<Eigen::Index>(update_->rank));
    for (Eigen::Index a = 0; a < 3; ++a)
      modes(Eigen::seqN(a, m, 3), Eigen::all) =
          weights_.middleRows(first, m) *
          modes_[static_cast<std::size_t>(a)].transpose().cast<double>();
    taken.noalias() = modes * modes.transpose();
  }
  for (Eigen::Index k = 0; k < m; ++k)
    for (Eigen::Index l = 0; l <= k; ++l) {
      const auto i = static_cast<std::size_t>(first + k), j = static_cast<std::size_t>(first + l);
      const double lost = 1.0 - 1.0 / std::sqrt(stiffness_[i] * stiffness_[j]);
      if (lost == 0.0) continue;
      const Mat3 block = lost * sound_near_[i * (i + 1) / 2 + j];
      taken.block<3, 3>(3 * k, 3 * l) += block;
      if (k != l) taken.block<3, 3>(3 * l, 3 * k) += block.transpose();
    }
  return taken;
}

std::span<const double> PatchContact::moduli_by_update() const {
  if (!update_) return {};
  return stiffness_;
}

/// Where a wide cell, or one whose narrow bell held no place, has a wider bell than its own, the
/// way is asked deeper.
bool PatchContact::see_each_other(std::size_t k, std::size_t l) const {
  const Place &one = state_.places[k], &other = state_.places[l];
  const double h = near_fields_[k].sigma() / bell_of(one);
  return k == l || same_side(surface_.paths.get(), kSideDepth * h, one.position, one.normal,
                             other.position, other.normal);
}

/// Of sound tissue, between two cells that face the same way.
Mat3 PatchContact::near_between(std::size_t k, std::size_t l) const {
  const Place &one = state_.places[k], &other = state_.places[l];
  // Spread by two Gaussians: their variances add.
  const double a = near_fields_[k].sigma(), b = near_fields_[l].sigma();
  const double sigma = std::sqrt(0.5 * (a * a + b * b)), area = 0.5 * (one.area + other.area);
  const Vec3 offset = one.position - other.position;
  const Vec3 normal = (one.normal + other.normal).normalized();
  if (!modulus_.empty())
    return near_response(material_, sigma, offset, normal, area, modulus_[k], modulus_[l]);
  return NearField(material_, sigma).cell_response(offset, normal, area);
}

/// The rows and columns of the anchors: S_k (C S^T) with the other cells, and their own.
void PatchContact::couple_anchors() {
  const Anchors& anchors = *anchors_;
  const auto n = weights_.rows(), m = weights_.cols();
  const auto own = static_cast<Eigen::Index>(3 * anchors.places.size());
  const std::size_t rows = compliance_.rows();
  MatrixX whole(3 * n + own, 3 * n + own);
  whole.topLeftCorner(3 * n, 3 * n) = response_;
  whole.bottomRightCorner(own, own) = anchors.response;
  MatrixX moved(m, own);  // one component of the touched places per force on each anchor
  for (Eigen::Index component = 0; component < 3; ++component) {
    for (Eigen::Index c = 0; c < own; ++c) {
      const float* column = anchors.columns.data() + static_cast<std::size_t>(c) * rows + component;
      for (Eigen::Index j = 0; j < m; ++j) {
        const int place = touched_[static_cast<std::size_t>(j)];
        moved(j, c) = column[3 * compliance_.touchable[static_cast<std::size_t>(place)]];
      }
    }
    whole(Eigen::seqN(component, n, 3), Eigen::lastN(own)) = coefficients_ * (basis_ * moved);
  }
  whole.bottomLeftCorner(own, 3 * n) = whole.topRightCorner(3 * n, own).transpose();
  response_ = std::move(whole);
  near_fields_.insert(near_fields_.end(), anchors.near_fields.begin(), anchors.near_fields.end());
  stiffness_.insert(stiffness_.end(), anchors.stiffness.begin(), anchors.stiffness.end());
  modulus_.insert(modulus_.end(), anchors.modulus.begin(), anchors.modulus.end());
  beyond_touchable_ += anchors.beyond_touchable;
  couple_nearby();
}

bool PatchContact::ends_in_anchors(std::span<const Place> places) const {
  return anchors_ && places.size() >= anchors_->places.size() &&
         std::equal(anchors_->places.rbegin(), anchors_->places.rend(), places.rbegin());
}

std::size_t PatchContact::moving_cells() const {
  return state_.places.size() - (anchored_ ? anchors_->places.size() : 0);
}

std::vector<Vec3> PatchContact::beside_places(std::size_t begin, std::size_t end) const {
  if (end > std::min(moving_cells(), spread_.size())) return {};
  std::vector<Vec3> beside;
  for (std::size_t k = begin; k < end; ++k) {
    Vec3 mean = Vec3::Zero();
    for (const LoadShare& share : spread_[k])
      mean += share.share * surface_.positions[static_cast<std::size_t>(share.place)];
    beside.push_back(state_.places[k].position - mean);
  }
  return beside;
}

void PatchContact::couple_places() {
  anchored_ = ends_in_anchors(state_.places);
  spread_cells(std::span(state_.places).first(moving_cells()));
  gather_compliance();
  compress_weights();
  couple_cells();
}

void PatchContact::make_response() {
  couple_places();
  if (anchored_)
    couple_anchors();
  else
    couple_nearby();
}

void PatchContact::places_changed() {
  columns_made_ = 0;
}

void PatchContact::drop_response() {
  // Assigning {} would keep a vector's memory.
  const auto drop = [](auto&... vectors) {
    (std::remove_reference_t<decltype(vectors)>().swap(vectors), ...);
  };
  drop(stiffness_, modulus_, touched_, spread_, cell_columns_, sound_near_, place_shares_,
       near_known_.places, near_known_.pairs);
  prepared_ = {};
  columns_made_ = 0;
  weights_ = basis_ = coefficients_ = MatrixX();
  block_.fill(Eigen::MatrixXf());
  modes_.fill(Eigen::MatrixXf());
  anchored_ = ends_in_anchors(state_.places);
}

void PatchContact::spread_forces(std::span<const Vec3> forces, ContactResponse& response) {
  const auto spread = [](std::span<const Vec3> by, const MatrixX& weights,
                         const std::vector<int>& touched) {
    ContactResponse one{touched, std::vector<Vec3>(touched.size(), Vec3::Zero())};
    if (!touched.empty())
      Eigen::Map<Eigen::Matrix3Xd>(one.loads.front().data(), 3, weights.cols()).noalias() =
          Eigen::Map<const Eigen::Matrix3Xd>(by.front().data(), 3, weights.rows()) * weights;
    return one;
  };
  state_.response = spread(forces.first(moving_cells()), weights_, touched_);
  response = anchored_ ? merged(state_.response, spread(forces.subspan(moving_cells()),
                                                        anchors_->weights, anchors_->touched))
                       : state_.response;
}

void PatchContact::anchor(std::span<const ContactCell> cells) {
  anchors_.reset();
  state_.places.clear();
  // Where forces and displacements can't change places, the shortcut would need the rows, too.
  if (!compliance_.symmetric || cells.empty()) return;
  see_places(cells, true);
  auto anchors = std::make_shared<Anchors>();
  anchors->cells.assign(cells.begin(), cells.end());
  anchors->stiffness = stiffness_;
  anchors->modulus = modulus_;
  anchors->places = state_.places;
  anchors->near_fields = near_fields_;
  anchors->beyond_touchable = beyond_touchable_;
  anchors->touched = touched_;
  anchors->weights = coefficients_ * basis_;  // as the response has them
  anchors->response = response_;
  const std::size_t rows = compliance_.rows();
  anchors->columns.resize(3 * rows * cells.size());
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const VectorX weights = anchors->weights.row(static_cast<Eigen::Index>(k)).transpose();
    sum_weighted_triples({compliance_.columns.data(), rows, rows}, touched_,
                         {weights.data(), touched_.size()}, anchors->columns.data() + 3 * rows * k);
    take_off_columns({weights.data(), touched_.size()}, anchors->columns.data() + 3 * rows * k);
  }
  anchors_ = std::move(anchors);
  state_.places.clear();
}

bool PatchContact::fits(const State& state) const {
  return is_sound(state, compliance_.touchable.size(),
                  ends_in_anchors(state.places) ? anchors_->places.size() : 0);
}

std::size_t PatchContact::memory_bytes() const {
  const auto of = [](const auto& values) { return values.capacity() * sizeof(values[0]); };
  const auto of_matrix = [](const auto& matrix) {
    return static_cast<std::size_t>(matrix.size()) * sizeof(*matrix.data());
  };
  std::size_t bytes = conditions_memory_bytes() + of(stiffness_) + of(modulus_) + of(touched_) +
                      prepared_.memory_bytes() + of(local_of_) + of(spread_) + of(cell_columns_) +
                      of(sound_near_);
  for (const auto& shares : spread_) bytes += of(shares);
  for (const MatrixX* matrix : {&weights_, &basis_, &coefficients_}) bytes += of_matrix(*matrix);
  for (const Eigen::MatrixXf& block : block_) bytes += of_matrix(block);
  for (const auto& shares : place_shares_) bytes += of(shares);
  bytes += of(place_shares_) + of(near_known_.places) + of(near_known_.pairs);
  for (const Eigen::MatrixXf& modes : modes_) bytes += of_matrix(modes);
  if (anchors_)
    bytes += of(anchors_->cells) + of(anchors_->places) + of(anchors_->columns) +
             of_matrix(anchors_->weights) + of_matrix(anchors_->response);
  return bytes;
}

void PatchContact::stiffen(std::shared_ptr<const StiffnessUpdate> update) {
  if (!compliance_.symmetric) return;
  update_ = std::move(update);
  // All that was put together of the compliance until now is of another body.
  block_.fill(Eigen::MatrixXf());
  forget_conditions();
  if (const auto anchors = anchors_) anchor(anchors->cells);
}

/// V V^T S^T for the loads of one cell: three columns, as many rows as the compliance has.
void PatchContact::take_off_columns(std::span<const double> weights, float* columns) const {
  if (!update_ || update_->rank == 0) return;
  const std::size_t rows = compliance_.rows();
  std::vector<Vec3> loads(weights.size());
  for (int a = 0; a < 3; ++a) {
    for (std::size_t j = 0; j < weights.size(); ++j) loads[j] = weights[j] * Vec3::Unit(a);
    subtract_update(*update_, touched_, loads,
                    {columns + static_cast<std::size_t>(a) * rows, rows});
  }
}

/// Columns of C S^T, what one cell does to every place: those that count as built and aren't here.
void PatchContact::make_columns() {
  const std::size_t rows = compliance_.rows();
  if (columns_made_ == 0) cell_columns_.resize(3 * rows * moving_cells());
  for (; columns_made_ < state_.columns_built; ++columns_made_) {
    const VectorX weights = weights_.row(static_cast<Eigen::Index>(columns_made_)).transpose();
    sum_weighted_triples({compliance_.columns.data(), rows, rows}, touched_,
                         {weights.data(), touched_.size()},
                         cell_columns_.data() + 3 * rows * columns_made_);
    take_off_columns({weights.data(), touched_.size()},
                     cell_columns_.data() + 3 * rows * columns_made_);
  }
}

void PatchContact::place_displacements(std::vector<float>& displacements) {
  state_.counted = false;
  if (!state_.places.empty()) ensure_response();
  const std::size_t rows = compliance_.rows(), moving = moving_cells();
  /// Columns times the forces on these cells, one triple a cell.
  const auto sum_cells = [&](const std::vector<float>& columns, std::span<const Vec3> forces,
                             std::vector<float>& sums) {
    std::vector<int> triples;
    std::vector<Vec3> loads;
    for (std::size_t k = 0; k < forces.size(); ++k) {
      if (forces[k].isZero(0.0)) continue;
      triples.push_back(static_cast<int>(k));
      loads.push_back(forces[k]);
    }
    sum_column_triples({columns.data(), rows, rows}, triples, loads, sums);
  };
  const bool worth_it = moving < touched_.size();
  if (worth_it && state_.stayed >= kStaysAfter)
    state_.columns_built = std::min(state_.columns_built + kCellsPerCall, moving);
  if (state_.columns_built > 0) make_columns();
  if (state_.forces.empty() || state_.columns_built < moving || moving == 0) {
    compliance_.need(state_.response.touched);  // a state may come from another process
    sum_column_triples({compliance_.columns.data(), rows, rows}, state_.response.touched,
                       state_.response.loads, displacements);
    if (update_) {
      subtract_update(*update_, state_.response.touched, state_.response.loads, displacements);
    }
  } else {
    sum_cells(cell_columns_, std::span(state_.forces).first(moving), displacements);
  }
  if (!anchored_ || state_.forces.empty()) return;
  std::vector<float> more;
  sum_cells(anchors_->columns, std::span(state_.forces).subspan(moving), more);
  for (std::size_t i = 0; i < displacements.size(); ++i) displacements[i] += more[i];
}

void PatchContact::place_displacements(const ContactResponse& response,
                                       std::vector<float>& displacements) {
  if (!half_) return place_displacements(displacements);
  viscera::place_displacements(*half_, response, displacements);
  if (update_) subtract_update(*update_, response.touched, response.loads, displacements);
}

void PatchContact::draw(std::span<const float> displacements, std::span<const ContactCell> cells,
                        const ContactSolution& solution, std::vector<Vec3f>& positions) const {
  deformed_positions(*drawn_, displacements, solution.near_fields, cells, solution.forces,
                     positions);
}

}  // namespace viscera
