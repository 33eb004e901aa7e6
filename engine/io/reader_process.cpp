#include "engine/io/reader_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <utility>

extern char** environ;

namespace viscera {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMiB = std::uintmax_t{1} << 20;
/// On a busy machine a child gets its time later.
constexpr double kSlowness = 10.0, kStart = 20.0;  // [s]
constexpr std::uint32_t kMagic = 0x76697265;

/// What comes before an answer.
struct AnswerHead {
  std::uint32_t magic = kMagic;
  std::uint32_t is_error = 0;
  std::uint64_t size = 0;
};

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  int number() const { return number_; }
  void close() {
    if (number_ >= 0) ::close(std::exchange(number_, -1));
  }

 private:
  int number_;
};

struct Ended {
  std::string bytes;
  int status = 0;
  bool late = false, long_answer = false;
};

/// Reads until the child closes its end, is late or says too much; then it is gone.
Ended listen(pid_t child, int from, const ReadLimits& limits) {
  using Clock = std::chrono::steady_clock;
  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(
                         std::chrono::duration<double>(kStart + kSlowness * limits.seconds));
  Ended ended;
  std::vector<char> block(kMiB);
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd waiting{from, POLLIN, 0};
    const int ready = left > 0 ? ::poll(&waiting, 1, static_cast<int>(left)) : 0;
    if (ready < 0 && errno == EINTR) continue;
    ended.late = ready == 0;
    if (ready <= 0) break;
    const ssize_t got = ::read(from, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    ended.bytes.append(block.data(), static_cast<std::size_t>(got));
    ended.long_answer = ended.bytes.size() > limits.answer + sizeof(AnswerHead);
    if (ended.long_answer) break;
  }
  if (ended.late || ended.long_answer) ::kill(child, SIGKILL);
  while (::waitpid(child, &ended.status, 0) < 0 && errno == EINTR) {
  }
  return ended;
}

std::string why(const Ended& ended, const ReadLimits& limits) {
  if (ended.long_answer) return fmt::format("it holds more than {} MiB", limits.answer / kMiB);
  const bool out_of_time =
      ended.late || (WIFSIGNALED(ended.status) &&
                     (WTERMSIG(ended.status) == SIGXCPU || WTERMSIG(ended.status) == SIGKILL));
  if (out_of_time)
    return fmt::format("reading it took more than {:.0f} s, expected less for its size",
                       limits.seconds);
  if (WIFSIGNALED(ended.status))
    return fmt::format("its reader crashed (signal {}): the file is damaged",
                       WTERMSIG(ended.status));
  return fmt::format("its reader ended with exit code {}", WEXITSTATUS(ended.status));
}

fs::path beside_this_program() {
  std::error_code failed;
  const fs::path program = fs::read_symlink("/proc/self/exe", failed);
  return failed ? fs::path() : program.parent_path() / "viscera_reader";
}

}  // namespace

ReadLimits ReadLimits::for_file(std::uintmax_t bytes) {
  ReadLimits limits;
  limits.memory = 256 * kMiB + 32 * bytes;
  limits.seconds = 2.0 + static_cast<double>(bytes) / static_cast<double>(kMiB);
  limits.answer = 64 * kMiB + 32 * bytes;
  return limits;
}

Result<fs::path> reader_program() {
  std::error_code ignored;
  const char* told = std::getenv("VISCERA_READER");
  for (const fs::path& candidate :
       {fs::path(told ? told : ""), beside_this_program(), fs::path(VISCERA_READER_INSTALLED),
        fs::path(VISCERA_READER_BUILT)})
    if (!candidate.empty() && fs::is_regular_file(candidate, ignored)) return candidate;
  return failure(
      "found no program viscera_reader, which reads files of others, expected it beside this one "
      "or where VISCERA_READER says");
}

Result<std::vector<std::byte>> ask_reader(const ReadRequest& request) {
  const std::string name = request.file.string();
  const auto refused = [&](const std::string& reason) {
    return failure(name + ": cannot be read: " + reason);
  };
  const auto program = reader_program();
  if (!program) return std::unexpected(program.error());
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return refused(std::strerror(errno));
  Descriptor from(ends[0]), to(ends[1]);

  std::vector<std::string> words = {program->string(), std::string(request.reader),
                                    std::to_string(request.limits.memory),
                                    fmt::format("{}", request.limits.seconds), name};
  words.insert(words.end(), request.arguments.begin(), request.arguments.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, to.number(), STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int failed =
      ::posix_spawn(&child, program->c_str(), &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return refused(std::strerror(failed));
  to.close();

  Ended ended = listen(child, from.number(), request.limits);
  AnswerHead head;
  const bool whole = ended.bytes.size() >= sizeof head && WIFEXITED(ended.status) &&
                     WEXITSTATUS(ended.status) == 0 && !ended.late && !ended.long_answer;
  if (!whole) return refused(why(ended, request.limits));
  std::memcpy(&head, ended.bytes.data(), sizeof head);
  const auto bytes = std::as_bytes(std::span(ended.bytes)).subspan(sizeof head);
  if (head.magic != kMagic || head.size != bytes.size())
    return refused("its reader's answer is damaged");
  if (head.is_error == 0) return std::vector<std::byte>(bytes.begin(), bytes.end());
  Error error;
  ByteReader reader(bytes);
  read(reader, error.messages);
  if (reader.failed()) return refused("its reader's answer is damaged");
  return std::unexpected(error);
}

void give_answer(int out, const Result<std::vector<std::byte>>& answer) {
  const std::vector<std::byte> bytes = answer ? *answer : saved(answer.error().messages);
  const AnswerHead head{kMagic, answer ? 0u : 1u, bytes.size()};
  const auto send = [out](const void* data, std::size_t size) {
    const auto* next = static_cast<const char*>(data);
    while (size > 0) {
      const ssize_t sent = ::write(out, next, size);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) std::_Exit(1);  // nobody listens
      next += sent;
      size -= static_cast<std::size_t>(sent);
    }
  };
  send(&head, sizeof head);
  send(bytes.data(), bytes.size());
}

}  // namespace viscera
