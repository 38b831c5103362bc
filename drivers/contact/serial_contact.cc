#include "drivers/contact/serial_contact.h"

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/error.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/lockfree/spsc_queue.hpp>
#include <cerrno>
#include <cstring>
#include <future>
#include <mutex>
#include <optional>
#include <utility>

#include "drivers/contact/contact_words.h"
#include "drivers/contact/latest_value.h"
#include "drivers/contact/port_keeper.h"

namespace cellcal::drivers {

namespace {

namespace asio = boost::asio;
using Steady = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// The published state is never older than this while the io thread runs.
constexpr milliseconds kPublishPeriod{200};
/// Published longer ago: the io thread does not run.
constexpr milliseconds kIoThreadStuck{2000};
constexpr milliseconds kClosePatience{1000};
constexpr milliseconds kClosePoll{10};
constexpr std::size_t kCommands = 64;
constexpr std::size_t kAnswers = 16;
/// More than any tty delivers at once at 1 Mbaud between two turns of the loop.
constexpr std::size_t kReadSize = 4096;

enum class Port { kClosed, kOpen, kLost };

struct Command {
  enum class Kind { kArm, kDisarm, kSelfTest } kind = Kind::kDisarm;
  std::uint16_t arm_id = 0;
  milliseconds lifetime{0};
};

struct Published {
  ContactFacts facts;
  Port port = Port::kClosed;
  int error = 0;  ///< errno that the port was lost with; 0: end of file
  std::uint64_t unsent = 0;
  std::uint64_t tests_begun = 0;  ///< orders to prove itself that were passed on
  TimePoint at{};
};

ContactOptions with_baud(ContactOptions contact, int baud) {
  contact.baud = baud;
  return contact;
}

}  // namespace

class SerialContact::Impl : public ContactGuard, public std::enable_shared_from_this<Impl> {
 public:
  Impl(asio::io_context& io, const SerialContactOptions& options)
      : io_(io),
        options_(options),
        core_(with_baud(options.contact, options.port.baud),
              [this](std::span<const std::uint8_t> bytes) { transmit(bytes); }),
        stream_(io),
        timer_(io),
        wake_(io) {
    wake_fd_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (wake_fd_ < 0) throw DriverError(fmt::format("eventfd: {}", std::strerror(errno)));
    wake_.assign(wake_fd_);
  }

  // Session's thread --------------------------------------------------------------------------

  /// After construction, when shared_from_this() works.
  void start() {
    keeper_.emplace(options_.port, options_.reopen_first, options_.reopen_longest,
                    [weak = weak_from_this()](std::unique_ptr<SerialPort> port) {
                      if (const auto self = weak.lock()) self->hand_over(std::move(port));
                    });
    asio::post(io_, [self = shared_from_this()] { self->wait_for_commands(); });
  }

  void open() {
    if (opened_) return;
    auto port = open_serial_port(options_.port);
    opened_ = true;
    ++epoch_;
    set_warning(port->warning());
    // Until the io thread has taken the port over.
    opened_at_ = Steady::now();
    hand_over(std::move(port));
  }

  void close() {
    if (!opened_) return;
    opened_ = false;
    ++epoch_;
    std::promise<std::unique_ptr<SerialPort>> promise;
    auto port = promise.get_future();
    on_io_thread([self = shared_from_this(), p = std::make_shared<decltype(promise)>(std::move(
                                                 promise))] { p->set_value(self->leave_port()); });
    keeper_->give_up();
    // The port is closed on this thread, so that it can be opened again at once.
    const auto end = Steady::now() + kClosePatience;
    while (port.wait_for(kClosePoll) != std::future_status::ready) {
      if (io_.stopped() || Steady::now() > end) return;  // closed with the io_context's handlers
    }
    port.get().reset();
  }

  /// Nothing of this runs on the io_context afterwards, if that runs at all.
  void finish() {
    close();
    on_io_thread([self = shared_from_this()] {
      boost::system::error_code ignored;  // closing what is closed already
      self->wake_.close(ignored);
      self->timer_.cancel();
    });
  }

  void command(const Command& c) {
    const bool queued = opened_ && commands_.push(c);
    if (queued) {
      // Until the io thread has taken the order, the pass of an earlier test is no answer to it.
      if (c.kind == Command::Kind::kSelfTest) ++tests_asked_;
      wake();
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
    if (no_port) result.why_not = "the contact sensor is not ready: " + status().words;
    return result;
  }

  ContactStatus status() const {
    const Published p = published_.read();
    if (!opened_) return status_of(ContactFacts{});
    ContactStatus s = status_of(p.facts);
    if (p.tests_begun < tests_asked_) s.self_test_ok = false;
    const TimePoint now = Steady::now();
    if (now - std::max(p.at, opened_at_) > kIoThreadStuck) {
      s.link = ContactLink::kFault;
      s.words = "the robot's thread does not run: nothing is known of the contact sensor";
      return s;
    }
    if (p.port == Port::kLost) {
      s.link = ContactLink::kDown;
      s.words = lost_words(p);
    } else if (p.port == Port::kClosed) {
      s.link = ContactLink::kDown;
      s.words = "the contact sensor's port is being taken over";
    }
    const std::string warned = warning();
    s.warning = warned;
    if (!warned.empty()) s.words += (s.words.empty() ? "warning: " : "; warning: ") + warned;
    if (p.unsent > 0) {
      s.words += fmt::format("{}{} frames to the contact sensor could not be sent",
                             s.words.empty() ? "" : "; ", p.unsent);
    }
    return s;
  }

  // io thread, within the robot's cycle ---------------------------------------------------------

  ContactSnapshot snapshot(TimePoint now) override {
    // What has arrived by now counts in this cycle, also if its handler has not had its turn. A
    // port that is lost shows there too: its handler deals with it.
    take_bytes();
    return core_.snapshot(now);
  }

  std::optional<ContactEvent> take_event() override {
    if (!core_.has_event()) take_bytes();
    return core_.take_event();
  }

 private:
  static constexpr int kNotLost = -1;

  std::string lost_words(const Published& p) const {
    const std::string why = p.error == 0 ? std::string("end of file") : std::strerror(p.error);
    std::string words = fmt::format(
        "{}: the contact sensor was unplugged or its port failed ({}); nothing moves "
        "until it is back and identified again",
        options_.port.device, why);
    const std::string attempt = keeper_->last_error();
    if (!attempt.empty()) words += "; last attempt: " + attempt;
    return words;
  }

  void set_warning(const std::string& text) {
    const std::lock_guard lock(warning_mutex_);
    warning_ = text;
  }

  std::string warning() const {
    const std::lock_guard lock(warning_mutex_);
    return warning_;
  }

  template <class Action>
  void on_io_thread(Action action) {
    if (io_.stopped() || io_.get_executor().running_in_this_thread()) {
      action();
    } else {
      asio::post(io_, std::move(action));
    }
  }

  void wake() {
    const std::uint64_t one = 1;
    // Fails only when the counter is full, and then the io thread is called already.
    [[maybe_unused]] const auto written = ::write(wake_fd_, &one, sizeof(one));
  }

  /// Session's thread (open) or keeper's (opened again).
  void hand_over(std::unique_ptr<SerialPort> port) {
    set_warning(port->warning());
    const int epoch = epoch_;
    auto shared = std::make_shared<std::unique_ptr<SerialPort>>(std::move(port));
    asio::post(io_, [self = shared_from_this(), shared, epoch] {
      if (epoch == self->epoch_) self->adopt(std::move(*shared));
      // Otherwise it was closed meanwhile, and the port closes with this handler.
    });
  }

  // io thread ---------------------------------------------------------------------------------

  void adopt(std::unique_ptr<SerialPort> port) {
    const int fd = ::dup(port->fd());
    if (fd < 0) {
      error_ = errno;
      port_state_ = Port::kLost;
      keeper_->reopen(std::move(port));
      after(Steady::now());
      return;
    }
    port_ = std::move(port);
    stream_.assign(fd);
    port_state_ = Port::kOpen;
    error_ = 0;
    ++reads_;
    core_.connect(Steady::now());
    read();
    after(Steady::now());
  }

  std::unique_ptr<SerialPort> leave_port() {
    const TimePoint now = Steady::now();
    if (port_) core_.disarm(now);
    core_.disconnect(now);
    ++reads_;
    boost::system::error_code ignored;  // the descriptor is gone in any case
    stream_.close(ignored);
    port_state_ = Port::kClosed;
    after(now);
    return std::move(port_);
  }

  void lose_port(int error) {
    auto port = leave_port();
    error_ = error;
    port_state_ = Port::kLost;
    keeper_->reopen(std::move(port));
    after(Steady::now());
  }

  /// Waits for bytes without taking them: whoever comes first takes them, in order.
  void read() {
    stream_.async_wait(asio::posix::stream_descriptor::wait_read,
                       [self = shared_from_this(), turn = reads_](boost::system::error_code error) {
                         if (turn != self->reads_) return;  // of a port that was left
                         const int lost = error ? error.value() : self->take_bytes();
                         if (lost != kNotLost) {
                           self->lose_port(lost);
                         } else {
                           self->read();
                         }
                       });
  }

  /// Feeds what has arrived to the core. kNotLost, or the errno that the port was lost with.
  int take_bytes() {
    int lost = kNotLost;
    while (port_) {
      const ssize_t n = ::read(port_->fd(), bytes_.data(), bytes_.size());
      if (n > 0) {
        const TimePoint now = Steady::now();
        core_.on_bytes({bytes_.data(), static_cast<std::size_t>(n)}, now);
        after(now);
      } else if (n == 0) {
        lost = 0;
        break;
      } else if (errno != EINTR) {
        if (errno != EAGAIN) lost = errno;
        break;
      }
    }
    return lost;
  }

  void transmit(std::span<const std::uint8_t> bytes) {
    if (!port_) return;
    ssize_t n = -1;
    do {
      n = ::write(port_->fd(), bytes.data(), bytes.size());
    } while (n < 0 && errno == EINTR);
    // A frame that does not fit is lost, as on a bad line: the protocol repeats what matters, and
    // the sensor's reader goes on at the next delimiter. A dead port shows in read().
    if (n != static_cast<ssize_t>(bytes.size())) ++unsent_;
  }

  void after(TimePoint now) {
    while (const auto answer = core_.poll_arm()) {
      // Its size exceeds what one session can have asked for.
      [[maybe_unused]] const bool pushed = answers_.push(*answer);
    }
    Published p;
    p.facts = core_.facts(now);
    p.port = port_state_;
    p.error = error_;
    p.unsent = unsent_;
    p.tests_begun = tests_begun_;
    p.at = now;
    published_.write(p);
    schedule(now);
  }

  void schedule(TimePoint now) {
    const TimePoint next = std::min<TimePoint>(core_.next_wake(), now + kPublishPeriod);
    if (timer_pending_ && timer_.expiry() <= next) return;
    timer_.expires_at(next);
    timer_pending_ = true;
    timer_.async_wait([self = shared_from_this()](boost::system::error_code error) {
      if (error) return;  // set anew, or finished
      self->timer_pending_ = false;
      const TimePoint t = Steady::now();
      self->core_.on_tick(t);
      self->after(t);
    });
  }

  void wait_for_commands() {
    wake_.async_wait(asio::posix::stream_descriptor::wait_read,
                     [self = shared_from_this()](boost::system::error_code error) {
                       if (error) return;
                       self->run_commands();
                       self->wait_for_commands();
                     });
  }

  void run_commands() {
    std::uint64_t drained = 0;
    // Nothing to read means that the commands were taken the last time.
    [[maybe_unused]] const auto n = ::read(wake_fd_, &drained, sizeof(drained));
    Command c;
    while (commands_.pop(c)) {
      const TimePoint now = Steady::now();
      switch (c.kind) {
        case Command::Kind::kArm:
          core_.arm(c.arm_id, c.lifetime, now);
          break;
        case Command::Kind::kDisarm:
          core_.disarm(now);
          break;
        case Command::Kind::kSelfTest:
          core_.self_test(now);
          ++tests_begun_;
          break;
      }
    }
    after(Steady::now());
  }

  asio::io_context& io_;
  const SerialContactOptions options_;

  // session's
  bool opened_ = false;
  TimePoint opened_at_{};
  std::optional<ArmAnswer> unsent_answer_;

  // between threads
  std::atomic<std::uint64_t> tests_asked_{0};
  std::atomic<int> epoch_{0};  ///< counts open() and close(): what is older is not adopted
  boost::lockfree::spsc_queue<Command, boost::lockfree::capacity<kCommands>> commands_;
  boost::lockfree::spsc_queue<ArmAnswer, boost::lockfree::capacity<kAnswers>> answers_;
  LatestValue<Published> published_;
  mutable std::mutex warning_mutex_;  // session and keeper only
  std::string warning_;
  int wake_fd_ = -1;

  // io thread's
  ContactCore core_;
  std::unique_ptr<SerialPort> port_;
  asio::posix::stream_descriptor stream_;
  asio::steady_timer timer_;
  asio::posix::stream_descriptor wake_;
  std::array<std::uint8_t, kReadSize> bytes_{};
  bool timer_pending_ = false;
  std::uint64_t reads_ = 0;
  Port port_state_ = Port::kClosed;
  int error_ = 0;
  std::uint64_t unsent_ = 0;
  std::uint64_t tests_begun_ = 0;

  std::optional<PortKeeper> keeper_;  ///< last, so that its thread ends first
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

void SerialContact::self_test() { impl_->command({Command::Kind::kSelfTest, 0, milliseconds{0}}); }

void SerialContact::close() { impl_->close(); }

ContactGuard& SerialContact::guard() { return *impl_; }

}  // namespace cellcal::drivers
