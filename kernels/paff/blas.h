// The few BLAS and LAPACK routines of the dense kernels, in both precisions, on column-major
// matrices. Each call runs on the calling thread alone (see prepare_blas), so that it
// may be made from many threads at once and its result doesn't depend on their number.
#pragma once

namespace viscera {

/// Holds it to one thread: a threaded BLAS gives other last digits with other thread counts, and
/// competes with the program's own threads. And has OpenBLAS use kernels that fit the processor,
/// which it fails to do on models that it doesn't know. To be called before the first use; cheap.
void prepare_blas();

namespace blas {

/// Lower triangle of A (n x n): A = L L^T in place. False where it isn't positive definite.
bool cholesky(int n, float* a, int lda);
bool cholesky(int n, double* a, int lda);

/// B (m x n) := B L^-T or B L^-1 with lower triangular L (n x n).
void solve_right(bool transposed, int m, int n, const float* l, int ldl, float* b, int ldb);
void solve_right(bool transposed, int m, int n, const double* l, int ldl, double* b, int ldb);

/// C (m x n) := beta C + alpha A B, with A (m x k) and B (k x n), or B given as (n x k).
void multiply(bool b_transposed, int m, int n, int k, float alpha, const float* a, int lda,
              const float* b, int ldb, float beta, float* c, int ldc);
void multiply(bool b_transposed, int m, int n, int k, double alpha, const double* a, int lda,
              const double* b, int ldb, double beta, double* c, int ldc);

/// Lower triangle of C (n x n) := C - A A^T with A (n x k).
void subtract_square(int n, int k, const float* a, int lda, float* c, int ldc);
void subtract_square(int n, int k, const double* a, int lda, double* c, int ldc);

/// Eigenvalues of a symmetric A (n x n, its lower triangle), ascending; A becomes their
/// eigenvectors. False where they aren't found.
bool eigen(int n, double* a, double* values);

}  // namespace blas
}  // namespace viscera
