#include "engine/gpu/gpu_finite.h"

#include <epoxy/gl.h>

#include <Eigen/Core>
#include <array>
#include <cstring>

#include "engine/gpu/kernels.h"

namespace viscera {
namespace {

constexpr int kMostBuffers = 12;    // that a kernel binds
constexpr std::size_t kEights = 8;  // entries of the inverse that lie in one word of four

using Entry = std::array<std::uint32_t, 2>;  // entry, pack

/// Of each node the entries that reach it, and their packs.
void list_entries(const FiniteLayout& flat, std::vector<std::uint32_t>& begin,
                  std::vector<Entry>& entries) {
  begin.assign(flat.nodes + 1, 0);
  for (const std::uint32_t node : flat.entry_nodes) ++begin[node + 1];
  for (std::size_t n = 0; n < flat.nodes; ++n) begin[n + 1] += begin[n];
  entries.resize(flat.entry_nodes.size());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t p = 0; p + 1 < flat.pack_begin.size(); ++p)
    for (std::uint32_t e = flat.pack_begin[p]; e < flat.pack_begin[p + 1]; ++e)
      entries[next[flat.entry_nodes[e]]++] = {e, static_cast<std::uint32_t>(p)};
}

Result<void> device_error(const char* what) {
  if (const GLenum error = glGetError(); error != GL_NO_ERROR)
    return failure(std::string(what) + ": GL error " + std::to_string(error));
  return {};
}

}  // namespace

Result<std::unique_ptr<GpuFiniteBody>> GpuFiniteBody::create(const FiniteBody& body,
                                                             GpuLimits limits) {
  const FiniteLayout flat = body.layout();
  if (flat.fibres) return failure("a body with fibres stays on the CPU");
  if (flat.was_loaded) return failure("a body that was imaged under its weight stays on the CPU");
  if (auto able = check_bindings("a body at finite strain on the GPU", kMostBuffers); !able)
    return std::unexpected(able.error());
  std::unique_ptr<GpuFiniteBody> made(new GpuFiniteBody(limits));
  KernelLoader kernels;
  kernels.load(made->cells_kernel_, "finite_energy.comp", "CELLS");
  kernels.load(made->nodes_kernel_, "finite_energy.comp", "NODES");
  if (auto loaded = kernels.result(); !loaded) return std::unexpected(loaded.error());
  while (glGetError() != GL_NO_ERROR) {
  }
  const std::size_t packs = flat.pack_begin.size() - 1;
  made->nodes_ = flat.nodes;
  made->cells_ = flat.cell_origin.size();
  made->parameters_ = {.mu = flat.mu,
                       .lambda = flat.lambda,
                       .averaged = flat.averaged,
                       .averages = flat.psi.empty() ? 0u : 1u};
  std::size_t largest = 0;
  const auto keep = [&](Buffer& buffer, std::size_t bytes) {
    bytes = std::max<std::size_t>(bytes, 16);  // a buffer without a byte can't be bound
    buffer.allocate(bytes);
    made->bytes_ += bytes;
    largest = std::max(largest, bytes);
  };
  const auto fill = [&]<class T>(Buffer& buffer, const std::vector<T>& values) {
    keep(buffer, values.size() * sizeof(T));
    buffer.upload_part(0, std::span<const T>(values));
  };
  std::vector<std::uint32_t> node_begin;
  std::vector<Entry> node_entries;
  list_entries(flat, node_begin, node_entries);
  fill(made->cell_begin_, flat.cell_begin);
  fill(made->cell_origin_, flat.cell_origin);
  fill(made->pack_begin_, flat.pack_begin);
  fill(made->entry_nodes_, flat.entry_nodes);
  fill(made->gradients_, flat.gradients);
  fill(made->weights_, flat.weights);
  fill(made->psi_, flat.psi);
  fill(made->node_begin_, node_begin);
  fill(made->node_entries_, node_entries);
  keep(made->stress_, 36 * packs * sizeof(double));
  keep(made->energies_, made->cells_ * sizeof(double));
  keep(made->forces_, 3 * made->nodes_ * sizeof(double));
  if (largest > limits.block_bytes)
    return failure("a body at finite strain: a buffer of " + std::to_string(largest) +
                   " bytes, this device binds at most " + std::to_string(limits.block_bytes));
  made->read_back_ = std::make_unique<ReadBack>(made->energies_.size() + made->forces_.size());
  made->set({}, {});
  if (auto well = device_error("a body at finite strain"); !well)
    return std::unexpected(well.error());
  if (made->read_back_->data() == nullptr) return failure("the device gives nothing back");
  return made;
}

void GpuFiniteBody::set(const ChangedTissue& changed, const Viscosity& viscosity) {
  const std::array<double, 2> none{};
  parameters_.changed = changed.packs.empty() ? 0u : 1u;
  parameters_.viscous = viscosity.over_step * parameters_.mu;
  if (changed.packs.empty())
    change_.upload(std::span<const double>(none));
  else
    change_.upload(std::span<const ChangedTissue::Pack>(changed.packs));
  before_.upload(viscosity.before.empty() ? std::span<const double>(none) : viscosity.before);
  pass_.upload(std::span<const FiniteEnergyParameters>(&parameters_, 1));
}

Result<double> GpuFiniteBody::energy(std::span<const double> displacements,
                                     std::span<double> gradient) {
  displacements_.upload(displacements);
  mark("upload");
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, pass_.id());
  queue_.dispatch(cells_kernel_, cells_,
                  {{0, &cell_begin_},
                   {1, &cell_origin_},
                   {2, &pack_begin_},
                   {3, &entry_nodes_},
                   {4, &gradients_},
                   {5, &weights_},
                   {6, &psi_},
                   {7, &change_},
                   {8, &before_},
                   {9, &displacements_}},
                  {{10, &stress_}, {11, &energies_}});
  mark("cells");
  if (!gradient.empty())
    queue_.dispatch(nodes_kernel_, nodes_,
                    {{0, &node_begin_}, {1, &node_entries_}, {2, &gradients_}, {3, &stress_}},
                    {{4, &forces_}});
  mark("nodes");
  queue_.make_readable();
  read_back_->start(energies_, 0, cells_ * sizeof(double), 0);
  const std::size_t at = energies_.size();
  if (!gradient.empty()) read_back_->start(forces_, 0, gradient.size_bytes(), at);
  mark("read back");
  read_back_->submit();
  if (!read_back_->wait()) return failure("a body at finite strain: the device didn't answer");
  const auto* values = static_cast<const std::byte*>(read_back_->data());
  const auto number = [&](std::size_t offset, std::size_t i) {
    double value = 0.0;
    std::memcpy(&value, values + offset + i * sizeof value, sizeof value);
    return value;
  };
  double sum = 0.0;
  for (std::size_t c = 0; c < cells_; ++c) sum += number(0, c);
  for (std::size_t i = 0; i < gradient.size(); ++i) gradient[i] += number(at, i);
  return sum;
}

Result<std::unique_ptr<GpuInverse>> GpuInverse::create(std::span<const float> columns,
                                                       std::size_t n, GpuLimits limits) {
  std::unique_ptr<GpuInverse> made(new GpuInverse(limits));
  KernelLoader kernels;
  kernels.load(made->kernel_, "dense_inverse.comp");
  if (auto loaded = kernels.result(); !loaded) return std::unexpected(loaded.error());
  while (glGetError() != GL_NO_ERROR) {
  }
  made->size_ = n;
  made->padded_ = (n + kEights - 1) / kEights * kEights;
  const std::size_t rows = (n + kRowsAtOnce - 1) / kRowsAtOnce * kRowsAtOnce;
  if (const std::size_t bytes = 2 * rows * made->padded_; bytes > limits.block_bytes)
    return failure("a dense inverse of " + std::to_string(bytes) +
                   " bytes, this device binds at most " + std::to_string(limits.block_bytes));
  std::vector<Eigen::half> half(rows * made->padded_, Eigen::half(0.0f));
  for (std::size_t row = 0; row < n; ++row)
    for (std::size_t c = 0; c < n; ++c)
      half[row * made->padded_ + c] = Eigen::half(columns[row * n + c]);
  made->matrix_.allocate(half.size() * sizeof half[0]);
  made->matrix_.upload_part_bytes(0, half.data(), half.size() * sizeof half[0]);
  made->product_.allocate(rows * sizeof(float));
  made->read_back_ = std::make_unique<ReadBack>(made->product_.size());
  if (auto well = device_error("a dense inverse"); !well) return std::unexpected(well.error());
  if (made->read_back_->data() == nullptr) return failure("the device gives nothing back");
  return made;
}

Result<void> GpuInverse::apply(std::span<const double> x, std::span<double> y) {
  std::vector<float> single(padded_, 0.0f);
  for (std::size_t i = 0; i < size_; ++i) single[i] = static_cast<float>(x[i]);
  vector_.upload(std::span<const float>(single));
  kernel_.set("eights", static_cast<int>(padded_ / kEights));
  queue_.dispatch(kernel_, (size_ + kRowsAtOnce - 1) / kRowsAtOnce, {{0, &matrix_}, {1, &vector_}},
                  {{2, &product_}});
  queue_.make_readable();
  read_back_->start(product_, 0, size_ * sizeof(float), 0);
  read_back_->submit();
  if (!read_back_->wait()) return failure("a dense inverse: the device didn't answer");
  std::memcpy(single.data(), read_back_->data(), size_ * sizeof(float));
  for (std::size_t i = 0; i < size_; ++i) y[i] = static_cast<double>(single[i]);
  return {};
}

}  // namespace viscera
