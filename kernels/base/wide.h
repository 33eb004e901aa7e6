// Wider registers in hot loops where the machine has them, chosen when the program starts. Loops
// that only work element by element give the same digits either way.
#pragma once

#include "kernels/base/sanitized.h"

// Sanitizers instrument the function that chooses, which runs before they are ready.
#if defined(__x86_64__) && !defined(VISCERA_SANITIZED)
#define VISCERA_WIDE __attribute__((target_clones("avx2", "default")))
// One definition each of a function of three; the fastest that the machine can run is chosen when
// the program starts.
#define VISCERA_THREE_TARGETS 1
#define VISCERA_FOR_AVX512 __attribute__((target("avx512f")))
#define VISCERA_FOR_AVX2 __attribute__((target("avx2")))
#define VISCERA_FOR_ANY __attribute__((target("default")))
#else
#define VISCERA_WIDE
#define VISCERA_THREE_TARGETS 0
#define VISCERA_FOR_ANY
#endif
