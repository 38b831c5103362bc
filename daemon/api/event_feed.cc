#include "daemon/api/event_feed.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "calib/words/phrase_json.h"
#include "daemon/result/outcome_json.h"

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

using nlohmann::json;

template <typename T>
json or_null(const std::optional<T>& value, double factor = 1.0) {
  if (!value) return nullptr;
  if constexpr (std::is_same_v<T, double>) return *value * factor;
  return *value;
}

std::string hex(std::uint32_t value, int digits) { return fmt::format("{:0{}x}", value, digits); }

json to_json(const std::optional<calib::WorkDone>& planning) {
  if (!planning) return nullptr;
  return {{"step", own_name(planning->step)}, {"done", planning->share}};
}

json to_json(const drivers::RobotState& robot) {
  const drivers::RobotQuality& q = robot.quality;
  return {
      {"cycle_ms", robot.cycle_s * calib::kMsPerS},
      {"jitter_ms", q.jitter_s * calib::kMsPerS},
      {"longest_gap_ms", q.longest_gap_s * calib::kMsPerS},
      {"packets", robot.packets},
      {"gaps", q.gaps},
      {"bad_packets", q.bad_packets},
      {"late", robot.late},
      {"mode", to_string(robot.mode)},
      {"override_percent", robot.override_percent ? json(*robot.override_percent) : json(nullptr)},
      {"contact_input", to_string(robot.input_path)},
      {"stops_by_input", robot.stops_by_input},
      {"replies", q.replies},
      {"reply_ms",
       {{"p50", q.reply_p50_s * calib::kMsPerS},
        {"p99", q.reply_p99_s * calib::kMsPerS},
        {"p999", q.reply_p999_s * calib::kMsPerS},
        {"max", q.reply_max_s * calib::kMsPerS}}}};
}

json to_json(const std::optional<drivers::RoundTrip>& trip) {
  if (!trip) return nullptr;
  return {{"min", trip->min_s * calib::kMsPerS},
          {"p50", trip->p50_s * calib::kMsPerS},
          {"p99", trip->p99_s * calib::kMsPerS}};
}

json to_json(const drivers::ContactStatus& contact) {
  const drivers::ContactQuality& q = contact.quality;
  const drivers::ContactIdentity& id = contact.identity;
  return {{"protocol", id.protocol},
          {"firmware", fmt::format("{}.{}.{}", id.firmware[0], id.firmware[1], id.firmware[2])},
          {"uid", hex(id.uid, 8)},
          {"boot_id", id.boot_id},
          {"config_crc", hex(id.config_crc, 4)},
          {"in_contact", or_null(contact.in_contact)},
          {"loop_ok", or_null(contact.loop_ok)},
          {"self_test_ok", contact.self_test_ok},
          {"frames", q.frames},
          {"crc_errors", q.crc_errors},
          {"gaps", q.gaps},
          {"unknown_types", q.unknown_types},
          {"bounces", q.bounces},
          {"round_trip_ms", to_json(q.round_trip)},
          {"clock_sigma_us", or_null(q.clock_sigma_s, 1e6)},
          {"clock_drift_ppm", or_null(q.clock_drift_ppm)},
          {"heartbeat_jitter_ms", q.heartbeat_jitter_s * calib::kMsPerS},
          {"late_ms",
           {{"p50", q.late_p50_s * calib::kMsPerS},
            {"max", q.late_max_s * calib::kMsPerS},
            {"worst", q.late_worst_s * calib::kMsPerS},
            {"limit", std::chrono::duration<double, std::milli>(drivers::kHeartbeatLimit).count()},
            {"over", contact.delivery.late}}},
          {"sense_v", or_null(contact.sense_voltage_v)},
          {"contact_v", q.contact_voltage_v}};
}

json to_json(const std::optional<Waiting>& waiting, const calib::Language& language) {
  if (!waiting) return nullptr;
  return {{"robot", waiting->robot},
          {"contact", waiting->contact},
          {"left_s", waiting->left_s},
          {"start", words(waiting->start, language)}};
}

json to_json(const std::optional<ScheduleSeen>& schedule, const calib::Language& language) {
  if (!schedule) return nullptr;
  return {{"held", schedule->held.empty() ? json(nullptr) : json(words(schedule->held, language))},
          {"open", schedule->open},
          {"next_utc_s", or_null(schedule->next_utc_s)}};
}

json to_json(const std::shared_ptr<const LinkReport>& links) {
  if (!links) return nullptr;
  return {{"open", links->open},
          {"robot", to_json(links->robot)},
          {"contact", to_json(links->contact)}};
}

/// Degrees, of a linear unit millimetres.
template <class Angles>
json shown_joints(const Angles& angles_rad, bool linear_unit) {
  json list = json::array();
  for (const double angle : angles_rad)
    list.push_back(angle * (linear_unit && list.empty() ? calib::kMmPerM : calib::kDegPerRad));
  return list;
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
    feed_.poll();
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
void EventFeed::poll() {
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
  if (now - examined_at_ < kJointsPeriod && examined_) return;
  examined_ = true;
  examined_at_ = now;
  const Status status = source_.status();
  if (!status.links || !status.links->open || status.links == seen_) return;
  seen_ = status.links;
  // Before the first packet, and after the last, the joints are not measured.
  const drivers::RobotLink link = status.links->robot.link;
  if (link != drivers::RobotLink::kNotReferenced && link != drivers::RobotLink::kReady) return;
  if (status.links->robot.actual_rad.empty()) return;
  ++joints_.number;
  joints_.text = event("robot", "", joints_to_json(status.session, *seen_));
}

nlohmann::json touch_json(std::size_t index, const calib::Touch& touch, bool linear_unit) {
  json value{{"index", index},
             {"target", touch.target},
             {"set", to_string(touch.set)},
             {"joints_deg", shown_joints(touch.joint_rad, linear_unit)},
             {"time", touch.time},
             {"readings", touch.readings},
             {"spread_mm", touch.spread_m * calib::kMmPerM},
             {"speed_mm_s", touch.speed_m_s * calib::kMmPerM}};
  if (!touch.positioner_rad.empty())
    value["positioner_deg"] = shown_joints(touch.positioner_rad, false);
  return value;
}

json to_json(const InterruptionCounts& counts) {
  json all = json::object();
  for (std::size_t i = 0; i < counts.of.size(); ++i) all[kCountedCauses[i].name] = counts.of[i];
  return all;
}

std::string status_to_json(const Status& status, const calib::Language& language) {
  json value{{"seq", status.seq},
             {"session", status.session},
             {"kind", status.kind},
             {"load", status.load.empty() ? json(nullptr) : json(status.load)},
             {"phase", to_string(status.phase)},
             {"running", kActivePhases.has(status.phase) || status.phase == Phase::kStopping},
             {"target", status.target},
             {"touches", status.done},
             {"planned", status.total},
             {"residual_mm", or_null(status.residual_m, calib::kMmPerM)},
             {"goal_mm", or_null(status.goal_m, calib::kMmPerM)},
             {"u95_mm", or_null(status.u95_m, calib::kMmPerM)},
             {"mean_error_mm", or_null(status.mean_error_m, calib::kMmPerM)},
             {"finding", status.finding},
             {"stage", words(status.stage, language)},
             {"planning", to_json(status.planning)},
             {"why_ended", words(status.why_ended, language)},
             {"warnings", all_words(status.warnings, language)},
             {"time_left_s", or_null(status.time_left_s)},
             {"waiting", to_json(status.waiting, language)},
             {"interruptions", status.interruptions.total()},
             {"busy_repeats", status.interruptions.of_computer()},
             {"interruptions_by_cause", to_json(status.interruptions)},
             {"busy_left_s", or_null(status.busy_left_s)},
             {"robot", words(status.robot_words, language)},
             {"contact", words(status.contact_words, language)},
             {"outcome", outcome_with_words(status.outcome, language)},
             {"publish", or_null(status.outcome ? published(*status.outcome) : std::nullopt)},
             {"reasons", status.reasons},
             {"results", status.results_dir},
             {"arm",
              {{"motion", to_string(status.arm.motion)},
               {"packet_age_s", or_null(status.arm.packet_age_s)}}},
             {"links", to_json(status.links)},
             {"version", calib::software_version()},
             {"schedule", to_json(status.schedule, language)},
             {"anew", status.anew},
             {"resumable", status.resumable()},
             {"interrupted", nullptr},
             {"failure", nullptr}};
  if (status.interrupted) {
    value["interrupted"] = {{"session", status.interrupted->session},
                            {"touches", status.interrupted->touches},
                            {"planned", status.interrupted->planned},
                            {"started", status.interrupted->started},
                            {"ending", to_string(status.interrupted->ending)},
                            {"anew", status.interrupted->anew},
                            {"resumable", status.interrupted->resumable()},
                            {"kind", status.interrupted->kind},
                            {"failure", nullptr}};
    if (const auto& why = status.interrupted->failure)
      value["interrupted"]["failure"] = to_string(*why);
  }
  if (status.failure) {
    value["failure"] = {{"kind", to_string(status.failure->kind)},
                        {"detail", words(status.failure->detail, language)},
                        {"said", calib::to_json(status.failure->detail)}};
  }
  return dump(value);
}

std::string made_touch_to_json(const MadeTouch& made) {
  json value{{"session", made.session},
             {"index", made.index},
             {"target", made.touch.target},
             {"set", to_string(made.touch.set)},
             {"joints_deg", shown_joints(made.touch.joint_rad, made.linear_unit)},
             {"tip_mm", nullptr},
             {"residual_mm", or_null(made.residual_m, calib::kMmPerM)},
             {"u95_mm", or_null(made.u95_m, calib::kMmPerM)}};
  if (!made.touch.positioner_rad.empty())
    value["positioner_deg"] = shown_joints(made.touch.positioner_rad, false);
  if (made.tip_m) {
    const auto& [x, y, z] = *made.tip_m;
    value["tip_mm"] = {calib::kMmPerM * x, calib::kMmPerM * y, calib::kMmPerM * z};
  }
  return dump(value);
}

std::string joints_to_json(std::int64_t session, const LinkReport& links) {
  const drivers::AxisAngles& all = links.robot.actual_rad;
  const auto arm_end =
      all.end() - static_cast<std::ptrdiff_t>(std::min(links.positioner_axes, all.size()));
  const std::vector<double> arm(all.begin(), arm_end), turning(arm_end, all.end());
  json value{{"session", session}, {"joints_deg", shown_joints(arm, links.robot.linear_unit)}};
  if (!turning.empty()) value["positioner_deg"] = shown_joints(turning, false);
  return dump(value);
}

}  // namespace cellcal::daemon
