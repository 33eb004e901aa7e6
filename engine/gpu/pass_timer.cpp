#include "engine/gpu/pass_timer.h"

#include <epoxy/gl.h>

namespace viscera {

PassTimer::~PassTimer() {
  if (!queries_.empty()) glDeleteQueries(static_cast<GLsizei>(queries_.size()), queries_.data());
}

void PassTimer::stamp() {
  if (used_ == queries_.size()) {
    GLuint query = 0;
    glCreateQueries(GL_TIMESTAMP, 1, &query);
    queries_.push_back(query);
  }
  glQueryCounter(queries_[used_++], GL_TIMESTAMP);
}

void PassTimer::start() {
  used_ = 0;
  names_.clear();
  stamp();
}

void PassTimer::mark(const char* name) {
  names_.push_back(name);
  stamp();
}

void PassTimer::skip() {
  mark(nullptr);
}

std::vector<PassTime> PassTimer::finish() {
  std::vector<GLuint64> times(used_, 0);
  for (std::size_t i = 0; i < used_; ++i) {
    glGetQueryObjectui64v(queries_[i], GL_QUERY_RESULT, &times[i]);
  }
  std::vector<PassTime> passes;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (names_[i] == nullptr) continue;
    passes.push_back({names_[i], 1e-9 * static_cast<double>(times[i + 1] - times[i])});
  }
  return passes;
}

}  // namespace viscera
