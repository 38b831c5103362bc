#include "daemon/plant/publisher/publisher.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "calib/files/calibration_json.h"
#include "daemon/files/printable.h"
#include "daemon/plant/line/backoff.h"
#include "daemon/plant/line/mqtt_line.h"
#include "daemon/plant/messages/fact_json.h"
#include "daemon/plant/messages/presence.h"
#include "daemon/plant/messages/stored.h"
#include "daemon/plant/publisher/reporter.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon::plant {

namespace asio = boost::asio;

namespace {

constexpr std::size_t kMostUnderWay = 16, kMostBytesUnderWay = std::size_t{16} << 20;
/// The disk is waited for once for so many.
constexpr std::size_t kAcknowledgedAtOnce = 32;
/// Until the log has the same warning once more.
constexpr std::chrono::hours kWarnAgain{1};
constexpr std::int64_t kNoRow = 0;  ///< presence, and proposals that are taken away
constexpr int kNice = 10;
constexpr double kBytesPerMegabyte = 1e6;

}  // namespace

struct Publisher::Impl : std::enable_shared_from_this<Publisher::Impl> {
  explicit Impl(Parts given)
      : parts(std::move(given)),
        retry(context),
        pause(context),
        health(context),
        last(context),
        unstored(context),
        backoff(parts.first_wait, parts.longest_wait) {}

  /// Who a row is, for what the plant says of it.
  struct Sent {
    std::int64_t row = kNoRow, number = 0;
    std::string source;
    Worth worth = Worth::kTelemetry;
    std::size_t bytes = 0;  ///< of the message
    std::int64_t session = 0;
    std::string kind;
  };

  CellName name() const { return {parts.config.plant, parts.config.cell}; }
  void start();
  void begin();
  void rest();
  void go_on();
  void connect();
  void connect_later();
  void up();
  void answered(int message, const std::optional<LineFailure>& refused);
  void heard(const std::string& topic, const std::string& payload);
  void await_stored(const Sent& sent);
  void hear(const Stored& news);
  void hear(const Proposal& proposal);
  void down(const LineFailure& failure);
  void pump();
  void send_waiting();
  bool send(const WaitingReport& row);
  bool is_dealt_with(const WaitingReport& row) const;
  bool has_room() const;
  bool broker_has_enough() const;
  void give_up(const Sent& sent);
  LineFailure too_large() const;
  void warn_of(const LineFailure& too_large);
  void say_what_waits();
  Fact fact_of(const WaitingReport& row);
  MqttLine::Message presence(bool online, bool farewell) const;
  void forget_acknowledged();
  void hold(std::chrono::milliseconds time, const LineFailure& why);
  void tell_health();
  void stop();
  void say(const LineFailure& failure);
  void set(const std::function<void(LineStatus&)>& change) {
    const std::lock_guard lock(status_mutex);
    change(status);
  }

  Parts parts;
  asio::io_context context;
  std::shared_ptr<const PlantReporter> reporter;
  std::unique_ptr<MqttLine> line;
  asio::steady_timer retry, pause, health, last, unstored;
  Backoff backoff;
  struct {
    std::string time, source;
    std::int64_t newest = 0;
  } connected;
  std::map<int, Sent> under_way;  ///< by message
  std::map<std::int64_t, Sent>
      at_the_broker;  ///< results that it has acknowledged on this line and nobody has stored, by row
  std::map<std::int64_t, Sent> set_aside;  ///< too large for the broker of this line, by row
  /// Bytes for which the broker ended the line before, without a word of its limit before that: not sent on the next one.
  std::optional<std::size_t> ended_for, not_now;
  Stored stored;  ///< as the plant has said last
  std::deque<WaitingReport> bite;
  std::int64_t read_to = 0;  ///< row up to which all is under way or acknowledged
  std::vector<std::int64_t> acknowledged;
  std::set<std::int64_t> logged_damaged;  ///< rows of which the log has it
  struct {
    std::string words;
    std::chrono::steady_clock::time_point at;
  } warned;  ///< in the log, of what is too large for the broker
  bool is_up = false, held = false, stopping = false;
  std::atomic<bool> poked{false};
  mutable std::mutex status_mutex;
  LineStatus status;
  std::thread thread;
};

void Publisher::Impl::say(const LineFailure& failure) {
  bool news = false;
  set([&](LineStatus& now) {
    news = now.words != failure.words;
    now.problem = failure.problem;
    now.words = failure.words;
  });
  if (news && failure.problem != LineProblem::kNone) spdlog::warn("[plant]: {}", failure.words);
}

void Publisher::Impl::start() {
  set([](LineStatus& now) { now.since = wall_clock_utc(); });
  // A poke holds no publisher back from its end.
  const std::weak_ptr<Impl> weak = weak_from_this();
  reporter = std::make_shared<const PlantReporter>(PlantReporter::Parts{
      parts.config.touches,
      static_cast<std::int64_t>(parts.config.outbox_megabytes * kBytesPerMegabyte), name(),
      parts.config.former, parts.results_dir, [weak] {
        const auto self = weak.lock();
        if (!self || self->poked.exchange(true)) return;
        asio::post(self->context, [raw = self.get()] {
          raw->poked = false;
          raw->pump();
        });
      }});
  begin();  // what may fail comes before the journal says anything to it
  try {
    parts.journal.report_to(reporter);
  } catch (...) {
    rest();
    throw;
  }
  asio::post(context, [this] {
    connect();
    if (parts.health) tell_health();
  });
}

void Publisher::Impl::begin() {
  thread = std::thread([this] {
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNice);
    const auto work = asio::make_work_guard(context);
    context.run();
  });
}

/// Nothing is sent any more; the journal reports to it all the same.
void Publisher::Impl::rest() {
  if (!thread.joinable()) return;
  asio::post(context, [this] { stop(); });
  thread.join();
  line.reset();
  last.cancel();
  set([](LineStatus& now) {
    if (std::exchange(now.connected, false)) now.since = wall_clock_utc();
  });
  try {
    forget_acknowledged();
  } catch (const JournalError& kept) {
    spdlog::warn("[plant]: {}; what the plant has is sent once more", kept.what());
  }
}

/// Behind rest().
void Publisher::Impl::go_on() try {
  context.restart();
  stopping = is_up = false;
  begin();
  asio::post(context, [this] {
    connect();
    if (parts.health) tell_health();
  });
} catch (const std::system_error& none) {
  spdlog::error("[plant]: no thread ({}). Restart cellcald when no session is running",
                none.what());
}

/// Will and birth of a line have the same time and number, so that whoever hears both knows the will for the later.
MqttLine::Message Publisher::Impl::presence(bool online, bool farewell) const {
  const OutboxCount count = farewell ? parts.journal.outbox() : OutboxCount{};
  Presence words;
  words.of = name();
  words.online = online;
  words.farewell = farewell;
  words.journal = farewell ? count.source : connected.source;
  words.number = farewell ? count.newest : connected.newest;
  words.software = calib::software_version();
  words.time = farewell ? wall_clock_utc() : connected.time;
  words.mock = parts.mock;
  return {to_text({name(), Subject::kPresence, {}}), to_json(words), true};
}

void Publisher::Impl::connect() try {
  if (stopping) return;
  const OutboxCount count = parts.journal.outbox();
  connected = {wall_clock_utc(), count.source, count.newest};
  line = std::make_unique<MqttLine>(
      context, parts.config, presence(false, false),
      MqttLine::Events{
          [this] { up(); },
          [this](int message, std::optional<LineFailure> refused) { answered(message, refused); },
          [this](const std::string& topic, const std::string& payload) { heard(topic, payload); },
          [this](const LineFailure& failure) { down(failure); }},
      MqttLine::Times{.keepalive = parts.keepalive});
} catch (const JournalError& failed) {  // which numbers it has nobody can say now
  say({LineProblem::kJournal, failed.what()});
  connect_later();
}

void Publisher::Impl::connect_later() {
  retry.expires_after(backoff.next());
  retry.async_wait([this](boost::system::error_code cancelled) {
    if (!cancelled) connect();
  });
}

void Publisher::Impl::up() {
  is_up = true;
  under_way.clear();
  at_the_broker.clear();
  set_aside.clear();  // it may be another broker, or the same one with another limit
  not_now = std::exchange(ended_for, std::nullopt);
  bite.clear();
  read_to = 0;
  set([&](LineStatus& now) {
    now = {true, LineProblem::kNone, {}, wall_clock_utc(), now.acknowledged};
  });
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

void Publisher::Impl::down(const LineFailure& failure) {
  line.reset();
  if (is_up && failure.problem == LineProblem::kTooLarge)
    for (const auto& [message, sent] : under_way)
      ended_for = std::max(ended_for.value_or(0), sent.bytes);
  pause.cancel();
  if (is_up || failure.problem != LineProblem::kNone) {
    set([&](LineStatus& now) {
      if (std::exchange(now.connected, false)) now.since = wall_clock_utc();
    });
  }
  is_up = false;
  if (stopping) {
    context.stop();
    return;
  }
  say(failure);
  // Two that have the same name would take the line from each other without end.
  if (failure.problem == LineProblem::kTakenOver) backoff.exhaust();
  connect_later();
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
  } else if (refused && !(sent.row == kNoRow && refused->problem == LineProblem::kNobody)) {
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

/// No plant takes it, and what is behind it does not wait for it.
void Publisher::Impl::give_up(const Sent& sent) try {
  const DroppedFact dropped{sent.number, sent.number,
                            1,           DropReason::kTooLarge,
                            sent.kind,   static_cast<std::int64_t>(sent.bytes)};
  spdlog::error(
      "[plant]: fact {}: {} bytes ({} of session {}), limit {}. Not sent; a notice is sent "
      "instead. Transfer it by hand",
      sent.number, sent.bytes, sent.kind, sent.session, kLargestMessage);
  parts.journal.replace(sent.row, report_of(dropped));
  bite.clear();
  read_to = 0;  // it stands before what is under way behind it
} catch (const JournalError& failed) {
  hold(parts.journal_wait, {LineProblem::kJournal, failed.what()});
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

/// In the status always; in the log once an hour, however often the line is lost.
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

/// Anybody may have said it: what is not understood is left aside.
void Publisher::Impl::heard(const std::string& text, const std::string& payload) try {
  const auto topic = topic_of(text);
  if (!topic || topic->of != name() || payload.empty()) return;
  if (topic->subject == Subject::kStored) hear(stored_from_json(payload, *topic));
  if (topic->subject == Subject::kProposal) hear(proposal_from_json(payload, *topic));
} catch (const std::exception& wrong) {
  spdlog::warn("[plant]: not understood: {}", printable(wrong.what()));
}

/// What the broker has and nobody stores in time is sent again: somebody between here and there has lost it.
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
  std::erase_if(at_the_broker, is_stored);
  std::erase_if(set_aside, is_stored);
  pump();
}

void Publisher::Impl::hear(const Proposal& proposal) {
  if (!parts.proposal || !parts.proposal(proposal) || stopping || !is_up) return;
  try {
    under_way[line->publish({to_text({name(), Subject::kProposal, proposal.id}), "", true})] = {};
  } catch (const NotPublished& lost) {
    say({lost.problem, lost.what()});
  }
}

/// What was acknowledged goes from the disk; what cannot go is not sent again meanwhile.
void Publisher::Impl::forget_acknowledged() {
  if (acknowledged.empty()) return;
  parts.journal.acknowledge(acknowledged);
  acknowledged.clear();
}

void Publisher::Impl::pump() try {
  if (acknowledged.size() >= kAcknowledgedAtOnce || under_way.empty()) forget_acknowledged();
  if (!is_up || stopping) return;
  if (held) {  // from the oldest on, when that is over: in order
    bite.clear();
    read_to = 0;
    return;
  }
  send_waiting();
} catch (const JournalError& failed) {
  hold(parts.journal_wait, {LineProblem::kJournal, failed.what()});
}

bool Publisher::Impl::has_room() const {
  std::size_t bytes = 0;
  for (const auto& [message, sent] : under_way) bytes += sent.bytes;
  return under_way.size() < kMostUnderWay && bytes < kMostBytesUnderWay;
}

/// Its queue is not for all that a plant has not stored in a week.
bool Publisher::Impl::broker_has_enough() const {
  std::size_t bytes = 0;
  for (const auto& [row, sent] : at_the_broker) bytes += sent.bytes;
  return at_the_broker.size() >= parts.most_unstored || bytes >= kMostBytesUnderWay;
}

/// Nothing is under way, and this is why.
void Publisher::Impl::say_what_waits() {
  const OutboxCount count = parts.journal.outbox();
  if (broker_has_enough()) {
    say({LineProblem::kUnstored,
         fmt::format("broker {}:{}: {} results not stored by the plant, no more are sent. Start "
                     "cellcal-fleet, or see its log; nothing is lost meanwhile",
                     parts.config.host, parts.config.port, at_the_broker.size())});
  } else if (!set_aside.empty() && count.rows > 0) {
    warn_of(too_large());
  } else if (count.elsewhere > 0) {
    say({LineProblem::kRenamed,
         fmt::format(
             "{} unsent messages under the old name {}; [plant] is {}/{} now. Set plant and cell "
             "back until they are sent, or add former = [\"{}\"] to send them under the new name",
             count.elsewhere, count.elsewhere_address, parts.config.plant, parts.config.cell,
             count.elsewhere_address)});
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
      auto rows = parts.journal.waiting(read_to, kMostUnderWay);
      std::move(rows.begin(), rows.end(), std::back_inserter(bite));
      if (bite.empty()) break;
    }
    if (!is_dealt_with(bite.front()) && !send(bite.front())) return;
    read_to = bite.front().row;
    bite.pop_front();
  }
  if (under_way.empty()) {
    forget_acknowledged();
    if (!held) say_what_waits();
  }
}

bool Publisher::Impl::is_dealt_with(const WaitingReport& row) const {
  return at_the_broker.contains(row.row) || set_aside.contains(row.row) ||
         std::any_of(under_way.begin(), under_way.end(),
                     [&](const auto& one) { return one.second.row == row.row; });
}

bool Publisher::Impl::send(const WaitingReport& row) {
  if (row.source == stored.journal && stored.has(row.number)) {  // sent on an earlier line
    acknowledged.push_back(row.row);
    return true;
  }
  Sent sent{row.row,     row.number,     row.source, Worth::kResult, row.report.body.size(),
            row.session, row.report.kind};
  if (sent.bytes > kLargestMessage) {
    give_up(sent);
    return false;
  }
  const Fact fact = fact_of(row);
  const std::string text = to_json(fact);
  sent.worth = worth_of(fact.body);
  sent.bytes = text.size();
  if (sent.bytes > kLargestMessage) {
    give_up(sent);
    return false;
  }
  if (not_now && sent.bytes >= *not_now) {
    set_aside.emplace(sent.row, sent);
    return true;
  }
  try {
    under_way[line->publish({to_text({name(), Subject::kFact, kind_of(fact.body)}), text, false})] =
        sent;
    return true;
  } catch (const NotPublished& refused) {
    if (refused.problem != LineProblem::kTooLarge) return false;
    set_aside.emplace(sent.row, sent);
    return true;
  }
}

/// What cannot be composed is reported: its number is used. Throws JournalError where it may be composed later.
Fact Publisher::Impl::fact_of(const WaitingReport& row) {
  Fact fact{name(), row.source, row.number, row.time, row.session, {}};
  try {
    std::string body = row.report.body;
    if (body.empty()) {
      const auto session = parts.journal.session(row.session);
      if (!session) throw std::runtime_error(fmt::format("session {} is not there", row.session));
      body = reporter->calibration(*session, parts.journal.touches(row.session)).body;
    }
    fact.body = body_from_json(row.report.kind, body);
  } catch (const DamagedError& damaged) {
    if (logged_damaged.insert(row.row).second)
      spdlog::error(
          "[plant]: fact {} ({} of session {}): damaged, not sent; a notice is sent instead. {}",
          row.number, row.report.kind, row.session, printable(damaged.what()));
    fact.body =
        DroppedFact{row.number, row.number, 1, DropReason::kDamaged, row.report.kind, std::nullopt};
  } catch (const JournalError&) {
    throw;  // the disk may give it later: a result is not dropped for that
  } catch (const std::exception& failed) {
    fact.body = AlarmFact{
        "failed",
        fmt::format("{} of session {} could not be published", row.report.kind, row.session),
        failed.what()};
  }
  return fact;
}

void Publisher::Impl::tell_health() {
  const auto period = std::chrono::duration<double, std::ratio<60>>(parts.config.health_minutes);
  health.expires_after(std::chrono::duration_cast<std::chrono::milliseconds>(period));
  health.async_wait([this](boost::system::error_code cancelled) {
    if (cancelled) return;
    try {
      HealthFact fact = parts.health();
      fact.waiting = parts.journal.outbox().rows;
      fact.journal_bytes = parts.journal.bytes_in_use();
      parts.journal.report(0, report_of(fact));
    } catch (const std::exception& failed) {
      say({LineProblem::kJournal, failed.what()});
    }
    tell_health();
  });
}

void Publisher::Impl::stop() {
  stopping = true;
  retry.cancel();
  pause.cancel();
  health.cancel();
  unstored.cancel();
  if (!is_up) {
    context.stop();
    return;
  }
  last.expires_after(parts.farewell);
  last.async_wait([this](boost::system::error_code cancelled) {
    if (!cancelled) context.stop();
  });
  try {
    under_way[line->publish(presence(false, true))] = {};
  } catch (const std::exception&) {  // the will says so
    context.stop();
  }
}

Publisher::Publisher(Parts parts, Publisher* before)
    : impl_(std::make_shared<Impl>(std::move(parts))) {
  if (before != nullptr) before->impl_->rest();
  try {
    impl_->start();
  } catch (...) {
    if (before != nullptr) before->impl_->go_on();
    throw;
  }
}

Publisher::~Publisher() {
  impl_->parts.journal.report_no_more_to(*impl_->reporter);
  impl_->rest();
}

LineStatus Publisher::status() const {
  const std::lock_guard lock(impl_->status_mutex);
  return impl_->status;
}

const PlantConfig& Publisher::config() const { return impl_->parts.config; }

}  // namespace cellcal::daemon::plant
