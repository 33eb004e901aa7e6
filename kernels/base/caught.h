// Exceptions of work that must not end a program, as errors.
#pragma once

#include <exception>
#include <new>
#include <string>
#include <type_traits>

#include "kernels/base/result.h"

namespace viscera {

/// What `work` gives, or an error in the words of what it threw. Threads hand their exceptions to
/// whoever waits for them, so this holds for loops over threads too.
template <class Work>
Result<void> caught(const Work& work) {
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<const Work&>>) {
      work();
      return {};
    } else {
      return work();
    }
  } catch (const std::bad_alloc&) {
    return failure("out of memory");
  } catch (const std::exception& error) {
    return failure(std::string("internal error: ") + error.what());
  } catch (...) {
    return failure("internal error");
  }
}

}  // namespace viscera
