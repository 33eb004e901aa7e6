#include "engine/io/file_worker.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "kernels/base/stopwatch.h"

namespace viscera {
namespace {

// An exception that left the thread would end the program, and with it all that is being written.
Result<void> outcome_of(FileWorker::Job& job) {
  try {
    return job();
  } catch (const std::bad_alloc&) {
    return failure("out of memory while writing a file");
  } catch (const std::exception& error) {
    return failure(std::string("while writing a file: ") + error.what());
  }
}

}  // namespace

struct FileWorker::Data {
  std::size_t most_waiting = 0;
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::deque<Job> waiting;
  bool working = false, closing = false;
  int done = 0;
  double seconds = 0.0;
  std::optional<Error> error;  // the first
  std::thread thread;

  void work() {
    std::unique_lock lock(mutex);
    while (true) {
      changed.wait(lock, [&] { return closing || !waiting.empty(); });
      if (waiting.empty()) return;
      std::optional<Job> job = std::move(waiting.front());
      waiting.pop_front();
      working = true;
      lock.unlock();
      changed.notify_all();
      const Stopwatch watch;
      const Result<void> outcome = outcome_of(*job);
      job.reset();  // what it holds goes before anybody hears that it is done
      const double spent = watch.seconds();
      lock.lock();
      working = false;
      seconds += spent;
      if (outcome) {
        ++done;
      } else if (!error) {
        error = outcome.error();
      }
      changed.notify_all();
    }
  }

  Result<void> status() const {
    if (error) return std::unexpected(*error);
    return {};
  }
};

FileWorker::FileWorker(std::size_t most_waiting) : data_(std::make_unique<Data>()) {
  data_->most_waiting = most_waiting > 0 ? most_waiting : 1;
  data_->thread = std::thread([data = data_.get()] { data->work(); });
}

FileWorker::~FileWorker() {
  {
    const std::scoped_lock lock(data_->mutex);
    data_->closing = true;
  }
  data_->changed.notify_all();
  data_->thread.join();
}

void FileWorker::add(Job job) {
  std::unique_lock lock(data_->mutex);
  data_->changed.wait(lock, [&] { return data_->waiting.size() < data_->most_waiting; });
  data_->waiting.push_back(std::move(job));
  lock.unlock();
  data_->changed.notify_all();
}

Result<void> FileWorker::status() const {
  const std::scoped_lock lock(data_->mutex);
  return data_->status();
}

Result<void> FileWorker::finish() {
  std::unique_lock lock(data_->mutex);
  data_->changed.wait(lock, [&] { return data_->waiting.empty() && !data_->working; });
  return data_->status();
}

int FileWorker::done() const {
  const std::scoped_lock lock(data_->mutex);
  return data_->done;
}

double FileWorker::seconds() const {
  const std::scoped_lock lock(data_->mutex);
  return data_->seconds;
}

}  // namespace viscera
