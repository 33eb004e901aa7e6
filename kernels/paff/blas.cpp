#include "kernels/paff/blas.h"

#include <dlfcn.h>

extern "C" {
void spotrf_(const char*, const int*, float*, const int*, int*);
void dpotrf_(const char*, const int*, double*, const int*, int*);
void strsm_(const char*, const char*, const char*, const char*, const int*, const int*,
            const float*, const float*, const int*, float*, const int*);
void dtrsm_(const char*, const char*, const char*, const char*, const int*, const int*,
            const double*, const double*, const int*, double*, const int*);
void sgemm_(const char*, const char*, const int*, const int*, const int*, const float*,
            const float*, const int*, const float*, const int*, const float*, float*, const int*);
void dgemm_(const char*, const char*, const int*, const int*, const int*, const double*,
            const double*, const int*, const double*, const int*, const double*, double*,
            const int*);
void ssyrk_(const char*, const char*, const int*, const int*, const float*, const float*,
            const int*, const float*, float*, const int*);
void dsyrk_(const char*, const char*, const int*, const int*, const double*, const double*,
            const int*, const double*, double*, const int*);
}

namespace viscera {

void hold_blas_to_one_thread() {
  // The symbol is OpenBLAS's own; the reference BLAS, where it is installed instead, has one thread
  // anyway.
  using SetThreads = void (*)(int);
  static const auto set_threads =
      reinterpret_cast<SetThreads>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
  if (set_threads) set_threads(1);
}

namespace blas {

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
  const float one = 1.0f;
  strsm_("R", "L", transposed ? "T" : "N", "N", &m, &n, &one, l, &ldl, b, &ldb);
}

void solve_right(bool transposed, int m, int n, const double* l, int ldl, double* b, int ldb) {
  const double one = 1.0;
  dtrsm_("R", "L", transposed ? "T" : "N", "N", &m, &n, &one, l, &ldl, b, &ldb);
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

}  // namespace blas
}  // namespace viscera
