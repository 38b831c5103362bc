#include "daemon/plant/line/line_thread.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>

#include "daemon/runner/backend.h"

namespace cellcal::daemon::plant {

namespace asio = boost::asio;

void LineThread::start() {
  constexpr int kNice = 10;
  status.since = wall_clock_utc();
  asio::post(context, [this] { connect(); });
  thread = std::thread([this] {
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNice);
    const auto work = asio::make_work_guard(context);
    context.run();
  });
}

void LineThread::connect_later() {
  retry.expires_after(backoff.next());
  retry.async_wait([this](boost::system::error_code cancelled) {
    if (!cancelled) connect();
  });
}

bool LineThread::begin_farewell(std::chrono::milliseconds longest) {
  stopping = true;
  retry.cancel();
  if (!orderly) line.reset();  // the will is sent instead
  if (!is_up || !orderly) {
    context.stop();
    return false;
  }
  last.expires_after(longest);
  last.async_wait([this](boost::system::error_code cancelled) {
    if (!cancelled) context.stop();
  });
  return true;
}

void LineThread::set(const std::function<void(LineStatus&)>& change) {
  const std::lock_guard lock(status_mutex);
  change(status);
}

LineStatus LineThread::status_now() const {
  const std::lock_guard lock(status_mutex);
  return status;
}

}  // namespace cellcal::daemon::plant
