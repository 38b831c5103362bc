#include "drivers/contact/serial_contact.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/error.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstring>
#include <thread>
#include <utility>

#include "drivers/contact/contact_words.h"
#include "drivers/contact/port/port_keeper.h"
#include "drivers/latest_value.h"

namespace cellcal::drivers {

namespace {

namespace asio = boost::asio;
using Steady = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// Maximum age of the published state while the io thread runs.
constexpr milliseconds kPublishPeriod{200};
/// Age of the published state that shows that the io thread does not run.
constexpr milliseconds kIoThreadStuck{2000};
constexpr milliseconds kCloseTimeout{1000};
constexpr milliseconds kClosePoll{1};
constexpr std::size_t kCommands = 64;
constexpr std::size_t kAnswers = 16;
/// The session reads them every millisecond; a second of the fastest sensor.
constexpr std::size_t kRecords = 256;

enum class PortState { kClosed, kOpen, kLost };

struct Command {
  enum class Kind { kArm, kDisarm, kSelfTest } kind = Kind::kDisarm;
  std::uint16_t arm_id = 0;
  milliseconds lifetime{0};
};

struct Published {
  ContactFacts facts;
  PortState port = PortState::kClosed;
  int error = 0;  ///< errno of the loss of the port; 0: end of file
  std::uint64_t unsent = 0;
  std::uint64_t tests_begun = 0;  ///< number of self-tests passed on to the core
  TimePoint at{};
};

/// 100BASE-TX, the maximum of a W5500.
constexpr int kEthernetRate = 100'000'000;

ContactOptions over(ContactOptions contact, const PortOptions& port) {
  contact.datagrams = is_datagrams(port.device);
  contact.baud = contact.datagrams ? kEthernetRate : port.baud;
  return contact;
}

}  // namespace

class SerialContact::Impl : public ContactGuard, public std::enable_shared_from_this<Impl> {
 public:
  Impl(asio::io_context& io, const SerialContactOptions& options)
      : io_(io),
        options_(options),
        core_(over(options.contact, options.port),
              [this](std::span<const std::uint8_t> bytes) { transmit(bytes); }),
        timer_(io),
        calls_(io),
        keeper_({options.port, options.reopen_first, options.reopen_longest}, queues_) {
    const int fd = ::dup(queues_.news_call.fd());
    if (fd < 0) throw DriverError(fmt::format("dup: {}", std::strerror(errno)));
    calls_.assign(fd);
  }

  // Session's thread --------------------------------------------------------------------------

  /// Called after construction, when shared_from_this() is valid.
  void start() {
    asio::post(io_, [self = shared_from_this()] { self->wait_for_calls(); });
  }

  void open() {
    if (opened_) return;
    // Until the io thread has taken over the port.
    opened_at_ = Steady::now();
    wanted_from_ = keeper_.next_opening();
    try {
      keeper_.open();
    } catch (...) {
      wanted_from_ = kNone;
      throw;
    }
    opened_ = true;
  }

  void close() {
    if (!opened_) return;
    opened_ = false;
    wanted_from_ = kNone;
    const std::uint64_t asked = ++closes_asked_;
    if (io_.stopped() || io_.get_executor().running_in_this_thread()) {
      leave_port();
    } else {
      queues_.news_call.make();
      const auto end = Steady::now() + kCloseTimeout;
      while (closes_done_ < asked && !io_.stopped() && Steady::now() < end) {
        std::this_thread::sleep_for(kClosePoll);
      }
    }
    // The disarming is already queued and is sent before the port closes, on this thread, so that
    // it can be reopened immediately.
    keeper_.close();
  }

  /// No handlers run on the io_context afterwards.
  void finish() {
    close();
    on_io_thread([self = shared_from_this()] {
      boost::system::error_code ignored;  // already closed
      self->calls_.close(ignored);
      self->timer_.cancel();
    });
  }

  void command(const Command& c) {
    const bool queued = opened_ && commands_.push(c);
    if (queued) {
      // Until the io thread has processed the request, a pass of an earlier test does not count.
      if (c.kind == Command::Kind::kSelfTest) ++tests_asked_;
      queues_.news_call.make();
    } else if (c.kind == Command::Kind::kArm) {
      ArmAnswer answer;
      answer.arm_id = c.arm_id;
      answer.refusal = opened_ ? ArmRefusal::kBusy : ArmRefusal::kNotReady;
      unsent_answer_ = answer;
    }
  }

  std::optional<ArmResult> poll_arm() {
    ArmAnswer answer;
    if (unsent_answer_) {
      answer = *unsent_answer_;
      unsent_answer_.reset();
    } else if (!answers_.pop(answer)) {
      return std::nullopt;
    }
    ArmResult result = result_of(answer);
    const bool no_port = !result.armed && answer.facts.step == ContactStep::kClosed;
    if (no_port) result.why_not = {"say.contact.not_ready.why", {{"why", status().words}}};
    return result;
  }

  std::optional<ContactRecord> next_record() {
    ContactRecord record;
    if (!records_.pop(record)) return std::nullopt;
    return record;
  }

  ContactStatus status() const {
    const Published p = published_.load();
    if (!opened_) return status_of(ContactFacts{});
    ContactStatus s = status_of(p.facts);
    if (p.tests_begun < tests_asked_) s.self_test_ok = false;
    const TimePoint now = Steady::now();
    if (now - std::max(p.at, opened_at_) > kIoThreadStuck) {
      s.link = ContactLink::kFault;
      s.words = "say.contact.thread_stuck";
      return s;
    }
    if (p.port == PortState::kLost) {
      s.link = ContactLink::kDown;
      s.words = lost_words(p);
    } else if (p.port == PortState::kClosed) {
      s.link = ContactLink::kDown;
      s.words = "say.contact.opening";
    }
    const std::string warned = keeper_.warning();
    s.warning = warned;
    if (!warned.empty()) s.words = with_note(s.words, {"say.contact.warning", {{"words", warned}}});
    if (p.unsent > 0) s.words = with_note(s.words, {"say.contact.unsent", {{"frames", p.unsent}}});
    return s;
  }

  // io thread, within the robot's cycle ---------------------------------------------------------

  ContactSnapshot snapshot(TimePoint now) override {
    // Received data counts in this cycle, even before its handler has run.
    process_input();
    return core_.snapshot(now);
  }

  void set_silence_limit(Duration limit) override { core_.set_silence_limit(limit); }

  std::optional<ContactEvent> pop_event() override {
    if (!core_.has_event()) process_input();
    return core_.pop_event();
  }

 private:
  static constexpr std::uint32_t kNone = 0;  ///< not a valid opening

  Sentence lost_words(const Published& p) const {
    const Sentence why = p.error == 0 ? "say.contact.end_of_file" : std::strerror(p.error);
    const Sentence lost{"say.contact.lost", {{"device", options_.port.device}, {"why", why}}};
    const std::string attempt = keeper_.last_error();
    if (attempt.empty()) return lost;
    return with_note(lost, {"say.contact.last_attempt", {{"words", attempt}}});
  }

  template <class Action>
  void on_io_thread(Action action) {
    if (io_.stopped() || io_.get_executor().running_in_this_thread()) {
      action();
    } else {
      asio::post(io_, std::move(action));
    }
  }

  // io thread ---------------------------------------------------------------------------------

  /// Processes pending input of this thread: shutdown, commands, messages of the port.
  void process_input() {
    bool any = false;
    if (closes_done_ < closes_asked_) {
      leave_port();
      any = true;
    }
    Command c;
    while (commands_.pop(c)) {
      obey(c);
      any = true;
    }
    queues_.news.consume_all([this, &any](const PortUpdate& news) {
      hear(news);
      any = true;
    });
    if (any) after(Steady::now());
  }

  void hear(const PortUpdate& news) {
    const std::uint32_t wanted = wanted_from_;
    if (wanted == kNone || news.opening < wanted) return;  // it was closed meanwhile
    switch (news.kind) {
      case PortUpdate::Kind::kOpened:
        opening_ = news.opening;
        port_state_ = PortState::kOpen;
        error_ = 0;
        core_.connect(Steady::now());
        break;
      case PortUpdate::Kind::kBytes:
        core_.on_bytes({news.bytes.data(), news.size}, news.t, news.arrived);
        break;
      case PortUpdate::Kind::kLost:
        port_state_ = PortState::kLost;
        error_ = news.error;
        core_.disconnect(Steady::now());
        break;
    }
  }

  void leave_port() {
    const TimePoint now = Steady::now();
    if (port_state_ == PortState::kOpen) core_.disarm(now);
    core_.disconnect(now);
    port_state_ = PortState::kClosed;
    closes_done_ = closes_asked_.load();
    after(now);
  }

  void transmit(std::span<const std::uint8_t> bytes) {
    PortFrame frame;
    frame.opening = opening_;
    frame.size = static_cast<std::uint16_t>(std::min(bytes.size(), frame.bytes.size()));
    std::copy_n(bytes.begin(), frame.size, frame.bytes.begin());
    if (!queues_.frames.push(frame)) ++queues_.unsent;
    queues_.frames_call.make();
  }

  void after(TimePoint now) {
    while (const auto answer = core_.poll_arm()) {
      // Its capacity exceeds the number of requests of a session.
      [[maybe_unused]] const bool pushed = answers_.push(*answer);
    }
    // Excess records wait in the core, which counts dropped ones.
    while (records_.write_available() > 0) {
      const auto record = core_.next_record();
      if (!record) break;
      records_.push(*record);
    }
    Published p;
    p.facts = core_.facts(now);
    p.port = port_state_;
    p.error = error_;
    p.unsent = queues_.unsent;
    p.tests_begun = tests_begun_;
    p.at = now;
    published_.store(p);
    schedule(now);
  }

  void schedule(TimePoint now) {
    const TimePoint next = std::min<TimePoint>(core_.next_wake(), now + kPublishPeriod);
    if (timer_pending_ && timer_.expiry() <= next) return;
    timer_.expires_at(next);
    timer_pending_ = true;
    timer_.async_wait([self = shared_from_this()](boost::system::error_code error) {
      if (error) return;  // reset or finished
      self->timer_pending_ = false;
      self->process_input();  // received data is not silence
      const TimePoint t = Steady::now();
      self->core_.on_tick(t);
      self->after(t);
    });
  }

  void wait_for_calls() {
    calls_.async_wait(asio::posix::stream_descriptor::wait_read,
                      [self = shared_from_this()](boost::system::error_code error) {
                        if (error) return;
                        self->queues_.news_call.take();
                        self->process_input();
                        self->wait_for_calls();
                      });
  }

  void obey(const Command& c) {
    const TimePoint now = Steady::now();
    switch (c.kind) {
      case Command::Kind::kArm: core_.arm(c.arm_id, c.lifetime, now); break;
      case Command::Kind::kDisarm: core_.disarm(now); break;
      case Command::Kind::kSelfTest:
        core_.self_test(now);
        ++tests_begun_;
        break;
    }
  }

  asio::io_context& io_;
  const SerialContactOptions options_;

  // session thread
  bool opened_ = false;
  TimePoint opened_at_{};
  std::optional<ArmAnswer> unsent_answer_;

  // between threads
  std::atomic<std::uint64_t> tests_asked_{0};
  /// First valid opening of the port; data of earlier ones is discarded. kNone: closed.
  std::atomic<std::uint32_t> wanted_from_{kNone};
  std::atomic<std::uint64_t> closes_asked_{0}, closes_done_{0};
  boost::lockfree::spsc_queue<Command, boost::lockfree::capacity<kCommands>> commands_;
  boost::lockfree::spsc_queue<ArmAnswer, boost::lockfree::capacity<kAnswers>> answers_;
  boost::lockfree::spsc_queue<ContactRecord, boost::lockfree::capacity<kRecords>> records_;
  Seqlock<Published> published_;
  PortQueues queues_;

  // io thread
  ContactCore core_;
  asio::steady_timer timer_;
  asio::posix::stream_descriptor calls_;
  bool timer_pending_ = false;
  std::uint32_t opening_ = kNone;
  PortState port_state_ = PortState::kClosed;
  int error_ = 0;
  std::uint64_t tests_begun_ = 0;

  PortKeeper keeper_;  ///< last, so that its threads end first
};

SerialContact::SerialContact(asio::io_context& io, const SerialContactOptions& options)
    : impl_(std::make_shared<Impl>(io, options)) {
  impl_->start();
}

SerialContact::~SerialContact() { impl_->finish(); }

void SerialContact::open() { impl_->open(); }

ContactStatus SerialContact::status() const { return impl_->status(); }

void SerialContact::arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime) {
  impl_->command({Command::Kind::kArm, arm_id, lifetime});
}

std::optional<ArmResult> SerialContact::poll_arm() { return impl_->poll_arm(); }

void SerialContact::disarm() { impl_->command({Command::Kind::kDisarm, 0, milliseconds{0}}); }

std::optional<ContactRecord> SerialContact::next_record() { return impl_->next_record(); }

void SerialContact::self_test() { impl_->command({Command::Kind::kSelfTest, 0, milliseconds{0}}); }

void SerialContact::close() { impl_->close(); }

ContactGuard& SerialContact::guard() { return *impl_; }

namespace {

constexpr std::size_t kChunk = CTP_MAX_WIRE;

}  // namespace

ContactInline::ContactInline(const ContactOptions& options, const Clock& clock, ByteLine& line)
    : clock_(clock), line_(line), core_(options, [this](std::span<const std::uint8_t> bytes) {
        line_.write(bytes, write_time_);
      }) {}

void ContactInline::open() {
  open_ = true;
  now_ = write_time_ = clock_.now();
  line_.advance(write_time_);
  // Discards what was sent before the port was open.
  std::array<std::uint8_t, kChunk> unheard{};
  for (TimePoint t; line_.read(unheard, t) > 0;) continue;
  core_.connect(write_time_);
}

void ContactInline::close() {
  if (!open_) return;
  open_ = false;
  core_.disarm(clock_.now());
  core_.disconnect(clock_.now());
}

ContactStatus ContactInline::status() const { return status_of(core_.facts(clock_.now())); }

void ContactInline::arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime) {
  write_time_ = clock_.now();
  core_.arm(arm_id, lifetime, write_time_);
}

std::optional<ArmResult> ContactInline::poll_arm() {
  const auto answer = core_.poll_arm();
  if (!answer) return std::nullopt;
  return result_of(*answer);
}

void ContactInline::disarm() {
  write_time_ = clock_.now();
  core_.disarm(write_time_);
}

void ContactInline::self_test() {
  write_time_ = clock_.now();
  core_.self_test(write_time_);
}

void ContactInline::run_until(TimePoint t) {
  std::array<std::uint8_t, kChunk> bytes{};
  for (;;) {
    // Never decreases: overdue actions happen now.
    const TimePoint due = std::max(now_, std::min({core_.next_wake(), line_.next(), t}));
    now_ = due;
    line_.advance(due);
    TimePoint arrived = due;
    while (const std::size_t size = line_.read(bytes, arrived)) {
      write_time_ = arrived;
      core_.on_bytes({bytes.data(), size}, arrived);
    }
    if (core_.next_wake() <= due) {
      write_time_ = due;
      core_.on_tick(due);
    }
    if (due >= t && core_.next_wake() > due && line_.next() > due) return;
  }
}

}  // namespace cellcal::drivers
