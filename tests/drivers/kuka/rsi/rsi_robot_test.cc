// The adapter on real sockets. The machine may be loaded: results depend only on whether and in
// which order events happen, not on their time.

#include "drivers/kuka/rsi/rsi_robot.h"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/post.hpp>
#include <future>
#include <thread>

#include "drivers/error.h"
#include "drivers/io_thread.h"
#include "sim/krc/krc_udp.h"
#include "tests/drivers/kuka/allocation_count.h"
#include "tests/drivers/kuka/eventually.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;

RsiConfig loopback() {
  RsiConfig config = rig_config();
  config.bind_address = "127.0.0.1";
  config.port = 0;
  // Tolerates a loaded machine.
  config.silence_cycles = 50;
  config.late_replies_limit = 1'000'000;
  return config;
}

sim::ControllerConfig patient() {
  sim::ControllerConfig config;
  config.timeout_cycles = 1000;
  return config;
}

/// A controller reduced to its socket.
class Peer {
 public:
  explicit Peer(const RsiRobot& robot)
      : pc_(asio::ip::address_v4::loopback(), robot.port()),
        socket_(context_, udp::endpoint(udp::v4(), 0)) {
    socket_.non_blocking(true);
  }
  void send(const std::string& bytes) { socket_.send_to(asio::buffer(bytes), pc_); }
  /// Empty if nothing is pending.
  std::string take() {
    std::array<char, 2048> buffer{};
    udp::endpoint from;
    boost::system::error_code error;
    const std::size_t got = socket_.receive_from(asio::buffer(buffer), from, 0, error);
    return error ? std::string() : std::string(buffer.data(), got);
  }
  std::string await() {
    std::string reply;
    EXPECT_TRUE(eventually([&] { return !(reply = take()).empty(); }));
    return reply;
  }

 private:
  asio::io_context context_;
  udp::endpoint pc_;
  udp::socket socket_;
};

class RsiOverUdp : public ::testing::Test {
 protected:
  RsiOverUdp() : io(IoThreadOptions{.realtime = false}) { io.start(); }

  static sim::KrcUdpOptions to(const RsiRobot& robot) {
    sim::KrcUdpOptions options;
    options.pc_port = robot.port();
    return options;
  }
  static bool make_ready(RsiRobot& robot) {
    const auto link = [&] { return robot.state().link; };
    return eventually([&] { return link() == RobotLink::kNotReferenced; }) && eventually([&] {
             robot.rereference();
             return eventually([&] { return link() == RobotLink::kReady; });
           });
  }
  static MoveResult move(RsiRobot& robot, double deg) {
    Move move{1, MoveKind::kTransit, robot.state().commanded_rad, 0.0, 0};
    move.target_rad[0] += deg * kDeg;
    robot.begin(move);
    std::optional<MoveResult> result;
    EXPECT_TRUE(eventually([&] { return (result = robot.poll()).has_value(); }));
    return result.value_or(MoveResult{});
  }
  static std::string packet(int ipoc) {
    const std::string axes =
        "A1=\"0.0000\" A2=\"-90.0000\" A3=\"90.0000\" A4=\"0.0000\" A5=\"90.0000\" "
        "A6=\"0.0000\"/>";
    return "<Rob Type=\"KUKA\"><AIPos " + axes + "<ASPos " + axes + "<Delay D=\"0\"/><IPOC>" +
           std::to_string(ipoc) + "</IPOC></Rob>";
  }

  IoThread io;
};

TEST_F(RsiOverUdp, MovesAnArmAndEndsTheSession) {
  ScriptedGuard guard;
  RsiRobot robot(io.context(), loopback(), &guard);
  robot.open();
  sim::KrcUdp krc(patient(), to(robot));
  krc.start();
  ASSERT_TRUE(make_ready(robot)) << robot.state().words;
  const MoveResult result = move(robot, 5);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << result.detail;
  EXPECT_NEAR(robot.state().actual_rad[0], 5 * kDeg, 0.01 * kDeg);
  EXPECT_GT(robot.reply_times().count(), 50U);
  EXPECT_GT(robot.reply_times().quantile_s(0.5), 0.0);
  EXPECT_LE(robot.reply_times().quantile_s(0.5), robot.reply_times().quantile_s(0.99));
  robot.close();
  EXPECT_TRUE(eventually([&] {
    sim::RsiPhase phase{};
    krc.with([&](sim::Controller& controller) { phase = controller.phase(); });
    return phase == sim::RsiPhase::kEnded;
  }));
  EXPECT_TRUE(eventually([&] { return robot.port() == 0; }));
  EXPECT_EQ(robot.state().link, RobotLink::kDown);
}

TEST_F(RsiOverUdp, PacketsThatArriveTwiceAreCountedWhetherReadAtOnceOrApart) {
  RsiRobot robot(io.context(), loopback(), nullptr);
  robot.open();
  Peer peer(robot);
  for (int i = 0; i < 20; ++i) {
    peer.send(packet(1000 + 4 * i));
    peer.await();
    if (i < 10) continue;
    peer.send(packet(1000 + 4 * i));  // individually: answered again
    peer.await();
  }
  EXPECT_TRUE(eventually([&] { return robot.state().quality.duplicates == 10; }))
      << robot.state().quality.duplicates;
  // Both wait in the socket while its thread is busy.
  std::promise<void> go;
  std::shared_future<void> gone = go.get_future().share();
  asio::post(io.context(), [gone] { gone.wait(); });
  peer.send(packet(1080));
  peer.send(packet(1080));
  go.set_value();
  EXPECT_TRUE(eventually([&] { return robot.state().quality.duplicates == 11; }))
      << robot.state().quality.duplicates;
}

TEST_F(RsiOverUdp, PortThatIsTakenIsNamed) {
  RsiRobot first(io.context(), loopback(), nullptr);
  first.open();
  RsiConfig config = loopback();
  config.port = first.port();
  RsiRobot second(io.context(), config, nullptr);
  try {
    second.open();
    FAIL() << "two adapters on one port";
  } catch (const DriverError& error) {
    EXPECT_NE(std::string(error.what()).find(std::to_string(config.port)), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("127.0.0.1"), std::string::npos);
  }
  EXPECT_THROW(first.open(), DriverError) << "open twice";
}

TEST_F(RsiOverUdp, AddressThatIsNoneIsNamed) {
  RsiConfig config = loopback();
  config.bind_address = "robot";
  RsiRobot robot(io.context(), config, nullptr);
  EXPECT_THROW(robot.open(), DriverError);
  config.bind_address = "203.0.113.7";  // documentation address; not assigned
  RsiRobot elsewhere(io.context(), config, nullptr);
  EXPECT_THROW(elsewhere.open(), DriverError);
}

TEST_F(RsiOverUdp, MoveWithoutALinkIsRefusedAtOnce) {
  RsiRobot robot(io.context(), loopback(), nullptr);
  robot.begin({9, MoveKind::kTransit, {}, 0.0, 0});
  const auto result = robot.poll();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->id, 9U);
  EXPECT_EQ(result->outcome, MoveOutcome::kRefused);
}

TEST_F(RsiOverUdp, BacklogIsAnsweredOnceWithTheNewestIpoc) {
  RsiRobot robot(io.context(), loopback(), nullptr);
  robot.open();
  Peer krc(robot);
  std::promise<void> held, sent;
  asio::post(io.context(), [&] {  // the I/O thread is busy while packets come
    held.set_value();
    sent.get_future().wait();
  });
  held.get_future().wait();
  for (int i = 1; i <= 10; ++i) krc.send(packet(1000 + 4 * i));
  sent.set_value();
  EXPECT_NE(krc.await().find("<IPOC>1040</IPOC>"), std::string::npos);
  EXPECT_EQ(krc.take(), "") << "one reply, not ten";
}

TEST_F(RsiOverUdp, SecondControllerOnThePortIsIgnoredAndNamed) {
  RsiRobot robot(io.context(), loopback(), nullptr);
  robot.open();
  Peer first(robot), second(robot);
  second.send("who is there?");  // locks nothing
  first.send(packet(1000));
  EXPECT_NE(first.await(), "");
  second.send(packet(77'000));
  EXPECT_TRUE(eventually([&] { return robot.foreign_packets() == 1; }));
  EXPECT_NE(said(robot.state().words).find("127.0.0.1"), std::string::npos) << robot.state().words;
  EXPECT_EQ(second.take(), "");
}

TEST_F(RsiOverUdp, OversizedDatagramsAreCountedAsDamaged) {
  RsiRobot robot(io.context(), loopback(), nullptr);
  robot.open();
  Peer(robot).send(std::string(20'000, 'x'));
  EXPECT_TRUE(eventually([&] {
    return said(robot.state().words).find("more than 8192 bytes") != std::string::npos;
  })) << robot.state().words;
}

TEST_F(RsiOverUdp, PacketsOfAllSixtyFourChannelsAreRead) {
  RsiRobot robot(io.context(), loopback(), nullptr);
  robot.open();
  Peer krc(robot);
  std::string more;
  for (int i = 0; i < 64; ++i) more += "<Tech" + std::to_string(i) + " C1=\"0.123456789012\"/>";
  std::string large = packet(1000);
  large.insert(large.find("<Delay"), more);
  EXPECT_GT(large.size(), 2000U);
  krc.send(large);
  EXPECT_NE(krc.await().find("<IPOC>1000</IPOC>"), std::string::npos);
}

TEST_F(RsiOverUdp, TheCycleOnItsSocketDoesNotAllocate) {
  RsiRobot robot(io.context(), loopback(), nullptr);
  robot.open();
  sim::KrcUdp krc(patient(), to(robot));
  krc.start();
  ASSERT_TRUE(make_ready(robot)) << robot.state().words;
  const std::uint64_t first = robot.reply_times().count();
  const long before = asked_on(io.context(), allocations_of_this_thread);
  EXPECT_EQ(move(robot, 5).outcome, MoveOutcome::kArrived);
  const long after = asked_on(io.context(), allocations_of_this_thread);
  EXPECT_GT(robot.reply_times().count(), first + 50);
  EXPECT_LE(after - before, 1) << "the question itself";
}

TEST_F(RsiOverUdp, CablePulledAndPluggedInNeedsAReference) {
  RsiRobot robot(io.context(), loopback(), nullptr);
  robot.open();
  sim::KrcUdp krc(patient(), to(robot));
  krc.start();
  ASSERT_TRUE(make_ready(robot)) << robot.state().words;
  EXPECT_EQ(move(robot, 3).outcome, MoveOutcome::kArrived);
  Move away{2, MoveKind::kTransit, robot.state().commanded_rad, 20.0, 0};
  away.target_rad[0] += 20 * kDeg;
  robot.begin(away);
  ASSERT_TRUE(eventually([&] { return robot.state().moving; }));
  krc.unplug(true);
  std::optional<MoveResult> result;
  ASSERT_TRUE(eventually([&] { return (result = robot.poll()).has_value(); }));
  EXPECT_EQ(result->outcome, MoveOutcome::kRobotSilent);
  EXPECT_EQ(robot.state().link, RobotLink::kLost);
  krc.unplug(false);
  ASSERT_TRUE(eventually([&] { return robot.state().link == RobotLink::kNotReferenced; }));
  EXPECT_EQ(move(robot, 1).outcome, MoveOutcome::kRefused);
  ASSERT_TRUE(make_ready(robot)) << robot.state().words;
  EXPECT_EQ(move(robot, 1).outcome, MoveOutcome::kArrived);
}

TEST_F(RsiOverUdp, RestartedProgramWorksOnceTheOperatorHasRestartedRsi) {
  RsiConfig config = loopback();
  sim::ControllerConfig controller;
  controller.send_setpoint = false;  // the hard case: only a new session can be trusted
  controller.timeout_cycles = 25;
  auto robot = std::make_unique<RsiRobot>(io.context(), config, nullptr);
  robot->open();
  config.port = robot->port();
  sim::KrcUdpOptions options = to(*robot);
  options.restart_after_s = 0.3;
  sim::KrcUdp krc(controller, options);
  // Without ASPos a session counts as new only after a silence, and with a Delay that counts.
  std::this_thread::sleep_for(400ms);
  krc.start();
  ASSERT_TRUE(make_ready(*robot)) << robot->state().words;
  EXPECT_EQ(move(*robot, 3).outcome, MoveOutcome::kArrived);
  robot.reset();  // the program ends without a message to the controller
  robot = std::make_unique<RsiRobot>(io.context(), config, nullptr);
  robot->open();
  // A session that ended in between may require a second request.
  ASSERT_TRUE(eventually([&] {
    const RobotLink link = robot->state().link;
    if (link == RobotLink::kNotReferenced && !robot->core_state().rereference_pending)
      robot->rereference();
    return link == RobotLink::kReady;
  })) << robot->state().words;
  EXPECT_NEAR(robot->state().actual_rad[0], 3 * kDeg, 0.05 * kDeg);
  EXPECT_EQ(move(*robot, -3).outcome, MoveOutcome::kArrived);
}

TEST_F(RsiOverUdp, AProgramThatTheOperatorStartsAgainBehindStopServesTheNextSession) {
  RsiConfig config = loopback();
  std::unique_ptr<sim::KrcUdp> krc;
  for (int session = 0; session < 2; ++session) {
    RsiRobot robot(io.context(), config, nullptr);
    robot.open();
    config.port = robot.port();
    if (!krc) {
      sim::KrcUdpOptions options = to(robot);
      options.restart_after_s = 0.3;  // longer than the silence that ends a session here
      krc = std::make_unique<sim::KrcUdp>(patient(), options);
      krc->start();
    }
    ASSERT_TRUE(make_ready(robot)) << session << ": " << robot.state().words;
    EXPECT_EQ(move(robot, 1).outcome, MoveOutcome::kArrived);
    robot.close();
    ASSERT_TRUE(eventually([&] { return robot.port() == 0; }));
  }
}

TEST_F(RsiOverUdp, MayBeOpenedAgainAfterClose) {
  RsiConfig config = loopback();
  config.stop_tag = "";
  RsiRobot robot(io.context(), config, nullptr);
  for (int i = 0; i < 2; ++i) {
    robot.open();
    EXPECT_NE(robot.port(), 0);
    robot.close();
    EXPECT_TRUE(eventually([&] { return robot.port() == 0; }));
  }
}

TEST(RsiRobotLife, EndsWithAStoppedContext) {
  IoThread io(IoThreadOptions{.realtime = false});
  io.start();
  RsiRobot robot(io.context(), loopback(), nullptr);
  robot.open();
  io.stop();
}

TEST(IoThread, RunsHandlersAndNamesWhatRealTimeItLacks) {
  IoThread io;
  io.start();
  std::promise<std::thread::id> where;
  asio::post(io.context(), [&] { where.set_value(std::this_thread::get_id()); });
  EXPECT_NE(where.get_future().get(), std::this_thread::get_id());
  for (const std::string& warning : io.warnings()) {
    EXPECT_NE(warning.find("Grant"), std::string::npos) << warning;
  }
}

}  // namespace
}  // namespace cellcal::drivers
