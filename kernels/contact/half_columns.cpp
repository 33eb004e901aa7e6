#include "kernels/contact/half_columns.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "kernels/base/parallel.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace viscera {
namespace {

constexpr std::size_t kRowChunk = 2048;
constexpr std::size_t kEntryChunk = 1 << 16;

/// u += x fx + y fy + z fz over n rows, from halves.
using AddColumns = void (*)(float* u, const std::uint16_t* x, const std::uint16_t* y,
                            const std::uint16_t* z, float fx, float fy, float fz, std::size_t n);

void add_columns_portable(float* u, const std::uint16_t* x, const std::uint16_t* y,
                          const std::uint16_t* z, float fx, float fy, float fz, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    u[i] += from_half(x[i]) * fx + from_half(y[i]) * fy + from_half(z[i]) * fz;
  }
}

#if defined(__x86_64__)
__attribute__((target("avx,f16c"))) inline __m256 widened(const std::uint16_t* at) {
  return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at)));
}

/// The same sums in the same order, eight rows at a time.
__attribute__((target("avx,f16c"))) void add_columns_f16c(float* u, const std::uint16_t* x,
                                                          const std::uint16_t* y,
                                                          const std::uint16_t* z, float fx,
                                                          float fy, float fz, std::size_t n) {
  const __m256 wx = _mm256_set1_ps(fx), wy = _mm256_set1_ps(fy), wz = _mm256_set1_ps(fz);
  std::size_t i = 0;
  for (; i + 8 <= n; i += 8) {
    const __m256 xy =
        _mm256_add_ps(_mm256_mul_ps(widened(x + i), wx), _mm256_mul_ps(widened(y + i), wy));
    const __m256 sum = _mm256_add_ps(xy, _mm256_mul_ps(widened(z + i), wz));
    _mm256_storeu_ps(u + i, _mm256_add_ps(_mm256_loadu_ps(u + i), sum));
  }
  add_columns_portable(u + i, x + i, y + i, z + i, fx, fy, fz, n - i);
}
#endif

AddColumns add_columns() {
#if defined(__x86_64__)
  static const bool fast = __builtin_cpu_supports("avx") && __builtin_cpu_supports("f16c");
  if (fast) return add_columns_f16c;
#endif
  return add_columns_portable;
}

}  // namespace

std::uint16_t to_half(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint16_t>((bits >> 16) & 0x8000u);
  const std::uint32_t size = bits & 0x7fffffffu;
  if (size > 0x7f800000u) return static_cast<std::uint16_t>(sign | 0x7e00u);   // not a number
  if (size >= 0x477ff000u) return static_cast<std::uint16_t>(sign | 0x7c00u);  // beyond the range
  if (size < 0x38800000u) {
    // Below 2^-14 halves are spaced 2^-24; the sum rounds to that spacing, to even at ties.
    const float shifted = std::bit_cast<float>(size) + 0.5f;
    return static_cast<std::uint16_t>(sign | (std::bit_cast<std::uint32_t>(shifted) - 0x3f000000u));
  }
  const std::uint32_t odd = (size >> 13) & 1u;
  return static_cast<std::uint16_t>(sign | ((size - 0x38000000u + 0x0fffu + odd) >> 13));
}

float from_half(std::uint16_t half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16;
  const std::uint32_t size = half & 0x7fffu;
  std::uint32_t bits = 0;
  if (size >= 0x7c00u) {
    bits = 0x7f800000u | ((size & 0x3ffu) << 13);
  } else if (size >= 0x400u) {
    bits = (size << 13) + 0x38000000u;
  } else {
    bits = std::bit_cast<std::uint32_t>(static_cast<float>(size) * 0x1p-24f);
  }
  return std::bit_cast<float>(sign | bits);
}

HalfColumns half_precision(const SurfaceCompliance& compliance) {
  HalfColumns half;
  compliance.need_all();
  half.rows = compliance.rows();
  const std::size_t count = compliance.columns.size();
  half.entries.resize(count);
  const std::size_t chunks = (count + kEntryChunk - 1) / kEntryChunk;
  std::vector<float> greatest(chunks, 0.0f), error(chunks, 0.0f);
  parallel_chunks(count, kEntryChunk, [&](std::size_t begin, std::size_t end) {
    float& most = greatest[begin / kEntryChunk];
    for (std::size_t i = begin; i < end; ++i)
      most = std::max(most, std::abs(compliance.columns[i]));
  });
  const float top = chunks > 0 ? *std::max_element(greatest.begin(), greatest.end()) : 0.0f;
  if (!std::isfinite(top)) half.error = std::numeric_limits<double>::infinity();
  if (!(top > 0.0f) || !std::isfinite(top)) return half;
  // A power of two: scaling is exact. top / scale lies in [2^14, 2^15).
  int exponent = 0;
  std::frexp(top, &exponent);
  half.scale = std::ldexp(1.0f, exponent - 15);
  parallel_chunks(count, kEntryChunk, [&](std::size_t begin, std::size_t end) {
    float& worst = error[begin / kEntryChunk];
    for (std::size_t i = begin; i < end; ++i) {
      const float entry = compliance.columns[i];
      half.entries[i] = to_half(entry / half.scale);
      worst = std::max(worst, std::abs(from_half(half.entries[i]) * half.scale - entry));
    }
  });
  half.error = static_cast<double>(*std::max_element(error.begin(), error.end())) / top;
  return half;
}

SurfaceCompliance force_part(const SurfaceCompliance& compliance) {
  compliance.need_all();
  SurfaceCompliance part;
  part.places = compliance.touchable.size();
  for (std::size_t t = 0; t < part.places; ++t) part.touchable.push_back(static_cast<int>(t));
  part.symmetric = compliance.symmetric;
  part.columns.reserve(part.rows() * part.rows());
  for (std::size_t column = 0; column < part.rows(); ++column) {
    const float* from = compliance.columns.data() + column * compliance.rows();
    for (const int place : compliance.touchable) {
      part.columns.insert(part.columns.end(), from + 3 * place, from + 3 * place + 3);
    }
  }
  return part;
}

void place_displacements(const HalfColumns& columns, const ContactResponse& response,
                         std::vector<float>& displacements) {
  const AddColumns add = add_columns();
  displacements.assign(columns.rows, 0.0f);
  parallel_chunks(columns.rows, kRowChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = 0; j < response.touched.size(); ++j) {
      const Vec3f load = (response.loads[j] * columns.scale).cast<float>();
      const std::uint16_t* x = columns.entries.data() +
                               3 * static_cast<std::size_t>(response.touched[j]) * columns.rows +
                               begin;
      add(displacements.data() + begin, x, x + columns.rows, x + 2 * columns.rows, load.x(),
          load.y(), load.z(), end - begin);
    }
  });
}

}  // namespace viscera
