#pragma once
// Server-sent events for all followers.
//
//   event: status   id: N     a change of /v1/status, N its seq; of a series of changes in texts and
//                             figures only, the newest
//   event: touch    id: N.1   a recorded touch, published with status N
//   event: robot              the newest joints while a session runs; not numbered, never repeated
//   a comment                 after some seconds without events
//
// A client may resume after an id: nothing is lost or repeated. For an id older than the history the current
// status is sent first.

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/api/http/http.h"
#include "daemon/service/status.h"

namespace cellcal::daemon {

/// Position in the feed: after status `seq`, and after its touch or before it.
struct EventId {
  std::uint64_t seq = 0;
  bool touch = false;
};
/// "57" or "57.1".
std::optional<EventId> parse_event_id(std::string_view text);

class EventFeed {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  /// Subset of SessionService.
  struct Source {
    std::function<Status()> status;
    std::function<std::vector<Status>(std::uint64_t seq)> since;
  };
  explicit EventFeed(Source source, Clock clock = std::chrono::steady_clock::now)
      : source_(std::move(source)), clock_(std::move(clock)) {}

  /// Events after `since`; without it from the current status on. The stream must not outlive the feed.
  std::shared_ptr<Stream> follow(std::optional<EventId> since);

 private:
  class Follower;
  /// One serialised status, with its touch if any.
  struct Entry {
    std::uint64_t seq = 0;
    std::string status, touch;
    std::chrono::steady_clock::time_point at;  ///< time of serialisation
  };
  struct Joints {
    std::uint64_t number = 0;  ///< 0: none yet
    std::string text;
  };

  void poll();
  void examine_joints();

  Source source_;
  Clock clock_;
  std::mutex mutex_;
  std::deque<Entry> entries_;  ///< in order; complete except for outdated texts and figures
  std::shared_ptr<const LinkReport> seen_;
  bool examined_ = false;  ///< joints were requested at least once
  std::chrono::steady_clock::time_point examined_at_{};
  Joints joints_;
};

// Status of a session as JSON, without line breaks.

/// A recorded touch, for lists.
nlohmann::json touch_json(std::size_t index, const calib::Touch& touch, bool linear_unit);
/// Keyed by cause.
nlohmann::json to_json(const InterruptionCounts& counts);
/// `language`: of the links' and the failure's sentences.
std::string status_to_json(const Status& status, const calib::Language& language = {});
/// {"session","index","target","set","joints_deg","tip_mm","residual_mm","u95_mm"}, with a positioner also
/// "positioner_deg"
std::string made_touch_to_json(const MadeTouch& made);
/// {"session","joints_deg"}, with a positioner also "positioner_deg"
std::string joints_to_json(std::int64_t session, const LinkReport& links);

}  // namespace cellcal::daemon
