// As above over EKI: the robot's thread with a TCP connection and the contact sensor's queues.

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cmath>
#include <optional>

#include "drivers/contact/serial_contact.h"
#include "drivers/io_thread.h"
#include "drivers/kuka/eki/eki_robot.h"
#include "sim/krc/eki_server.h"
#include "sim/mcu/mcu_thread.h"
#include "tests/drivers/cycle/cycle_rules.h"
#include "tests/drivers/cycle/syscall_trace.h"
#include "tests/drivers/kuka/eki/eki_rig.h"
#include "tests/drivers/kuka/eventually.h"

namespace cellcal::test {
namespace {

using namespace drivers;  // NOLINT: a test's own file
using std::chrono::milliseconds;

constexpr int kEkiSearches = 3;
/// A loaded machine may fail some of them: late heartbeats.
constexpr std::uint16_t kEkiTries = 30;

EkiConfig flagged(std::uint16_t port) {
  EkiConfig config = eki_loopback(port);
  config.stop = EkiStop::kFlag;  // a contact is a telegram as well
  return config;
}

SerialContactOptions contact_at(const std::string& device) {
  SerialContactOptions options;
  options.port.device = device;
  options.port.priority = 0;
  options.contact.max_clock_sigma_s = 0.02;
  return options;
}

/// Its port is known once it listens.
struct Controller : sim::EkiServer {
  Controller()
      : EkiServer(patient_eki_controller(),
                  {.address = "127.0.0.1", .port = 0, .realtime = false}) {
    start();
  }
};

struct EkiCell {
  EkiCell() {
    io.start();
    contact.open();
    robot.open();
  }
  ~EkiCell() {
    robot.close();
    contact.close();
    eventually([&] { return !robot.is_open(); });
  }

  bool ready() {
    return eventually([&] {
      const RobotLink link = robot.state().link;
      if (link == RobotLink::kNotReferenced && !robot.core_state().rereference_pending)
        robot.rereference();
      return link == RobotLink::kReady && contact.status().link == ContactLink::kReady &&
             contact.status().in_contact == false;
    });
  }
  std::optional<MoveResult> result() {
    std::optional<MoveResult> one;
    eventually([&] { return (one = robot.poll()).has_value(); });
    return one;
  }
  /// True if the arm has moved by this; not if the move has ended before, as on a machine that stalls.
  bool has_left(const AxisAngles& from, double by_rad) {
    bool left = false;
    eventually([&] {
      left = std::abs(robot.state().actual_rad[0] - from[0]) > by_rad;
      return left || robot.poll().has_value();
    });
    return left;
  }
  /// A search ended by a contact.
  bool search(std::uint16_t id) {
    if (!ready()) return false;
    contact.arm(id, milliseconds{20'000});
    std::optional<ArmResult> armed;
    eventually([&] { return (armed = contact.poll_arm()).has_value(); });
    if (!armed || !armed->armed) return false;
    const AxisAngles from = robot.state().actual_rad;
    AxisAngles target = from;
    target[0] += id % 2 == 0 ? kTravelRad : -kTravelRad;
    robot.begin({id, MoveKind::kSearch, target, kTravelRad / kSpeedRadS, id});
    if (!has_left(from, kTravelRad / 20)) return false;
    sensor.edge(std::chrono::steady_clock::now(), true);
    const auto ended = result();
    sensor.edge(std::chrono::steady_clock::now(), false);
    return ended && ended->outcome == MoveOutcome::kContact;
  }
  /// A transit stopped on its way.
  bool stop_a_transit(std::uint32_t id) {
    if (!ready()) return false;
    const AxisAngles from = robot.state().actual_rad;
    AxisAngles target = from;
    target[0] += 100 * kEkiDeg;
    robot.begin({id, MoveKind::kTransit, target, 0.0, 0});
    if (!has_left(from, kEkiDeg)) return false;
    robot.stop();
    const auto ended = result();
    return ended && ended->outcome == MoveOutcome::kStopped;
  }

  static constexpr double kTravelRad = 0.01, kSpeedRadS = 0.004;
  Controller krc;
  sim::McuPty sensor{{}};
  IoThread io{IoThreadOptions{.realtime = false}};
  SerialContact contact{io.context(), contact_at(sensor.path())};
  EkiRobot robot{io.context(), flagged(krc.port()), &contact.guard()};
};

TEST(EkiThreadSyscalls, SleepsInNoSystemCallButItsOwnWaitWhileItMovesTouchesAndStops) {
  EkiCell cell;
  ASSERT_TRUE(cell.ready()) << cell.robot.state().words << "; " << cell.contact.status().words;
  SyscallTrace trace(thread_of(cell.io.context()));
  if (!trace.why_not().empty()) {
    GTEST_SKIP() << "threads must not be traced here (" << trace.why_not() << ")";
  }
  int contacts = 0;
  bool stopped = false;
  for (std::uint16_t id = 1; id <= kEkiTries && contacts < kEkiSearches; ++id) {
    if (cell.search(id)) ++contacts;
  }
  for (std::uint32_t id = 1; id <= kEkiTries && !stopped; ++id)
    stopped = cell.stop_a_transit(kEkiTries + id);
  const std::vector<Syscall> calls = trace.stop();
  ASSERT_EQ(contacts, kEkiSearches)
      << cell.robot.state().words << "; " << cell.contact.status().words;
  ASSERT_TRUE(stopped) << cell.robot.state().words;
  expect_no_sleep(calls, 30);
}

}  // namespace
}  // namespace cellcal::test
