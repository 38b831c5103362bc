#pragma once
// What happens, as server-sent events, for all who follow.
//
//   event: status   id: N     a change of /v1/status, N its seq; where only words and figures change
//                             many times in a row, the newest of them
//   event: touch    id: N.1   a touch that was recorded, told of with status N
//   event: robot              the newest joints while a session runs; not numbered, never repeated
//   a comment                 when there was nothing for some seconds
//
// Who was given an id may go on behind it: nothing is lost or given twice. What lies too far back is
// not there any more; then the current status comes first.

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/http/message.h"
#include "daemon/service/status.h"

namespace cellcal::daemon {

/// Where somebody stands in what happened: behind status `seq`, and behind its touch or not.
struct EventId {
  std::uint64_t seq = 0;
  bool touch = false;
};
/// "57" or "57.1".
std::optional<EventId> parse_event_id(std::string_view text);

class EventFeed {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  /// As SessionService has them.
  struct Source {
    std::function<Status()> status;
    std::function<std::vector<Status>(std::uint64_t seq)> since;
  };
  explicit EventFeed(Source source, Clock clock = std::chrono::steady_clock::now)
      : source_(std::move(source)), clock_(std::move(clock)) {}

  /// Behind `since`; without it from the current status on. Lives no longer than the feed.
  std::shared_ptr<Stream> follow(std::optional<EventId> since);

 private:
  class Follower;
  /// One status, as text, with its touch where there is one.
  struct Entry {
    std::uint64_t seq = 0;
    std::string status, touch;
    std::chrono::steady_clock::time_point at;  ///< when it became text
  };
  struct Joints {
    std::uint64_t number = 0;  ///< 0: none yet
    std::string text;
  };

  void look();
  void look_at_joints();

  Source source_;
  Clock clock_;
  std::mutex mutex_;
  std::deque<Entry> entries_;  ///< in order, nothing left out but words and figures of the past
  std::shared_ptr<const LinkReport> seen_;
  bool looked_ = false;  ///< for joints, ever
  std::chrono::steady_clock::time_point looked_at_{};
  Joints joints_;
};

}  // namespace cellcal::daemon
