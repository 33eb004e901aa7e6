#include "kernels/smoke/mie.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace viscera {

// [Bohren1983] eq. 4.61, 4.62, 4.88, 4.89 and appendix A: logarithmic derivatives D_n of psi inside
// the sphere by downward recurrence, psi_n and xi_n = psi_n - i chi_n outside by upward.
MieEfficiencies mie(double x, std::complex<double> index) {
  using Complex = std::complex<double>;
  const Complex inside = index * x;
  const int terms = static_cast<int>(x + 4.0 * std::cbrt(x) + 2.0);
  // Where the recurrence begins psi is still far below its waves: what is wrong there fades.
  const double size = std::abs(inside);
  const int start = std::max(terms, static_cast<int>(size + 8.0 * std::cbrt(size))) + 16;
  std::vector<Complex> derivative(static_cast<std::size_t>(start) + 1);
  for (int n = start; n > 0; --n) {
    const Complex ratio = static_cast<double>(n) / inside;
    const auto at = static_cast<std::size_t>(n);
    derivative[at - 1] = ratio - 1.0 / (derivative[at] + ratio);
  }
  double psi_before = std::cos(x), psi = std::sin(x);
  double chi_before = -std::sin(x), chi = std::cos(x);
  MieEfficiencies sums;
  Complex a_before, b_before;
  for (int n = 1; n <= terms; ++n) {
    const double order = n;
    const double psi_next = (2.0 * order - 1.0) / x * psi - psi_before;
    const double chi_next = (2.0 * order - 1.0) / x * chi - chi_before;
    const Complex xi(psi, -chi), xi_next(psi_next, -chi_next);
    const Complex d = derivative[static_cast<std::size_t>(n)];
    const Complex electric = d / index + order / x, magnetic = d * index + order / x;
    const Complex a = (electric * psi_next - psi) / (electric * xi_next - xi);
    const Complex b = (magnetic * psi_next - psi) / (magnetic * xi_next - xi);
    sums.extinction += (2.0 * order + 1.0) * (a + b).real();
    sums.scattering += (2.0 * order + 1.0) * (std::norm(a) + std::norm(b));
    sums.asymmetry += (2.0 * order + 1.0) / (order * (order + 1.0)) * (a * std::conj(b)).real();
    if (n > 1) {
      const double last = order - 1.0;
      sums.asymmetry += last * (last + 2.0) / (last + 1.0) *
                        (a_before * std::conj(a) + b_before * std::conj(b)).real();
    }
    a_before = a, b_before = b;
    psi_before = psi, psi = psi_next;
    chi_before = chi, chi = chi_next;
  }
  const double scale = 2.0 / (x * x);
  return {scale * sums.extinction, scale * sums.scattering, 2.0 * sums.asymmetry / sums.scattering};
}

}  // namespace viscera
