// Work that stops to ask, and goes on once it is answered: coroutines that may wait for each other,
// and a place where the innermost leaves its question.
#pragma once

#include <coroutine>
#include <exception>
#include <optional>
#include <utility>

namespace viscera {

/// What a coroutine returns that begins when it is first waited for or asked to go. Its caller
/// keeps it, and what its arguments refer to, until it has ended.
template <class T>
class Task {
 public:
  struct promise_type {
    std::optional<T> value;
    std::exception_ptr error;
    std::coroutine_handle<> waiting = std::noop_coroutine();

    Task get_return_object() {
      return Task(std::coroutine_handle<promise_type>::from_promise(*this));
    }
    std::suspend_always initial_suspend() noexcept { return {}; }
    struct Final {
      bool await_ready() noexcept { return false; }
      std::coroutine_handle<> await_suspend(std::coroutine_handle<promise_type> self) noexcept {
        return self.promise().waiting;
      }
      void await_resume() noexcept {}
    };
    Final final_suspend() noexcept { return {}; }
    void return_value(T result) { value = std::move(result); }
    void unhandled_exception() { error = std::current_exception(); }
  };

  Task(Task&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Task& operator=(Task&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Task() {
    if (handle_) handle_.destroy();
  }

  /// Until its first question, or its end.
  void begin() { handle_.resume(); }
  bool ended() const { return handle_.done(); }
  /// Of an ended one, once. Throws what it threw.
  T result() {
    if (handle_.promise().error) std::rethrow_exception(handle_.promise().error);
    return std::move(*handle_.promise().value);
  }

  /// In another coroutine: `co_await task`. Not in the condition of a statement that may throw: GCC
  /// 12 then ends the program. `if (const bool done = co_await task; !done)` is sound.
  bool await_ready() const noexcept { return false; }
  std::coroutine_handle<> await_suspend(std::coroutine_handle<> waiting) noexcept {
    handle_.promise().waiting = waiting;
    return handle_;
  }
  T await_resume() { return result(); }

 private:
  explicit Task(std::coroutine_handle<promise_type> handle) : handle_(handle) {}
  std::coroutine_handle<promise_type> handle_;
};

/// The questions of one Task and of those that it waits for: one at a time.
template <class Question, class Answer>
class Questions {
 public:
  /// In a coroutine: `Answer answer = co_await questions.ask(question)`.
  auto ask(Question question) {
    struct Asked {
      Questions& questions;
      bool await_ready() const noexcept { return false; }
      void await_suspend(std::coroutine_handle<> asking) noexcept { questions.asking_ = asking; }
      Answer await_resume() { return *std::exchange(questions.answer_, std::nullopt); }
    };
    question_ = std::move(question);
    return Asked{*this};
  }

  /// What the task waits for; null: nothing.
  const Question* open() const { return question_ ? &*question_ : nullptr; }
  /// The task goes on, until its next question or its end.
  void answer(Answer answer) {
    question_.reset();
    answer_ = std::move(answer);
    std::exchange(asking_, nullptr).resume();
  }

 private:
  std::optional<Question> question_;
  std::optional<Answer> answer_;
  std::coroutine_handle<> asking_;
};

}  // namespace viscera
