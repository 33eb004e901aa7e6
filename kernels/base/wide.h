// Wider registers in hot loops where the machine has them, chosen when the program starts. Loops
// that only work element by element give the same digits either way.
#pragma once

#include "kernels/base/sanitized.h"

// Sanitizers instrument the function that chooses, which runs before they are ready.
#if defined(__x86_64__) && !defined(VISCERA_SANITIZED)
#define VISCERA_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define VISCERA_WIDE
#endif
