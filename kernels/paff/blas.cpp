#include "kernels/paff/blas.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <string_view>
#include <vector>

extern "C" {
void spotrf_(const char*, const int*, float*, const int*, int*);
void dpotrf_(const char*, const int*, double*, const int*, int*);
void sgemm_(const char*, const char*, const int*, const int*, const int*, const float*,
            const float*, const int*, const float*, const int*, const float*, float*, const int*);
void dgemm_(const char*, const char*, const int*, const int*, const int*, const double*,
            const double*, const int*, const double*, const int*, const double*, double*,
            const int*);
void ssyrk_(const char*, const char*, const int*, const int*, const float*, const float*,
            const int*, const float*, float*, const int*);
void dsyrk_(const char*, const char*, const int*, const int*, const double*, const double*,
            const int*, const double*, double*, const int*);
void dsyevd_(const char*, const char*, const int*, double*, const int*, double*, double*,
             const int*, int*, const int*, int*);
}

namespace viscera {

namespace {

/// OpenBLAS's own functions; null with another BLAS.
template <class Function>
Function openblas_function(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
}

/// OpenBLAS chooses its kernels by a list of processor models. One that is newer than the library
/// counts as a Pentium 4 (core "Prescott") and multiplies at a seventh of its speed; this has it
/// choose again by what the processor can do. OPENBLAS_CORETYPE, where the user sets it, stands.
void choose_blas_kernels() {
#if defined(__x86_64__)
  const auto core_name = openblas_function<const char* (*)()>("openblas_get_corename");
  const auto forget = openblas_function<void (*)()>("gotoblas_dynamic_quit");
  const auto choose = openblas_function<void (*)()>("gotoblas_dynamic_init");
  constexpr const char* kChoice = "OPENBLAS_CORETYPE";
  if (!core_name || !forget || !choose || std::getenv(kChoice)) return;
  if (std::string_view(core_name()) != "Prescott") return;
  const char* able = nullptr;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) able = "Haswell";
  if (able && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")) {
    able = "SkylakeX";
  }
  if (!able) return;
  setenv(kChoice, able, 0);
  forget();
  choose();
  unsetenv(kChoice);
#endif
}

}  // namespace

void prepare_blas() {
  static const bool once = [] {
    choose_blas_kernels();
    return true;
  }();
  static_cast<void>(once);
  static const auto set_threads = openblas_function<void (*)(int)>("openblas_set_num_threads");
  if (set_threads) set_threads(1);
}

namespace blas {
namespace {

/// Triangles up to this order are inverted.
constexpr int kInverted = 32;

/// Inverse of a lower triangle (n x n), n <= kInverted; zeros above the diagonal.
template <class Real>
void invert(int n, const Real* l, int ldl, std::array<Real, kInverted * kInverted>& inverse) {
  inverse.fill(Real(0));
  for (int j = 0; j < n; ++j) {
    Real* column = inverse.data() + j * kInverted;
    for (int i = j; i < n; ++i) {
      Real sum = i == j ? Real(1) : Real(0);
      for (int k = j; k < i; ++k) sum -= l[i + static_cast<std::ptrdiff_t>(k) * ldl] * column[k];
      column[i] = sum / l[i + static_cast<std::ptrdiff_t>(i) * ldl];
    }
  }
}

/// B := B L^-T or B L^-1 by halves: nearly all of it becomes products, which run at two to five
/// times the speed of OpenBLAS's triangular solves.
template <class Real>
void solve_by_products(bool transposed, int m, int n, const Real* l, int ldl, Real* b, int ldb) {
  if (m <= 0 || n <= 0) return;
  if (n <= kInverted) {
    std::array<Real, kInverted * kInverted> inverse;
    invert(n, l, ldl, inverse);
    constexpr int kRows = 256;  // of a task: the copy stays in the cache
    std::array<Real, kRows * kInverted> copy;
    for (int first = 0; first < m; first += kRows) {
      const int rows = std::min(kRows, m - first);
      for (int j = 0; j < n; ++j) {
        std::copy_n(b + first + static_cast<std::ptrdiff_t>(j) * ldb, rows, copy.data() + j * rows);
      }
      multiply(transposed, rows, n, n, Real(1), copy.data(), rows, inverse.data(), kInverted,
               Real(0), b + first, ldb);
    }
    return;
  }
  const int half = (n / 2 + kInverted - 1) / kInverted * kInverted, rest = n - half;
  const Real* below = l + half;
  const Real* corner = below + static_cast<std::ptrdiff_t>(half) * ldl;
  Real* right = b + static_cast<std::ptrdiff_t>(half) * ldb;
  if (transposed) {
    solve_by_products(true, m, half, l, ldl, b, ldb);
    multiply(true, m, rest, half, Real(-1), b, ldb, below, ldl, Real(1), right, ldb);
    solve_by_products(true, m, rest, corner, ldl, right, ldb);
  } else {
    solve_by_products(false, m, rest, corner, ldl, right, ldb);
    multiply(false, m, half, rest, Real(-1), right, ldb, below, ldl, Real(1), b, ldb);
    solve_by_products(false, m, half, l, ldl, b, ldb);
  }
}

}  // namespace

bool cholesky(int n, float* a, int lda) {
  int info = 0;
  spotrf_("L", &n, a, &lda, &info);
  return info == 0;
}

bool cholesky(int n, double* a, int lda) {
  int info = 0;
  dpotrf_("L", &n, a, &lda, &info);
  return info == 0;
}

void solve_right(bool transposed, int m, int n, const float* l, int ldl, float* b, int ldb) {
  solve_by_products(transposed, m, n, l, ldl, b, ldb);
}

void solve_right(bool transposed, int m, int n, const double* l, int ldl, double* b, int ldb) {
  solve_by_products(transposed, m, n, l, ldl, b, ldb);
}

void multiply(bool b_transposed, int m, int n, int k, float alpha, const float* a, int lda,
              const float* b, int ldb, float beta, float* c, int ldc) {
  sgemm_("N", b_transposed ? "T" : "N", &m, &n, &k, &alpha, a, &lda, b, &ldb, &beta, c, &ldc);
}

void multiply(bool b_transposed, int m, int n, int k, double alpha, const double* a, int lda,
              const double* b, int ldb, double beta, double* c, int ldc) {
  dgemm_("N", b_transposed ? "T" : "N", &m, &n, &k, &alpha, a, &lda, b, &ldb, &beta, c, &ldc);
}

void subtract_square(int n, int k, const float* a, int lda, float* c, int ldc) {
  const float minus = -1.0f, one = 1.0f;
  ssyrk_("L", "N", &n, &k, &minus, a, &lda, &one, c, &ldc);
}

void subtract_square(int n, int k, const double* a, int lda, double* c, int ldc) {
  const double minus = -1.0, one = 1.0;
  dsyrk_("L", "N", &n, &k, &minus, a, &lda, &one, c, &ldc);
}

bool eigen(int n, double* a, double* values) {
  if (n == 0) return true;
  int info = 0, work_size = -1, whole_size = -1, whole = 0;
  double work = 0.0;
  dsyevd_("V", "L", &n, a, &n, values, &work, &work_size, &whole, &whole_size, &info);
  if (info != 0) return false;
  work_size = static_cast<int>(work);
  whole_size = whole;
  std::vector<double> room(static_cast<std::size_t>(work_size));
  std::vector<int> whole_room(static_cast<std::size_t>(whole_size));
  dsyevd_("V", "L", &n, a, &n, values, room.data(), &work_size, whole_room.data(), &whole_size,
          &info);
  return info == 0;
}

}  // namespace blas
}  // namespace viscera
