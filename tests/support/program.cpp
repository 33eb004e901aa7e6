#include "tests/support/program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

extern char** environ;

namespace viscera::test {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> all;
  for (std::string& word : words) all.push_back(word.data());
  all.push_back(nullptr);
  return all;
}

std::vector<std::string> environment(const fs::path& cache) {
  std::vector<std::string> all;
  for (char** entry = environ; *entry; ++entry) {
    const std::string text = *entry;
    if (!text.starts_with("VISCERA_CACHE=")) all.push_back(text);
  }
  if (!cache.empty()) all.push_back("VISCERA_CACHE=" + cache.string());
  return all;
}

void limit(int resource, const std::optional<std::size_t>& bytes) {
  if (!bytes) return;
  const rlimit limited = {.rlim_cur = *bytes, .rlim_max = *bytes};
  setrlimit(resource, &limited);
}

/// Reads what is there; closes the pipe at its end.
void drain(int& descriptor, std::string& into) {
  std::array<char, 4096> part;
  const ssize_t got = ::read(descriptor, part.data(), part.size());
  if (got > 0) {
    into.append(part.data(), static_cast<std::size_t>(got));
  } else if (got == 0 || errno != EINTR) {
    ::close(descriptor);
    descriptor = -1;
  }
}

ProgramResult run(std::vector<std::string> words, const ProgramCall& call) {
  std::vector<std::string> variables = call.variables;
  for (const std::string& one : environment(call.cache)) {
    const std::string name = one.substr(0, one.find('=') + 1);
    if (std::ranges::none_of(call.variables,
                             [&](const std::string& own) { return own.starts_with(name); }))
      variables.push_back(one);
  }
  const std::vector<char*> argv = pointers(words), envp = pointers(variables);
  ProgramResult result;
  int out[2], err[2];
  if (::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0) {
    ADD_FAILURE() << "no pipes";
    return result;
  }
  const auto started = Clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(Clock::now() - started).count();
  };
  const pid_t process = ::fork();
  if (process == 0) {
    const int nothing = ::open("/dev/null", O_RDONLY);
    ::dup2(nothing, STDIN_FILENO);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    limit(RLIMIT_FSIZE, call.greatest_file);
    limit(RLIMIT_AS, call.greatest_memory);
    limit(RLIMIT_CORE, 0);
    ::execvpe(argv[0], argv.data(), envp.data());
    ::_exit(127);
  }
  ::close(out[1]);
  ::close(err[1]);
  int status = 0;
  bool killed = false;
  while (out[0] >= 0 || err[0] >= 0) {
    std::array<pollfd, 2> waits = {{{out[0], POLLIN, 0}, {err[0], POLLIN, 0}}};
    ::poll(waits.data(), waits.size(), 50);
    if (waits[0].revents != 0) drain(out[0], result.out);
    if (waits[1].revents != 0) drain(err[0], result.err);
    if (!result.interrupted && call.interrupt_when && call.interrupt_when(result.err)) {
      ::kill(process, call.interrupt_signal);
      result.interrupted = true;
    }
    if (!killed && seconds() > call.timeout) {
      ::kill(process, SIGKILL);
      killed = true;
    }
  }
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  result.wall_s = seconds();
  if (WIFEXITED(status)) result.code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  EXPECT_FALSE(killed) << words[0] << " took longer than " << call.timeout << " s";
  return result;
}

void expect_ends_with(const fs::path& file, const std::string& end) {
  EXPECT_TRUE(file_text(file).ends_with(end)) << file << " isn't whole";
}

void expect_whole_table(const fs::path& file) {
  std::ifstream in(file);
  std::ptrdiff_t commas = -1;
  for (std::string line; std::getline(in, line);) {
    const std::ptrdiff_t found = std::count(line.begin(), line.end(), ',');
    if (commas < 0) commas = found;
    EXPECT_EQ(found, commas) << file << ": " << line;
  }
  expect_ends_with(file, "\n");
}

}  // namespace

std::string ProgramResult::told() const {
  return "exit code " + std::to_string(code) + ", signal " + std::to_string(signal) +
         "\n--- stdout\n" + out + "--- stderr\n" + err + "---";
}

ProgramResult run_program(const ProgramCall& call) {
  std::vector<std::string> words = call.arguments;
  words.insert(words.begin(), VISCERA_PROGRAM);
  return run(std::move(words), call);
}

ProgramResult run_command(const std::vector<std::string>& words) {
  return run(words, {});
}

void expect_failed(const ProgramResult& result, int code, const std::vector<std::string>& words) {
  EXPECT_EQ(result.code, code) << result.told();
  for (const std::string& word : words)
    EXPECT_NE(result.err.find(word), std::string::npos)
        << "missing \"" << word << "\" in " << result.told();
  for (const char* trace : {"terminate called", "Assertion", "what()", "Sanitizer", "core dumped"})
    EXPECT_EQ(result.err.find(trace), std::string::npos) << result.told();
  EXPECT_FALSE(result.err.empty());
  EXPECT_LT(result.err.size(), 2000u) << "that isn't one clear message: " << result.told();
}

void expect_refused(const ProgramResult& result, const std::vector<std::string>& words) {
  expect_failed(result, 2, words);
}

void expect_whole_files(const fs::path& folder) {
  if (!fs::exists(folder)) return;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const fs::path& file = entry.path();
    const std::string extension = file.extension().string();
    EXPECT_NE(extension, ".tmp") << file << " was left behind";
    EXPECT_EQ(file.filename().string().find("probe"), std::string::npos) << file;
    if (extension == ".json") {
      EXPECT_TRUE(nlohmann::json::accept(file_text(file))) << file << " isn't whole";
    } else if (extension == ".png") {
      expect_ends_with(file, std::string("IEND\xae\x42\x60\x82"));
    } else if (extension == ".html") {
      expect_ends_with(file, "</html>\n");
    } else if (extension == ".vtu" || extension == ".pvd") {
      expect_ends_with(file, "</VTKFile>\n");
    } else if (extension == ".csv") {
      expect_whole_table(file);
    } else if (extension == ".vdb") {
      EXPECT_EQ(run_program({.arguments = {"smoke-info", file.string()}}).code, 0) << file;
    } else if (extension == ".mp4") {
      EXPECT_EQ(run_command({"ffprobe", "-v", "error", file.string()}).code, 0) << file;
    }
  }
}

std::vector<fs::path> files_of(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == extension) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace viscera::test
