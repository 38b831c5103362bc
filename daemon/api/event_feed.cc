#include "daemon/api/event_feed.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "daemon/api/status_json.h"

namespace cellcal::daemon {

namespace {

using std::chrono::steady_clock;

/// One touch takes about twenty statuses: the last fifty touches, a few megabytes.
constexpr std::size_t kMostEntries = 1024;
/// Per piece, which bounds the memory of a follower.
constexpr std::size_t kMostInOnePiece = 64;
constexpr std::chrono::milliseconds kJointsPeriod{200};
constexpr std::chrono::seconds kQuiet{5};
/// Time for which the serialised newest status may be reused.
constexpr std::chrono::milliseconds kSoon{500};

std::string event(const char* name, const std::string& id, const std::string& data) {
  const std::string numbered = id.empty() ? "" : "id: " + id + "\n";
  return fmt::format("event: {}\n{}data: {}\n\n", name, numbered, data);
}

/// True if `next` only updates texts and figures of `status`.
bool is_outdone(const Status& status, const Status& next) {
  return !status.made && status.session == next.session && status.phase == next.phase &&
         status.done == next.done && status.target == next.target;
}

}  // namespace

std::optional<EventId> parse_event_id(std::string_view text) {
  EventId id;
  if (text.ends_with(".1")) {
    id.touch = true;
    text.remove_suffix(2);
  }
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), id.seq);
  if (code != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return id;
}

/// Stream of one client, with its position in the feed.
class EventFeed::Follower final : public Stream {
 public:
  Follower(EventFeed& feed, std::optional<EventId> since)
      : feed_(feed), since_(since), given_at_(feed.clock_()) {
    if (since_ && since_->seq == 0) since_->touch = true;  // before all sessions
  }

  std::optional<std::string> next() override {
    const std::lock_guard lock(feed_.mutex_);
    feed_.look();
    const steady_clock::time_point now = feed_.clock_();
    std::string piece;
    if (!begun_) {
      begun_ = true;
      begin(piece);
    } else if (!can_go_on()) {
      return std::nullopt;
    }
    go_on(piece);
    if (feed_.joints_.number > joints_) {
      joints_ = feed_.joints_.number;
      piece += feed_.joints_.text;
    }
    if (piece.empty() && now - given_at_ >= kQuiet) piece = ":\n\n";
    if (!piece.empty()) given_at_ = now;
    return piece;
  }

 private:
  bool can_go_on() const {
    const std::deque<Entry>& entries = feed_.entries_;
    const std::uint64_t oldest = entries.front().seq, newest = entries.back().seq;
    return since_ && since_->seq <= newest && oldest <= since_->seq + (since_->touch ? 1 : 0);
  }

  /// The newest status outlives the link data serialised with it: later it is serialised anew.
  std::string text_of(const Entry& entry) const {
    if (entry.seq == feed_.entries_.back().seq && feed_.clock_() - entry.at > kSoon) {
      const Status now = feed_.source_.status();
      if (now.seq == entry.seq)
        return event("status", std::to_string(now.seq), status_to_json(now));
    }
    return entry.status;
  }

  void begin(std::string& piece) {
    // The newest joints are sent first.
    joints_ = feed_.joints_.number > 0 ? feed_.joints_.number - 1 : 0;
    if (since_ && can_go_on()) return;
    const Entry& newest = feed_.entries_.back();
    piece += text_of(newest);
    // The touch is not sent: the client has to request the session's touches anyway.
    since_ = EventId{newest.seq, true};
  }

  void go_on(std::string& piece) {
    const std::deque<Entry>& entries = feed_.entries_;
    auto at =
        std::lower_bound(entries.begin(), entries.end(), since_->seq,
                         [](const Entry& entry, std::uint64_t seq) { return entry.seq < seq; });
    if (at != entries.end() && at->seq == since_->seq) {
      if (!since_->touch) piece += at->touch;
      ++at;
    }
    since_->touch = true;
    for (std::size_t given = 0; at != entries.end() && given < kMostInOnePiece; ++at, ++given) {
      piece += text_of(*at) + at->touch;
      since_ = EventId{at->seq, true};
    }
  }

  EventFeed& feed_;
  std::optional<EventId> since_;  ///< none: current data only
  std::uint64_t joints_ = 0;
  steady_clock::time_point given_at_;
  bool begun_ = false;
};

std::shared_ptr<Stream> EventFeed::follow(std::optional<EventId> since) {
  return std::make_shared<Follower>(*this, since);
}

/// Fetches the changes since the last call. Each is serialised once, regardless of the number of followers.
void EventFeed::look() {
  std::vector<Status> news;
  if (entries_.empty()) {
    news = source_.since(0);
    if (news.empty()) news.push_back(source_.status());  // no change yet
  } else {
    news = source_.since(entries_.back().seq);
  }
  const bool gap =
      !entries_.empty() && !news.empty() && news.front().seq != entries_.back().seq + 1;
  if (gap) entries_.clear();  // the feed cannot be continued from before the gap
  for (std::size_t i = 0; i < news.size(); ++i) {
    if (i + 1 < news.size() && is_outdone(news[i], news[i + 1])) continue;
    const Status& status = news[i];
    Entry entry{status.seq, event("status", std::to_string(status.seq), status_to_json(status)), "",
                clock_()};
    if (status.made) {
      entry.touch =
          event("touch", fmt::format("{}.1", status.seq), made_touch_to_json(*status.made));
    }
    entries_.push_back(std::move(entry));
  }
  while (entries_.size() > kMostEntries) entries_.pop_front();
  examine_joints();
}

void EventFeed::examine_joints() {
  const steady_clock::time_point now = clock_();
  if (now - looked_at_ < kJointsPeriod && looked_) return;
  looked_ = true;
  looked_at_ = now;
  const Status status = source_.status();
  if (!status.links || !status.links->open || status.links == seen_) return;
  seen_ = status.links;
  if (status.links->robot.actual_rad.empty()) return;
  ++joints_.number;
  joints_.text = event("robot", "", joints_to_json(status.session, seen_->robot.actual_rad));
}

}  // namespace cellcal::daemon
