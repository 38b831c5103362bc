#include "daemon/api/http/clerk.h"

#include <algorithm>

namespace cellcal::daemon {

bool Clerk::post(const Request& request, std::function<void()> job) {
  const bool acts = request.method != "GET";
  const std::string& name = request.caller.name;
  {
    const std::lock_guard lock(mutex_);
    std::deque<Waiting>& waiting = acts ? acting_ : looking_;
    const auto own = static_cast<std::size_t>(std::count_if(
        waiting.begin(), waiting.end(), [&](const Waiting& one) { return one.name == name; }));
    if (waiting.size() >= (acts ? kMostActing : kMostLooking)) return false;
    if (own >= (acts ? kMostActingOfOne : kMostLookingOfOne)) return false;
    waiting.push_back({name, std::move(job)});
  }
  worker_.post([this] { do_next(); });
  return true;
}

void Clerk::do_next() {
  std::function<void()> job;
  {
    const std::lock_guard lock(mutex_);
    std::deque<Waiting>& waiting = acting_.empty() ? looking_ : acting_;
    job = std::move(waiting.front().job);
    waiting.pop_front();
  }
  job();
}

}  // namespace cellcal::daemon
