#include "daemon/plant/line/publisher.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/post.hpp>
#include <deque>
#include <map>

#include "calib/files/calibration_json.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/line/mqtt_line.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon::plant {

namespace asio = boost::asio;

namespace {

constexpr std::size_t kMostUnderWay = 16, kMostBytesUnderWay = std::size_t{16} << 20;
/// One disk access for up to this many.
constexpr std::size_t kAcknowledgedAtOnce = 32;
/// Interval of repeated warnings in the log.
constexpr std::chrono::hours kWarnAgain{1};
constexpr std::int64_t kNoRow = 0;  ///< presence, and removal of proposals

}  // namespace

struct Publisher::Impl : LineThread {
  explicit Impl(Parts given)
      : LineThread(given.first_wait, given.longest_wait, "[plant]"), parts(std::move(given)) {}

  /// Row and number of a sent message, to match the plant's confirmations.
  struct Sent {
    std::int64_t row = kNoRow, number = 0;
    std::string source;
    Worth worth = Worth::kTelemetry;
    std::size_t bytes = 0;  ///< size of the message
    std::int64_t session = 0;
    std::string kind;
  };

  CellName name() const { return {parts.config.plant, parts.config.cell}; }
  void connect() override;
  void up();
  void answered(int message, const std::optional<LineFailure>& refused);
  void heard(const std::string& topic, const std::string& payload);
  void await_stored(const Sent& sent);
  void hear(const Stored& news);
  void hear(const Proposal& proposal);
  void down(const LineFailure& lost);
  void pump();
  void send_waiting();
  bool send(const WaitingFact& fact);
  bool is_dealt_with(const WaitingFact& fact) const;
  bool has_room() const;
  bool broker_has_enough() const;
  LineFailure too_large() const;
  void warn_of(const LineFailure& too_large);
  void publish_backlog();
  MqttLine::Message presence(bool online, bool farewell) const;
  void forget_acknowledged();
  void hold(std::chrono::milliseconds time, const LineFailure& why);
  void stop();

  Parts parts;
  asio::steady_timer pause{context}, unstored{context};
  struct {
    std::string time, source;
    std::int64_t newest = 0;
  } connected;
  WaitingCount known;             ///< newest answer of the outbox
  std::map<int, Sent> under_way;  ///< by message
  std::map<std::int64_t, Sent>
      at_the_broker;  ///< results acknowledged by the broker on this line but not stored yet, by row
  std::map<std::int64_t, Sent> set_aside;  ///< too large for the broker of this line, by row
  /// Size for which the broker ended the previous line without announcing a limit: not sent on the next one.
  std::optional<std::size_t> ended_for, not_now;
  Stored stored;  ///< newest confirmation of the plant
  std::deque<WaitingFact> bite;
  std::int64_t read_to = 0;  ///< all rows up to this one are in flight or acknowledged
  std::vector<std::int64_t> acknowledged;
  struct {
    std::string words;
    std::chrono::steady_clock::time_point at;
  } warned;  ///< already logged, of facts too large for the broker
  OccurrenceLimit not_understood;
  bool held = false;
  std::atomic<bool> poked{false};
};

/// Will and birth of a line have the same time and number, so that a receiver of both orders the will later.
MqttLine::Message Publisher::Impl::presence(bool online, bool farewell) const {
  Presence words;
  words.of = name();
  words.online = online;
  words.farewell = farewell;
  words.journal = farewell ? known.source : connected.source;
  words.number = farewell ? known.newest : connected.newest;
  words.software = calib::software_version();
  words.time = farewell ? wall_clock_utc() : connected.time;
  words.mock = parts.mock;
  return {to_text({name(), Subject::kPresence, {}}), to_json(words), true};
}

void Publisher::Impl::connect() try {
  if (stopping) return;
  known = parts.outbox.count();
  connected = {wall_clock_utc(), known.source, known.newest};
  line = std::make_unique<MqttLine>(
      context, parts.config, presence(false, false),
      MqttLine::Events{
          [this] { up(); },
          [this](int message, std::optional<LineFailure> refused) { answered(message, refused); },
          [this](const std::string& topic, const std::string& payload) { heard(topic, payload); },
          [this](const LineFailure& failure) { down(failure); }},
      MqttLine::Times{.keepalive = parts.keepalive});
} catch (const OutboxError& failed) {  // the available numbers are unknown
  say({LineProblem::kJournal, failed.what()});
  connect_later();
}

void Publisher::Impl::up() {
  const bool is_news = has_come_up();
  under_way.clear();
  at_the_broker.clear();
  set_aside.clear();  // possibly another broker, or another limit
  not_now = std::exchange(ended_for, std::nullopt);
  bite.clear();
  read_to = 0;
  if (is_news)
    spdlog::info("[plant]: connected to {}:{} as {}/{}", parts.config.host, parts.config.port,
                 parts.config.plant, parts.config.cell);
  try {
    line->listen({to_text({name(), Subject::kStored, {}}), proposals_to(name())});
    under_way[line->publish(presence(true, false))] = {};
  } catch (const NotPublished& lost) {
    say({lost.problem, lost.what()});
  }
  held = false;
  pump();
}

void Publisher::Impl::down(const LineFailure& lost) {
  const bool was_up = is_up;
  const LineFailure failure = has_gone(lost, parts.config);
  if (was_up && failure.problem == LineProblem::kTooLarge)
    for (const auto& [message, sent] : under_way)
      ended_for = std::max(ended_for.value_or(0), sent.bytes);
  pause.cancel();
  go_on_after(failure);
}

void Publisher::Impl::hold(std::chrono::milliseconds time, const LineFailure& why) {
  say(why);
  held = true;
  pause.expires_after(time);
  pause.async_wait([this](boost::system::error_code cancelled) {
    if (cancelled) return;
    held = false;
    pump();
  });
}

void Publisher::Impl::answered(int message, const std::optional<LineFailure>& refused) {
  const auto found = under_way.find(message);
  if (found == under_way.end()) return;
  const Sent sent = found->second;
  under_way.erase(found);
  if (refused && refused->problem == LineProblem::kTooLarge && sent.row != kNoRow) {
    set_aside.emplace(sent.row, sent);
  } else if (refused && !(sent.row == kNoRow && refused->problem == LineProblem::kNoCollector)) {
    hold(parts.refused_wait, *refused);
  } else if (sent.row != kNoRow) {
    backoff.reset();
    if (sent.worth == Worth::kTelemetry ||
        (stored.journal == sent.source && stored.has(sent.number)))
      acknowledged.push_back(sent.row);
    else
      await_stored(sent);
    set([](LineStatus& now) { ++now.acknowledged; });
  }
  if (stopping) {
    if (under_way.empty() && line) line->close();
    return;
  }
  pump();
}

LineFailure Publisher::Impl::too_large() const {
  const Sent& oldest = set_aside.begin()->second;
  const auto most = line->largest_packet();
  return {
      LineProblem::kTooLarge,
      fmt::format(
          "fact {}: {} bytes ({} of session {}), more than broker {}:{} accepts{}{}. Set "
          "message_size_limit there to {}, max_packet_size to twice that or not at all, and "
          "restart it. Until then it waits; others are sent",
          oldest.number, oldest.bytes, oldest.kind, oldest.session, parts.config.host,
          parts.config.port, most ? fmt::format(" (limit {})", *most) : "",
          set_aside.size() > 1 ? fmt::format("; {} more facts likewise", set_aside.size() - 1) : "",
          kLargestMessage)};
}

/// Always in the status; in the log once an hour, however often the line is lost.
void Publisher::Impl::warn_of(const LineFailure& too_large) {
  const auto now = std::chrono::steady_clock::now();
  if (warned.words == too_large.words && now - warned.at < kWarnAgain) {
    set([&](LineStatus& status_now) {
      status_now.problem = too_large.problem;
      status_now.words = too_large.words;
    });
    return;
  }
  warned = {too_large.words, now};
  say(too_large);
}

/// The sender is unverified: malformed messages are ignored.
void Publisher::Impl::heard(const std::string& text, const std::string& payload) try {
  const auto topic = topic_of(text);
  if (!topic || topic->of != name() || payload.empty()) return;
  if (topic->subject == Subject::kStored) hear(stored_from_json(payload, *topic));
  if (topic->subject == Subject::kProposal) hear(proposal_from_json(payload, *topic));
} catch (const std::exception& wrong) {
  if (const auto messages = not_understood.count(std::chrono::steady_clock::now()))
    spdlog::warn("[plant]: {} messages not understood, the newest: {}", *messages,
                 printable(wrong.what()));
}

/// Results that the broker has but that are not stored in time are sent again: they were lost on the way.
void Publisher::Impl::await_stored(const Sent& sent) {
  const bool first = at_the_broker.empty();
  at_the_broker[sent.row] = sent;
  if (!first) return;
  unstored.expires_after(parts.stored_wait);
  unstored.async_wait([this](boost::system::error_code cancelled) {
    if (cancelled || at_the_broker.empty()) return;
    at_the_broker.clear();
    bite.clear();
    read_to = 0;
    pump();
  });
}

void Publisher::Impl::hear(const Stored& news) {
  stored = news;
  const auto is_stored = [&](const auto& one) {
    const bool has = one.second.source == stored.journal && stored.has(one.second.number);
    if (has) acknowledged.push_back(one.first);
    return has;
  };
  // Repeated confirmations without news have no effect.
  if (std::erase_if(at_the_broker, is_stored) + std::erase_if(set_aside, is_stored) > 0) pump();
}

void Publisher::Impl::hear(const Proposal& proposal) {
  if (!parts.proposal || !parts.proposal(proposal) || stopping || !is_up) return;
  try {
    under_way[line->publish({to_text({name(), Subject::kProposal, proposal.id}), "", true})] = {};
  } catch (const NotPublished& lost) {
    say({lost.problem, lost.what()});
  }
}

/// Acknowledged facts are removed from the disk; while that fails they are not sent again.
void Publisher::Impl::forget_acknowledged() {
  if (acknowledged.empty()) return;
  parts.outbox.acknowledge(acknowledged);
  acknowledged.clear();
}

void Publisher::Impl::pump() try {
  if (acknowledged.size() >= kAcknowledgedAtOnce || under_way.empty()) forget_acknowledged();
  if (!is_up || stopping) return;
  if (held) {  // restarts from the oldest afterwards, to keep the order
    bite.clear();
    read_to = 0;
    return;
  }
  send_waiting();
} catch (const OutboxError& failed) {
  hold(parts.journal_wait, {LineProblem::kJournal, failed.what()});
}

bool Publisher::Impl::has_room() const {
  std::size_t bytes = 0;
  for (const auto& [message, sent] : under_way) bytes += sent.bytes;
  return under_way.size() < kMostUnderWay && bytes < kMostBytesUnderWay;
}

/// The broker's queue is not intended for a week of unstored results.
bool Publisher::Impl::broker_has_enough() const {
  std::size_t bytes = 0;
  for (const auto& [row, sent] : at_the_broker) bytes += sent.bytes;
  return at_the_broker.size() >= parts.most_unstored || bytes >= kMostBytesUnderWay;
}

/// Nothing is in flight; sets the reason in the status.
void Publisher::Impl::publish_backlog() {
  known = parts.outbox.count();
  if (broker_has_enough()) {
    say({LineProblem::kNotStored,
         fmt::format("broker {}:{}: {} results not stored by the plant, no more are sent. Start "
                     "cellcal-fleet, or see its log; nothing is lost meanwhile",
                     parts.config.host, parts.config.port, at_the_broker.size())});
  } else if (!set_aside.empty() && known.rows > 0) {
    warn_of(too_large());
  } else if (known.elsewhere > 0) {
    say({LineProblem::kRenamed,
         fmt::format(
             "{} unsent messages under the old name {}; [plant] is {}/{} now. Set plant and cell "
             "back until they are sent, or add former = [\"{}\"] to send them under the new name",
             known.elsewhere, known.elsewhere_address, parts.config.plant, parts.config.cell,
             known.elsewhere_address)});
  } else {
    set([](LineStatus& now) {
      now.problem = LineProblem::kNone;
      now.words.clear();
    });
  }
}

void Publisher::Impl::send_waiting() {
  if (read_to == 0 && !under_way.empty() && !acknowledged.empty()) forget_acknowledged();
  while (is_up && !held && has_room() && !broker_has_enough()) {
    if (bite.empty()) {
      auto rows = parts.outbox.facts(read_to, kMostUnderWay);
      std::move(rows.begin(), rows.end(), std::back_inserter(bite));
      if (bite.empty()) break;
    }
    if (!is_dealt_with(bite.front()) && !send(bite.front())) return;
    read_to = bite.front().row;
    bite.pop_front();
  }
  if (under_way.empty()) {
    forget_acknowledged();
    if (!held) publish_backlog();
  }
}

bool Publisher::Impl::is_dealt_with(const WaitingFact& fact) const {
  return at_the_broker.contains(fact.row) || set_aside.contains(fact.row) ||
         std::any_of(under_way.begin(), under_way.end(),
                     [&](const auto& one) { return one.second.row == fact.row; });
}

bool Publisher::Impl::send(const WaitingFact& fact) {
  if (fact.source == stored.journal && stored.has(fact.number)) {  // sent on an earlier line
    acknowledged.push_back(fact.row);
    return true;
  }
  const Sent sent{fact.row,         fact.number,  fact.source, fact.worth,
                  fact.text.size(), fact.session, fact.kind};
  if (not_now && sent.bytes >= *not_now) {
    set_aside.emplace(sent.row, sent);
    return true;
  }
  try {
    under_way[line->publish({to_text({name(), Subject::kFact, fact.kind}), fact.text, false})] =
        sent;
    return true;
  } catch (const NotPublished& refused) {
    if (refused.problem != LineProblem::kTooLarge) return false;
    set_aside.emplace(sent.row, sent);
    return true;
  }
}

void Publisher::Impl::stop() {
  pause.cancel();
  unstored.cancel();
  if (!begin_farewell(parts.farewell)) return;
  try {
    known = parts.outbox.count();
  } catch (const OutboxError&) {  // another name is configured by now: the last presence is kept
  }
  try {
    under_way[line->publish(presence(false, true))] = {};
  } catch (const NotPublished&) {  // the will is sent instead
    context.stop();
  }
}

Publisher::Publisher(Parts parts) : impl_(std::make_unique<Impl>(std::move(parts))) {
  impl_->start();
}

Publisher::~Publisher() {
  asio::post(impl_->context, [impl = impl_.get()] { impl->stop(); });
  impl_->thread.join();
  try {
    impl_->forget_acknowledged();
  } catch (const OutboxError& kept) {
    spdlog::warn("[plant]: {}; stored results are sent again", kept.what());
  }
}

void Publisher::poke() {
  if (impl_->poked.exchange(true)) return;
  asio::post(impl_->context, [impl = impl_.get()] {
    impl->poked = false;
    impl->pump();
  });
}

void Publisher::close_with_will() {
  asio::post(impl_->context, [impl = impl_.get()] { impl->orderly = false; });
}

LineStatus Publisher::status() const { return impl_->status_now(); }

const PlantConfig& Publisher::config() const { return impl_->parts.config; }

}  // namespace cellcal::daemon::plant
