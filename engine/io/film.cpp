#include "engine/io/film.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "engine/io/atomic_file.h"

extern char** environ;

namespace viscera {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLastWords = 600;  // bytes of ffmpeg's messages that an error quotes

std::string reason(int error_number) {
  return std::generic_category().message(error_number);
}

std::vector<std::string> ffmpeg_arguments(const fs::path& output, int width, int height, int fps) {
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  // Without the matrix named, ffmpeg converts by BT.601 and players show BT.709: wrong reds.
  const std::string convert = "scale=out_color_matrix=bt709:out_range=tv";
  // A key frame every half second: a scrubber decodes from the last one before where it stops.
  // Without -xerror a disk that fills up at the end still gives exit code 0.
  // clang-format off
  return {"ffmpeg", "-hide_banner", "-loglevel", "error", "-xerror", "-nostdin", "-y",
          "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", size,
          "-framerate", std::to_string(fps), "-i", "pipe:0",
          "-vf", convert, "-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-g", std::to_string(std::max(1, fps / 2)),
          "-pix_fmt", "yuv420p", "-color_range", "tv", "-colorspace", "bt709",
          "-color_primaries", "bt709", "-color_trc", "bt709", "-movflags", "+faststart",
          "-f", "mp4", "file:" + fs::absolute(output).string()};
  // clang-format on
}

/// A descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int value = -1) : value_(value) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(Descriptor&& other) noexcept {
    close();
    value_ = std::exchange(other.value_, -1);
    return *this;
  }
  void close() {
    if (value_ >= 0) ::close(std::exchange(value_, -1));
  }
  int get() const { return value_; }

 private:
  int value_;
};

/// errno of the spawn, or 0. `input` and `messages` become the program's stdin and stderr.
int spawn(const std::vector<std::string>& arguments, int input, int messages, pid_t& process) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, messages, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  // Its own process group: a Ctrl-C at the terminal is ours to answer, ffmpeg ends with its input.
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int error = posix_spawnp(&process, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error;
}

}  // namespace

struct Film::Data {
  PendingFile pending;
  std::size_t frame_bytes = 0;
  std::size_t frames = 0;
  Descriptor input, messages;
  pid_t process = -1;
  std::chrono::milliseconds patience{};
  bool gave_up = false;

  explicit Data(fs::path file) : pending(std::move(file)) {}

  ~Data() {
    if (process > 0) ::kill(process, SIGKILL);
    wait();
  }

  /// What has no end within the patience is ended.
  int wait_patiently() {
    using Clock = std::chrono::steady_clock;
    constexpr auto kLook = std::chrono::milliseconds(5);
    siginfo_t ended = {};
    for (const auto until = Clock::now() + patience; Clock::now() < until;
         std::this_thread::sleep_for(kLook))
      if (::waitid(P_PID, static_cast<id_t>(process), &ended, WEXITED | WNOWAIT | WNOHANG) == 0 &&
          ended.si_pid == process)
        return wait();
    return give_up();
  }

  int give_up() {
    gave_up = true;
    if (process > 0) ::kill(process, SIGKILL);
    return wait();
  }

  /// The exit status as waitpid gives it; 0 when nothing runs any more.
  int wait() {
    int status = 0;
    if (process > 0) {
      while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
      }
    }
    process = -1;
    return status;
  }

  std::string last_words() const {
    const off_t size = ::lseek(messages.get(), 0, SEEK_END);
    const off_t begin = std::max<off_t>(0, size - static_cast<off_t>(kLastWords));
    std::string text(static_cast<std::size_t>(std::max<off_t>(0, size - begin)), '\0');
    const ssize_t got = ::pread(messages.get(), text.data(), text.size(), begin);
    text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    if (begin > 0) text.erase(0, text.find('\n') + 1);  // a line cut in two
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text;
  }

  Error failed(int status) const {
    std::string text = pending.file().string() + ": ffmpeg couldn't make the film";
    if (gave_up)
      text += " (it did nothing for " + std::to_string(patience.count()) + " ms)";
    else if (WIFEXITED(status))
      text += " (exit code " + std::to_string(WEXITSTATUS(status)) + ")";
    else if (WIFSIGNALED(status))
      text += " (ended by signal " + std::to_string(WTERMSIG(status)) + ")";
    const std::string words = last_words();
    return Error(words.empty() ? text : text + ":\n" + words);
  }
};

Film::Film(std::unique_ptr<Data> data) : data_(std::move(data)) {}
Film::~Film() = default;

Result<std::unique_ptr<Film>> Film::start(const fs::path& file, int width, int height,
                                          const Settings& settings) {
  const int frames_per_second = settings.frames_per_second;
  if (width < 2 || height < 2 || width % 2 != 0 || height % 2 != 0 || frames_per_second < 1) {
    return failure(file.string() + ": a film needs an even width and height and at least 1 frame " +
                   "a second, found " + std::to_string(width) + " x " + std::to_string(height) +
                   " at " + std::to_string(frames_per_second));
  }
  // Tried here: ffmpeg would say so only after the first frames.
  if (auto probe = AtomicFile::create(file); !probe) return std::unexpected(probe.error());

  auto data = std::make_unique<Data>(file);
  data->frame_bytes = 3ull * width * height;
  data->patience = settings.patience;
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    return failure(file.string() + ": no pipe to ffmpeg: " + reason(errno));
  }
  data->input = Descriptor(ends[0]);
  const auto microseconds =
      std::chrono::duration_cast<std::chrono::microseconds>(settings.patience).count();
  const timeval longest{microseconds / 1'000'000, microseconds % 1'000'000};
  ::setsockopt(ends[0], SOL_SOCKET, SO_SNDTIMEO, &longest, sizeof longest);
  const Descriptor child_input(ends[1]);
  // Messages go to memory, so that a talkative ffmpeg never waits for a reader.
  data->messages = Descriptor(::memfd_create("ffmpeg", MFD_CLOEXEC));
  if (data->messages.get() < 0) {
    return failure(file.string() + ": no memory for ffmpeg's messages: " + reason(errno));
  }
  const int error =
      spawn(ffmpeg_arguments(data->pending.temporary(), width, height, frames_per_second),
            child_input.get(), data->messages.get(), data->process);
  if (error != 0) {
    data->process = -1;
    return failure(file.string() + ": the film needs the program ffmpeg on the PATH: " +
                   reason(error) + " (on Debian: apt-get install ffmpeg)");
  }
  return std::unique_ptr<Film>(new Film(std::move(data)));
}

Result<void> Film::add(std::span<const std::uint8_t> rgb) {
  Data& data = *data_;
  if (rgb.size() != data.frame_bytes) {
    return failure(data.pending.file().string() + ": expected frames of " +
                   std::to_string(data.frame_bytes) + " bytes, found " +
                   std::to_string(rgb.size()));
  }
  if (data.process < 0) return failure(data.pending.file().string() + ": the film has ended");
  while (!rgb.empty()) {
    // A socket and not a pipe, because it can say no without raising SIGPIPE.
    const ssize_t sent = ::send(data.input.get(), rgb.data(), rgb.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) {
      const bool waited = errno == EAGAIN || errno == EWOULDBLOCK;
      data.input.close();
      if (waited) return std::unexpected(data.failed(data.give_up()));
      return std::unexpected(data.failed(data.wait_patiently()));
    }
    rgb = rgb.subspan(static_cast<std::size_t>(sent));
  }
  ++data.frames;
  return {};
}

Result<void> Film::finish() {
  Data& data = *data_;
  if (data.process < 0) return failure(data.pending.file().string() + ": the film has ended");
  data.input.close();
  const int status = data.wait_patiently();
  if (data.frames == 0) return failure(data.pending.file().string() + ": a film without frames");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    return std::unexpected(data.failed(status));
  }
  return data.pending.commit();
}

}  // namespace viscera
