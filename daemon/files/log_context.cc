#include "daemon/files/log_context.h"

#include <mutex>

namespace cellcal::daemon {

namespace {

std::mutex g_mutex;
LogContext g_daemons;
thread_local const LogContext* t_scope = nullptr;

}  // namespace

void set_log_context(const LogContext& context) {
  const std::lock_guard lock(g_mutex);
  g_daemons = context;
}

LogScope::LogScope(LogContext context)
    : context_(std::move(context)), outer_(std::exchange(t_scope, &context_)) {}

LogScope::~LogScope() { t_scope = outer_; }

LogContext log_context() {
  LogContext context;
  {
    const std::lock_guard lock(g_mutex);
    context = g_daemons;
  }
  if (t_scope == nullptr) return context;
  const bool same_session = t_scope->session == 0 || t_scope->session == context.session;
  if (!same_session) context = LogContext{};
  if (t_scope->session != 0) context.session = t_scope->session;
  if (t_scope->touch) context.touch = t_scope->touch;
  if (!t_scope->phase.empty()) context.phase = t_scope->phase;
  if (!t_scope->failure.empty()) context.failure = t_scope->failure;
  context.event = t_scope->event;
  return context;
}

}  // namespace cellcal::daemon
