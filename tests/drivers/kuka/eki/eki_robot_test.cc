// The adapter on real sockets. The machine may be loaded: results depend only on whether and in
// which order events happen, not on their time.

#include "drivers/kuka/eki/eki_robot.h"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <thread>

#include "drivers/error.h"
#include "drivers/io_thread.h"
#include "sim/krc/eki_server.h"
#include "tests/drivers/kuka/allocation_count.h"
#include "tests/drivers/kuka/eki/eki_rig.h"
#include "tests/drivers/kuka/eventually.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

class EkiSockets : public ::testing::Test {
 protected:
  void SetUp() override {
    krc.start();
    io.start();
  }
  void TearDown() override { robot.reset(); }

  void make_robot() {
    robot = std::make_unique<EkiRobot>(io.context(), eki_loopback(krc.port()), &guard);
  }
  void make_ready() {
    make_robot();
    robot->open();
    ASSERT_TRUE(await(RobotLink::kNotReferenced)) << robot->state().words;
    reference();
  }
  void reference() {
    robot->rereference();
    ASSERT_TRUE(await(RobotLink::kReady)) << robot->state().words;
  }
  bool await(RobotLink link) {
    return eventually([&] { return robot->state().link == link; });
  }
  MoveResult await_result() {
    std::optional<MoveResult> result;
    EXPECT_TRUE(eventually([&] { return (result = robot->poll()).has_value(); }));
    return result.value_or(MoveResult{});
  }
  AxisAngles moved_by(double deg) {
    AxisAngles target = robot->state().actual_rad;
    target[0] += deg * kEkiDeg;
    return target;
  }

  ScriptedGuard guard;
  sim::EkiServer krc{patient_eki_controller(),
                     {.address = "127.0.0.1", .port = 0, .realtime = false}};
  IoThread io{IoThreadOptions{.realtime = false}};
  std::unique_ptr<EkiRobot> robot;
};

TEST_F(EkiSockets, MovesTheEmulatedController) {
  make_ready();
  const AxisAngles target = moved_by(10);
  robot->begin({1, MoveKind::kTransit, target, 0.0, 0});
  const MoveResult result = await_result();
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << result.detail;
  EXPECT_NEAR(result.at_rad[0], target[0], 1e-5);
}

TEST_F(EkiSockets, TheCycleOnItsSocketDoesNotAllocate) {
  make_ready();
  // Handlers and buffers reach their final sizes in the first move.
  robot->begin({1, MoveKind::kTransit, moved_by(2), 0.0, 0});
  EXPECT_EQ(await_result().outcome, MoveOutcome::kArrived);
  const std::uint64_t first = robot->state().packets;
  const long before = asked_on(io.context(), allocations_of_this_thread);
  robot->begin({2, MoveKind::kTransit, moved_by(-2), 0.0, 0});
  EXPECT_EQ(await_result().outcome, MoveOutcome::kArrived);
  const long after = asked_on(io.context(), allocations_of_this_thread);
  EXPECT_GT(robot->state().packets, first + 10);
  EXPECT_LE(after - before, 1) << "the question itself";
}

TEST_F(EkiSockets, StopsWhenAsked) {
  make_ready();
  robot->begin({1, MoveKind::kTransit, moved_by(150), 0.0, 0});
  ASSERT_TRUE(eventually([&] { return std::abs(robot->state().actual_rad[0]) > kEkiDeg; }));
  robot->stop();
  EXPECT_EQ(await_result().outcome, MoveOutcome::kStopped);
}

TEST_F(EkiSockets, ASecondClientIsRefusedAndTheFirstIsNotDisturbed) {
  make_ready();
  EkiRobot second(io.context(), eki_loopback(krc.port()), nullptr);
  second.open();
  EXPECT_TRUE(eventually([&] { return krc.refused_clients() >= 2; })) << "it tries again";
  EXPECT_NE(second.state().link, RobotLink::kReady);
  // Reported once the attempt has ended, possibly after the controller counted it.
  EXPECT_TRUE(eventually([&] {
    return said(second.state().words).find("accepts one") != std::string::npos;
  })) << second.state().words;
  robot->begin({1, MoveKind::kTransit, moved_by(2), 0.0, 0});
  EXPECT_EQ(await_result().outcome, MoveOutcome::kArrived);
}

TEST_F(EkiSockets, ComesBackAfterTheControllerDidAndMovesOnlyAfterAReference) {
  make_ready();
  robot->begin({1, MoveKind::kTransit, moved_by(150), 0.0, 0});
  ASSERT_TRUE(eventually([&] { return std::abs(robot->state().actual_rad[0]) > kEkiDeg; }));
  krc.with([](sim::EkiController& c) { c.disconnect(); });
  EXPECT_EQ(await_result().outcome, MoveOutcome::kRobotSilent);
  ASSERT_TRUE(await(RobotLink::kNotReferenced)) << robot->state().words;
  robot->begin({2, MoveKind::kTransit, moved_by(1), 0.0, 0});
  EXPECT_EQ(await_result().outcome, MoveOutcome::kRefused);
  reference();
  robot->begin({3, MoveKind::kTransit, moved_by(-1), 0.0, 0});
  EXPECT_EQ(await_result().outcome, MoveOutcome::kArrived);
}

TEST_F(EkiSockets, SaysGoodbyeAndCanBeOpenedAgain) {
  make_ready();
  EXPECT_THROW(robot->open(), DriverError);
  robot->close();
  ASSERT_TRUE(eventually([&] { return !robot->is_open(); }));
  EXPECT_TRUE(eventually([&] {
    bool obeys_nobody = false;
    krc.with([&](sim::EkiController& c) { obeys_nobody = c.session() == 0; });
    return obeys_nobody;
  }));
  EXPECT_NE(said(robot->state().words).find("closed"), std::string::npos);
  robot->begin({1, MoveKind::kTransit, AxisAngles(6, 0.0), 0.0, 0});
  EXPECT_EQ(await_result().outcome, MoveOutcome::kRefused);
  ASSERT_TRUE(eventually([&] {
    bool listens = false;
    krc.with([&](sim::EkiController& c) { listens = !c.connected(); });
    return listens;
  }));
  robot->open();
  EXPECT_TRUE(await(RobotLink::kNotReferenced)) << robot->state().words;
}

TEST_F(EkiSockets, NobodyThereIsNamedWithWhatToCheck) {
  krc.stop();
  EkiRobot alone(io.context(), eki_loopback(1), nullptr);
  alone.open();
  EXPECT_TRUE(eventually(
      [&] { return said(alone.state().words).find("Last error: ") != std::string::npos; }));
  EXPECT_NE(said(alone.state().words).find("127.0.0.1:1"), std::string::npos)
      << alone.state().words;
}

TEST_F(EkiSockets, AnAddressThatIsNoneIsRefusedAtOnce) {
  EkiConfig config = eki_loopback(54600);
  config.address = "krc4.local";
  EkiRobot wrong(io.context(), config, nullptr);
  EXPECT_THROW(wrong.open(), DriverError);
}

TEST_F(EkiSockets, APeerThatTalksNonsenseIsLeft) {
  asio::io_context context;
  tcp::acceptor acceptor(context, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
  EkiRobot wrong(io.context(), eki_loopback(acceptor.local_endpoint().port()), nullptr);
  wrong.open();
  for (const std::string& nonsense : {std::string(20000, 'x'), "<R>" + std::string(20000, 'y')}) {
    tcp::socket peer = acceptor.accept();
    boost::system::error_code error;
    asio::write(peer, asio::buffer(nonsense), error);
    char byte = 0;
    while (!error) peer.read_some(asio::buffer(&byte, 1), error);  // the hello, then the end
    EXPECT_TRUE(error);
  }
  EXPECT_NE(wrong.state().link, RobotLink::kReady);
}

}  // namespace
}  // namespace cellcal::drivers
