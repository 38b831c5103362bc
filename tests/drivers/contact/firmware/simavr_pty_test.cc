// The firmware's image on a simulated ATmega328P in real time, on a pseudo-terminal, with the unmodified
// SerialContact. Waits have generous limits, nothing is timed. A microcontroller has its own processor: if
// permitted the simulated one has priority over all other load, since one that is too slow falls
// increasingly short of real time, and is not detected as a sensor.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <climits>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

#include "drivers/contact/serial_contact.h"
#include "drivers/io_thread.h"
#include "sim/hard_clock.h"
#include "simavr_board.h"

namespace cellcal::test {
namespace {

using namespace drivers;  // NOLINT: a test's own file
using std::chrono::milliseconds;
using Steady = std::chrono::steady_clock;

/// Runs the board at the pace of the machine's clock. Unread bytes are lost, as on a wire.
class RealTimeBoard {
 public:
  RealTimeBoard() : board_(CELLCAL_SENSOR_ELF, CTP_DEFAULT_BAUD, Steady::now()) {
    std::array<char, PATH_MAX> name{};
    termios tio{};
    ::cfmakeraw(&tio);
    if (::openpty(&master_, &slave_, name.data(), &tio, nullptr) != 0) {
      throw std::system_error(errno, std::generic_category(), "openpty");
    }
    ::fcntl(master_, F_SETFL, O_NONBLOCK);
    path_ = name.data();
    thread_ = std::thread([this] { live(); });
  }
  ~RealTimeBoard() {
    stop_ = true;
    thread_.join();
    ::close(slave_);
    ::close(master_);
  }

  const std::string& path() const { return path_; }
  void touch(bool touching) {
    const std::lock_guard lock(mutex_);
    board_.touch(Steady::now(), touching);
  }
  /// Diagnostics for a failure: whether the machine was fast enough.
  std::string pace() const {
    return "; the simulated board was " + std::to_string(behind_ms_.load()) +
           " ms behind the machine's clock at worst" +
           (realtime_ ? "" : ", without real-time priority");
  }

 private:
  void live() {
    realtime_ = sim::request_hardware_priority();
    while (!stop_) {
      {
        const std::lock_guard lock(mutex_);
        turn();
      }
      pollfd fd{master_, POLLIN, 0};
      constexpr timespec kTurn{0, 200'000};
      ::ppoll(&fd, 1, &kTurn, nullptr);
    }
  }
  void turn() {
    std::array<std::uint8_t, 512> bytes{};
    const auto now = Steady::now();
    const auto behind = std::chrono::duration_cast<milliseconds>(now - board_.now()).count();
    behind_ms_ = std::max(behind_ms_.load(), behind);
    const ssize_t n = ::read(master_, bytes.data(), bytes.size());
    if (n > 0) board_.receive({bytes.data(), static_cast<std::size_t>(n)}, now);
    board_.advance(now);
    while (const auto out = board_.next_output()) {
      [[maybe_unused]] const auto written = ::write(master_, out->bytes.data(), out->bytes.size());
    }
  }

  SimavrBoard board_;
  int master_ = -1, slave_ = -1;
  std::string path_;
  std::mutex mutex_;
  std::atomic<bool> stop_{false}, realtime_{false};
  std::atomic<milliseconds::rep> behind_ms_{0};
  std::thread thread_;
};

bool wait_for(const std::function<bool()>& done) {
  const auto end = Steady::now() + std::chrono::seconds{30};
  while (!done()) {
    if (Steady::now() > end) return false;
    std::this_thread::sleep_for(milliseconds{1});
  }
  return true;
}

/// The robot's thread, on which the sensor's guard is polled.
class RobotThread {
 public:
  explicit RobotThread(const SerialContactOptions& options) : contact(io_.context(), options) {
    io_.start();
  }
  ~RobotThread() { contact.close(); }
  std::optional<ContactEvent> next_event() {
    std::promise<std::optional<ContactEvent>> event;
    boost::asio::post(io_.context(), [&] {
      contact.guard().snapshot(Steady::now());
      event.set_value(contact.guard().pop_event());
    });
    return event.get_future().get();
  }
  std::optional<ContactEvent> wait_for_event() {
    std::optional<ContactEvent> event;
    wait_for([&] { return (event = next_event()).has_value(); });
    return event;
  }

 private:
  IoThread io_{IoThreadOptions{.quiet = true}};  // destroyed after objects on its context

 public:
  SerialContact contact;
};

TEST(SimavrPty, IsIdentifiedArmedAndTouchedThroughTheRealSerialDriver) {
  RealTimeBoard board;
  SerialContactOptions options;
  options.port.device = board.path();
  options.contact.max_clock_sigma_s = 0.02;  // tolerates a loaded test machine
  RobotThread robot(options);
  robot.contact.open();
  ASSERT_TRUE(wait_for([&] { return robot.contact.status().link == ContactLink::kReady; }))
      << robot.contact.status().words << board.pace();
  // A machine that stalls for more than 25 ms ends an arming by the dead man, which is not tested
  // here.
  constexpr std::uint16_t kTries = 10;
  int touched = 0;
  for (std::uint16_t id = 1; id <= kTries && touched < 2; ++id) {
    std::optional<ArmResult> armed;
    robot.contact.arm(id, std::chrono::seconds{60});
    ASSERT_TRUE(wait_for([&] { return (armed = robot.contact.poll_arm()).has_value(); }))
        << board.pace();
    if (!armed->armed) continue;
    const TimePoint touch = Steady::now();
    board.touch(true);
    std::vector<ContactEvent> events;
    while (events.empty() || events.back().kind != ContactEventKind::kContact) {
      const auto event = robot.wait_for_event();
      ASSERT_TRUE(event) << "a touch must be reported, armed or not" << board.pace();
      events.push_back(*event);
    }
    board.touch(false);
    const auto release = robot.wait_for_event();
    ASSERT_TRUE(release);
    EXPECT_EQ(release->kind, ContactEventKind::kRelease);
    if (events.back().arm_id != id) continue;
    ++touched;
    ASSERT_EQ(events.size(), 2u);
    EXPECT_EQ(events[0].kind, ContactEventKind::kTrip);
    EXPECT_EQ(events[0].arm_id, id);
    EXPECT_GE(events[1].first_edge, touch - milliseconds{50});
    EXPECT_LE(events[1].first_edge, Steady::now() + milliseconds{50});
  }
  EXPECT_EQ(touched, 2) << board.pace();
  EXPECT_EQ(robot.contact.status().quality.crc_errors, 0u);
}

}  // namespace
}  // namespace cellcal::test
