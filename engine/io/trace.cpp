#include "engine/io/trace.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/io/atomic_file.h"

namespace viscera {
namespace {

std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

Quantiles quantiles(std::vector<double> values) {
  Quantiles q;
  q.count = values.size();
  if (values.empty()) return q;
  std::sort(values.begin(), values.end());
  const auto rank = [&](double share) {
    const double n = std::ceil(share * static_cast<double>(values.size()));
    return values[static_cast<std::size_t>(std::max(1.0, n)) - 1];
  };
  q.median = rank(0.5);
  q.p99 = rank(0.99);
  q.max = values.back();
  for (const double value : values) q.total += value;
  return q;
}

Trace::Trace(std::vector<std::string> stages) : stages_(std::move(stages)), origin_(Clock::now()) {}

void Trace::add(int stage, std::uint64_t frame, Clock::time_point start, Clock::time_point end) {
  using std::chrono::duration_cast;
  using std::chrono::nanoseconds;
  events_.push_back({.stage = stage,
                     .frame = static_cast<std::uint32_t>(frame),
                     .start = duration_cast<nanoseconds>(start - origin_).count(),
                     .duration = duration_cast<nanoseconds>(end - start).count()});
}

bool Trace::restore(std::vector<Event> events) {
  std::int64_t end = 0;
  for (const Event& event : events) {
    if (event.stage < 0 || static_cast<std::size_t>(event.stage) >= stages_.size()) return false;
    end = std::max(end, event.start + event.duration);
  }
  origin_ = Clock::now() - std::chrono::nanoseconds(end);
  const std::size_t room = events_.capacity();
  events_ = std::move(events);
  events_.reserve(room);
  return true;
}

Quantiles Trace::durations(int stage) const {
  std::vector<double> values;
  for (const Sample& sample : samples(stage)) values.push_back(sample.seconds);
  return quantiles(std::move(values));
}

std::vector<Trace::Sample> Trace::samples(int stage) const {
  std::vector<Sample> all;
  for (const Event& event : events_) {
    if (event.stage == stage)
      all.push_back({event.frame, 1e-9 * static_cast<double>(event.duration)});
  }
  return all;
}

Result<void> Trace::write(const std::filesystem::path& file, const std::string& process) const {
  auto out = AtomicFile::create(file);
  if (!out) return std::unexpected(out.error());
  std::vector<std::string> names;
  for (const std::string& stage : stages_) names.push_back(quoted(stage));

  out->write("{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n");
  out->write("{\"ph\":\"M\",\"pid\":1,\"tid\":1,\"name\":\"process_name\",\"args\":{\"name\":" +
             quoted(process) + "}},\n");
  out->write(
      "{\"ph\":\"M\",\"pid\":1,\"tid\":1,\"name\":\"thread_name\",\"args\":{\"name\":"
      "\"stages\"}}");
  char numbers[160];
  for (const Event& event : events_) {
    // Times are microseconds in this format; the fraction keeps the nanoseconds.
    std::snprintf(numbers, sizeof numbers, ",\"ts\":%.3f,\"dur\":%.3f,\"args\":{\"frame\":%u}}",
                  1e-3 * static_cast<double>(event.start),
                  1e-3 * static_cast<double>(event.duration), event.frame);
    out->write(",\n{\"ph\":\"X\",\"pid\":1,\"tid\":1,\"name\":");
    out->write(names[static_cast<std::size_t>(event.stage)]);
    out->write(numbers);
  }
  out->write("\n]}\n");
  return out->commit();
}

}  // namespace viscera
