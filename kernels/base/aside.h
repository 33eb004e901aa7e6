// Work that goes on beside what its caller does next.
#pragma once

#include <oneapi/tbb/task_group.h>

#include <utility>

#include "kernels/base/caught.h"

namespace viscera {

/// One caller's thread. What was begun may run on any thread, of one thread alone in wait().
class Aside {
 public:
  Aside() = default;
  Aside(const Aside&) = delete;
  Aside& operator=(const Aside&) = delete;
  /// Until nothing of it goes on; what that threw is lost.
  ~Aside() {
    (void)caught([this] { wait(); });
  }

  template <class Work>
  void begin(Work work) {
    group_.run(std::move(work));
  }
  /// Until all that was begun is done. Throws what that threw.
  void wait() { group_.wait(); }

 private:
  oneapi::tbb::task_group group_;
};

}  // namespace viscera
