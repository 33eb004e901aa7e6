// How long work tells the caller where it is, and learns that it should stop.
#pragma once

#include <functional>
#include <string_view>

namespace viscera {

/// Called from one thread, with the share done in [0, 1] and a short present participle
/// ("assembling"). Returns false when the work should stop (Ctrl-C); the worker then returns an
/// Error with the message `kCancelled` and leaves nothing half-written.
using Progress = std::function<bool(double fraction, std::string_view what)>;

inline constexpr const char* kCancelled = "cancelled";

/// Progress that nobody watches.
inline Progress no_progress() {
  return [](double, std::string_view) { return true; };
}

}  // namespace viscera
