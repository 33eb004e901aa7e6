#include "kernels/paff/mumps_factor.h"

#include <dmumps_c.h>

#include <algorithm>
#include <limits>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

#include "kernels/paff/blas.h"

namespace viscera {
namespace {

constexpr int kUseCommWorld = -987654;
enum Job { kInitialise = -1, kEnd = -2, kSolve = 3, kAnalyse = 1, kFactor = 2 };

std::mutex& mumps_lock() {
  static std::mutex lock;
  return lock;
}

std::string explain(const DMUMPS_STRUC_C& mumps, std::string_view what) {
  std::ostringstream text;
  text << what << ": ";
  switch (mumps.infog[0]) {
    case -5:
    case -7:
    case -13:
      text << "out of memory in the factorisation (" << mumps.infog[1]
           << " entries wanted); use a larger node spacing";
      break;
    case -6:
    case -10:
    case -40:
      text << "the matrix is singular or not positive definite; expected a body held firmly and "
              "nodes all over it";
      break;
    case -8:
    case -9:
      text << "the factorisation needs more work space than was granted three times over; use a "
              "larger node spacing";
      break;
    default:
      text << "MUMPS failed with INFOG(1) = " << mumps.infog[0]
           << ", INFOG(2) = " << mumps.infog[1];
  }
  return text.str();
}

}  // namespace

struct MumpsFactor::Instance {
  DMUMPS_STRUC_C mumps{};
  std::string what;

  explicit Instance(MatrixKind kind) {
    mumps.comm_fortran = kUseCommWorld;
    mumps.par = 1;
    mumps.sym = kind == MatrixKind::kPositiveDefinite ? 1 : 0;
    call(kInitialise);
    for (const int output : {1, 2, 3}) icntl(output) = 0;
    icntl(4) = 0;
  }
  ~Instance() { call(kEnd); }
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  int& icntl(int number) { return mumps.icntl[number - 1]; }
  int infog(int number) const { return mumps.infog[number - 1]; }

  void call(Job job) {
    const std::lock_guard guard(mumps_lock());
    prepare_blas();
    mumps.job = job;
    dmumps_c(&mumps);
  }
};

MumpsFactor::MumpsFactor(std::unique_ptr<Instance> instance) : instance_(std::move(instance)) {}
MumpsFactor::~MumpsFactor() = default;
MumpsFactor::MumpsFactor(MumpsFactor&&) noexcept = default;
MumpsFactor& MumpsFactor::operator=(MumpsFactor&&) noexcept = default;

Result<MumpsFactor> MumpsFactor::factor(const CoordinateMatrix& matrix, MatrixKind kind, int block,
                                        std::string_view what) {
  auto instance = std::make_unique<Instance>(kind);
  instance->what = what;
  DMUMPS_STRUC_C& mumps = instance->mumps;
  if (instance->infog(1) < 0) return failure(explain(mumps, what));
  mumps.n = matrix.order;
  mumps.nnz = static_cast<MUMPS_INT8>(matrix.values.size());
  // MUMPS reads the matrix in analysis and factorisation only.
  mumps.irn = const_cast<int*>(matrix.rows.data());
  mumps.jcn = const_cast<int*>(matrix.columns.data());
  mumps.a = const_cast<double*>(matrix.values.data());
  // PORD, MUMPS's own nested dissection: as little fill as SCOTCH on these graphs, in half the
  // time, and the same at every run, which the threads of SCOTCH 7 are not. A scalar matrix has a
  // twenty-seventh of the work of an elastic one on the same nodes: there minimum degree is
  // quicker. So it is where nearly all nodes meet: PORD finds nothing to dissect there, and on some
  // of these graphs it ends the program ("no valid number of stages in multisector").
  constexpr int kMinimumDegree = 0, kPord = 4;
  constexpr double kDense = 0.15;  // stored entries over the square of the order
  const bool dense = static_cast<double>(matrix.values.size()) >
                     kDense * static_cast<double>(matrix.order) * matrix.order;
  instance->icntl(7) = block == 1 || dense ? kMinimumDegree : kPord;
  if (block > 1) instance->icntl(15) = -block;  // order the graph of nodes, not unknowns
  instance->icntl(14) = 30;
  // Rows of a collocation matrix are scaled by their own kind; an unsymmetric permutation to a
  // large diagonal would undo the order of the nodes.
  if (kind == MatrixKind::kUnsymmetric) instance->icntl(6) = 0;
  instance->call(kAnalyse);
  if (instance->infog(1) < 0) return failure(explain(mumps, what));
  for (int attempt = 0; attempt < 3; ++attempt) {
    instance->call(kFactor);
    const bool short_of_space = instance->infog(1) == -8 || instance->infog(1) == -9;
    if (!short_of_space) break;
    instance->icntl(14) *= 3;
  }
  mumps.irn = mumps.jcn = nullptr;
  mumps.a = nullptr;
  if (instance->infog(1) < 0) return failure(explain(mumps, what));
  if (kind == MatrixKind::kPositiveDefinite && instance->infog(12) > 0) {
    std::ostringstream message;
    message << what << ": the matrix is not positive definite (" << instance->infog(12)
            << " negative pivots of " << matrix.order << "); expected none";
    return failure(message.str());
  }
  return MumpsFactor(std::move(instance));
}

Result<void> MumpsFactor::solve(std::span<double> right_hand_sides, int columns) {
  DMUMPS_STRUC_C& mumps = instance_->mumps;
  if (columns < 0 || right_hand_sides.size() != order() * static_cast<std::size_t>(columns)) {
    return failure(instance_->what + ": " + std::to_string(right_hand_sides.size()) +
                   " numbers given for " + std::to_string(columns) +
                   " right-hand sides; expected " + std::to_string(order()) + " each");
  }
  if (columns == 0) return {};
  instance_->icntl(20) = 0;
  instance_->icntl(27) = columns;
  mumps.rhs = right_hand_sides.data();
  mumps.nrhs = columns;
  mumps.lrhs = mumps.n;
  instance_->call(kSolve);
  mumps.rhs = nullptr;
  if (instance_->infog(1) < 0) return failure(explain(mumps, instance_->what));
  return {};
}

Result<void> MumpsFactor::solve_sparse(std::span<const int> begin, std::span<const int> rows,
                                       std::span<const double> values, std::span<double> out) {
  DMUMPS_STRUC_C& mumps = instance_->mumps;
  const std::size_t columns = begin.size() - 1;
  if (out.size() != order() * columns || rows.size() != values.size()) {
    return failure(instance_->what + ": room for " + std::to_string(out.size()) +
                   " numbers given; expected " + std::to_string(order() * columns));
  }
  if (columns == 0) return {};
  std::vector<double> numbers(values.begin(), values.end());
  std::vector<int> row_numbers, column_begin;
  for (const int row : rows) row_numbers.push_back(row + 1);
  for (const int at : begin) column_begin.push_back(at + 1);
  constexpr int kSparseExploited = 3;
  instance_->icntl(20) = kSparseExploited;
  instance_->icntl(27) = static_cast<int>(columns);
  mumps.rhs_sparse = numbers.data();
  mumps.irhs_sparse = row_numbers.data();
  mumps.irhs_ptr = column_begin.data();
  mumps.nz_rhs = static_cast<int>(rows.size());
  mumps.nrhs = static_cast<int>(columns);
  mumps.rhs = out.data();
  mumps.lrhs = mumps.n;
  instance_->call(kSolve);
  mumps.rhs = mumps.rhs_sparse = nullptr;
  mumps.irhs_sparse = mumps.irhs_ptr = nullptr;
  if (instance_->infog(1) < 0) return failure(explain(mumps, instance_->what));
  return {};
}

std::size_t MumpsFactor::order() const {
  return static_cast<std::size_t>(instance_->mumps.n);
}

std::size_t MumpsFactor::factor_bytes() const {
  // MUMPS gives counts above 2^31 as minus the number of millions.
  const int numbers = instance_->infog(9);
  const double count = numbers >= 0 ? numbers : -1e6 * numbers;
  return static_cast<std::size_t>(count) * sizeof(double);
}

}  // namespace viscera
