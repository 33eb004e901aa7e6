#include "engine/run/run_book.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "kernels/base/archive.h"

namespace viscera {
namespace {

struct Saved {
  std::string options;
  std::vector<std::string> flags;  ///< names
  RunBook::Strays strays;
  double wall_s = 0.0;
  std::vector<Trace::Event> events;
  static constexpr auto fields() {
    return std::tuple(field("options", &Saved::options), field("flags", &Saved::flags),
                      field("strays", &Saved::strays), field("wall_s", &Saved::wall_s),
                      field("events", &Saved::events));
  }
};
static_assert(fields_cover<Saved>());

/// What pictures and files at a picture's time depend on besides the scene. Which observers there
/// are their own parts tell.
std::string text_of(const RunOptions& options) {
  if (!options.render) return "no pictures";
  std::vector<int> passes;
  for (const Pass pass : options.passes) passes.push_back(static_cast<int>(pass));
  return fmt::format("pictures of {} x {}, quality {}, passes [{}], snapshots [{}]", options.width,
                     options.height, name_of(options.quality), fmt::join(passes, ","),
                     fmt::join(options.snapshots, ","));
}

}  // namespace

void RunBook::Strays::add(const std::vector<std::string>& more, double time) {
  count += more.size();
  for (const std::string& one : more)
    if (first.size() < kMost) first.push_back(fmt::format("{}, at {:.3f} s", one, time));
}

CheckpointPart book_part(const RunBook& book, const Trace& trace, const RunOptions& options) {
  Saved all{.options = text_of(options),
            .strays = book.strays,
            .wall_s = book.wall_s,
            .events = trace.events()};
  for (const FrameFlag& flag : book.flags) all.flags.emplace_back(flag.name);
  return {kRunPart, saved(all)};
}

Result<void> load_book(const CheckpointPart& part, const RunOptions& options,
                       std::span<const FrameFlag> known, RunBook& book, Trace& trace) {
  Saved loaded;
  ByteReader reader(part.bytes);
  read(reader, loaded);
  if (reader.failed() || !reader.at_end())
    return failure(fmt::format("checkpoint: its part \"{}\": expected other contents", part.name));
  if (loaded.options != text_of(options))
    return failure(fmt::format("checkpoint: found one of a run with {}, expected {}",
                               loaded.options, text_of(options)));
  RunBook read_book{.strays = std::move(loaded.strays), .wall_s = loaded.wall_s};
  for (const std::string& name : loaded.flags) {
    const auto flag = std::ranges::find(known, name, &FrameFlag::name);
    if (flag == known.end())
      return failure(
          fmt::format("checkpoint: its part \"{}\": found the flag \"{}\", expected one that a "
                      "feature raises",
                      part.name, name));
    read_book.flags.raise(*flag);
  }
  if (!trace.restore(std::move(loaded.events)))
    return failure(
        fmt::format("checkpoint: its part \"{}\": expected the stages of a step", part.name));
  book = std::move(read_book);
  return {};
}

}  // namespace viscera
