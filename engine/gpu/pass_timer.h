// How long each pass of a picture took on the device.
#pragma once

#include <string>
#include <vector>

namespace viscera {

struct PassTime {
  std::string name;
  double seconds = 0.0;
};

/// Timestamps between passes: GL_TIME_ELAPSED reads zero on the software driver, timestamps don't.
class PassTimer {
 public:
  PassTimer() = default;
  ~PassTimer();
  PassTimer(const PassTimer&) = delete;
  PassTimer& operator=(const PassTimer&) = delete;

  void start();
  /// Ends the pass that began at the last mark, or at start().
  void mark(const char* name);
  /// What went on since the last mark, or start(), is no pass's: the processor's own work.
  void skip();
  /// Waits for the device. Passes in the order of their marks.
  std::vector<PassTime> finish();

 private:
  void stamp();
  std::vector<unsigned> queries_;  // made as needed, used again every picture
  std::size_t used_ = 0;
  std::vector<const char*> names_;  // null: skipped
};

}  // namespace viscera
