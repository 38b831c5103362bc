// Two consecutive sessions with a peer that sleeps, over a real socket and in real time.

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <memory>
#include <thread>

#include "drivers/io_thread.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "tests/drivers/kuka/eventually.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/kuka/rsi/sleepy_peer.h"

namespace cellcal::drivers {
namespace {

using boost::asio::ip::udp;

/// The peer's program: one thread, one socket, sleeps.
class SleepyProgram {
 public:
  SleepyProgram(const SleepyHabits& habits, std::uint16_t port)
      : peer_(habits, {0.0, -90 * kDeg, 90 * kDeg, 0.0, 90 * kDeg, 0.0}),
        pc_(boost::asio::ip::address_v4::loopback(), port),
        socket_(context_, udp::endpoint(udp::v4(), 0)) {
    socket_.non_blocking(true);
    thread_ = std::thread([this] { run(); });
  }
  ~SleepyProgram() {
    stop_ = true;
    thread_.join();
  }

  double held_deg() const { return held_deg_.load(); }
  double largest_step_deg() const { return largest_step_deg_.load(); }

 private:
  void run() {
    while (!stop_) {
      const TimePoint now = std::chrono::steady_clock::now();
      boost::system::error_code error;  // nothing listens: the tested condition
      if (const std::string packet = peer_.tick(now); !packet.empty()) {
        socket_.send_to(boost::asio::buffer(packet), pc_, 0, error);
      }
      std::array<char, 2048> buffer{};
      udp::endpoint from;
      const std::size_t got = socket_.receive_from(boost::asio::buffer(buffer), from, 0, error);
      if (!error) peer_.receive({buffer.data(), got}, std::chrono::steady_clock::now());
      held_deg_ = peer_.held_rad(0) / kDeg;
      largest_step_deg_ = peer_.largest_step_rad() / kDeg;
      std::this_thread::sleep_for(200us);
    }
  }

  SleepyPeer peer_;
  boost::asio::io_context context_;
  udp::endpoint pc_;
  udp::socket socket_;
  std::atomic<bool> stop_{false};
  std::atomic<double> held_deg_{0.0}, largest_step_deg_{0.0};
  std::thread thread_;
};

/// Requested once, as in a session. A machine that stalls for longer than the peer may pause is not
/// tested; a loss before any answer is.
bool make_ready(RsiRobot& robot) {
  RobotLink last = RobotLink::kDown;
  bool lost_unanswered = false;
  const bool ended = eventually([&] {
    const RobotState state = robot.state();
    if (state.link != last && state.link == RobotLink::kNotReferenced) robot.rereference();
    last = state.link;
    lost_unanswered = last == RobotLink::kLost && state.quality.replies == 0;
    return last == RobotLink::kReady || lost_unanswered;
  });
  return ended && !lost_unanswered;
}

MoveOutcome go_to(RsiRobot& robot, double a1_deg) {
  std::optional<MoveResult> result;
  for (int tries = 0; tries < 3; ++tries) {
    Move move{1, MoveKind::kTransit, robot.state().commanded_rad, 0.0, 0};
    move.target_rad[0] = a1_deg * kDeg;
    robot.begin(move);
    const bool ended = eventually([&] { return (result = robot.poll()).has_value(); });
    if (!ended || result->outcome != MoveOutcome::kRobotSilent || !make_ready(robot)) break;
  }
  return result ? result->outcome : MoveOutcome::kRefused;
}

TEST(RsiSleepyPeerOverUdp, IsFoundAgainByTheNextSessionWithWhatItHolds) {
  IoThread io(IoThreadOptions{.realtime = false});
  io.start();
  RsiConfig config = rig_config();
  config.bind_address = "127.0.0.1";
  config.port = 0;
  std::unique_ptr<SleepyProgram> program;
  for (int session = 1; session <= 2; ++session) {
    RsiRobot robot(io.context(), config, nullptr);
    robot.open();
    config.port = robot.port();
    if (!program) program = std::make_unique<SleepyProgram>(SleepyHabits{}, config.port);
    ASSERT_TRUE(make_ready(robot)) << session << ": " << robot.state().words;
    const double target_deg = 2.0 * session;
    const MoveOutcome outcome = go_to(robot, target_deg);
    EXPECT_EQ(outcome, MoveOutcome::kArrived) << robot.state().words;
    EXPECT_NEAR(program->held_deg(), target_deg, 1e-3);
    EXPECT_LT(program->largest_step_deg(), 1.5) << "no jump at the beginning of a session";
    robot.close();
    ASSERT_TRUE(eventually([&] { return robot.port() == 0; }));
  }
}

}  // namespace
}  // namespace cellcal::drivers
