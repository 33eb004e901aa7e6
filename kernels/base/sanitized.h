// Whether this is compiled for the address or the thread sanitizer: VISCERA_SANITIZED is defined
// then. GCC says it one way, Clang another.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VISCERA_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define VISCERA_SANITIZED
#endif
#endif

namespace viscera {

#ifdef VISCERA_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace viscera
