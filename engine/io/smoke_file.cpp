#include "engine/io/smoke_file.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>

#include "engine/io/atomic_file.h"
#include "engine/io/vdb_volume.h"

namespace viscera {
namespace {

constexpr std::size_t kMostWaiting = 2;

struct Job {
  std::filesystem::path file;
  SmokeGrid grid;
  double time;
  std::string volume, scene;
};

Result<void> write_volume(const Job& job) {
  const Result<std::string> bytes = encode_volume(job.grid, job.time, job.volume, job.scene);
  if (!bytes) return failure(job.file.string() + ": " + bytes.error().text());
  return write_file(job.file, *bytes, Durable::kNo);
}

}  // namespace

struct SmokeWriter::Data {
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::deque<Job> waiting;
  bool working = false, closing = false;
  int written = 0;
  std::optional<Error> error;  // the first
  std::thread worker;

  void work() {
    std::unique_lock lock(mutex);
    while (true) {
      changed.wait(lock, [&] { return closing || !waiting.empty(); });
      if (waiting.empty()) return;
      const Job job = std::move(waiting.front());
      waiting.pop_front();
      working = true;
      lock.unlock();
      changed.notify_all();
      const Result<void> done = write_volume(job);
      lock.lock();
      working = false;
      if (done) {
        ++written;
      } else if (!error) {
        error = done.error();
      }
      changed.notify_all();
    }
  }
};

SmokeWriter::SmokeWriter() : data_(std::make_unique<Data>()) {
  ensure_openvdb();
  data_->worker = std::thread([data = data_.get()] { data->work(); });
}

SmokeWriter::~SmokeWriter() {
  {
    const std::scoped_lock lock(data_->mutex);
    data_->closing = true;
  }
  data_->changed.notify_all();
  data_->worker.join();
}

void SmokeWriter::write(const std::filesystem::path& file, const SmokeGrid& grid, double time,
                        const std::string& volume_name, const std::string& scene_name) {
  // A grid that doesn't fit together is refused when it is encoded.
  const auto cells = static_cast<std::size_t>(std::max(0, grid.size.prod()));
  const bool fits = cells > 0 && grid.density.size() == cells && grid.temperature.size() == cells &&
                    grid.velocity.size() == cells;
  Job job{file, fits ? filled_part(grid) : grid, time, volume_name, scene_name};
  std::unique_lock lock(data_->mutex);
  data_->changed.wait(lock, [&] { return data_->waiting.size() < kMostWaiting; });
  data_->waiting.push_back(std::move(job));
  lock.unlock();
  data_->changed.notify_all();
}

Result<void> SmokeWriter::finish() {
  std::unique_lock lock(data_->mutex);
  data_->changed.wait(lock, [&] { return data_->waiting.empty() && !data_->working; });
  if (data_->error) return std::unexpected(*data_->error);
  return {};
}

int SmokeWriter::written() const {
  const std::scoped_lock lock(data_->mutex);
  return data_->written;
}

}  // namespace viscera
