// What a step may have to tell, each with what to do about it. A feature declares the flags that it
// raises in NAME_flags.h and lists them in Feature::flags.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace viscera {

struct FrameFlag {
  std::string_view name;  ///< for programs and checkpoints: "grip_slipped"; unique
  std::string_view text;  ///< for people: what happened and what to do, as report.json says it
};

/// Flags that were raised, each once, told apart by name. An empty one takes no memory.
class FlagSet {
 public:
  void raise(const FrameFlag& flag);
  void raise(const FlagSet& others);
  /// Puts them in the order of `all`; those that it lacks come last, as they were raised.
  void order(std::span<const FrameFlag> all);

  bool has(const FrameFlag& flag) const { return has(flag.name); }
  bool has(std::string_view name) const;
  bool empty() const { return raised_.empty(); }
  std::size_t size() const { return raised_.size(); }
  std::vector<std::string_view> names() const;
  auto begin() const { return raised_.begin(); }
  auto end() const { return raised_.end(); }

  /// The same flags in the same order.
  friend bool operator==(const FlagSet& a, const FlagSet& b) { return a.names() == b.names(); }

 private:
  std::vector<FrameFlag> raised_;
};

}  // namespace viscera
