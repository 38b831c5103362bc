// Whole sessions with a peer other than a controller: a typical first program of integrators, which
// is paced by sleeping, counts packets in IPOC, waits for replies, repeats packets after a second
// and holds the last accepted correction (sleepy_peer.h). In virtual time; the peer is not
// restarted between sessions.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "cell.h"
#include "daemon/tasks/tasks.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "session.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/drivers/kuka/rsi/sleepy_peer.h"

namespace cellcal::faults {
namespace {

using namespace std::chrono_literals;
using drivers::SleepyHabits;

// One-way delay of loopback and adapter.
constexpr std::chrono::microseconds kOneWay{40};
// Polling period of its computer's clock and the arm.
constexpr std::chrono::microseconds kStep{500};
constexpr int kTouches = 4;

daemon::DaemonConfig config() {
  return daemon::parse_config(
      "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n[motion]\nspeed_percent = 80\n"
      "acceleration_deg_s2 = 600\njerk_deg_s3 = 8000\n[rsi]\ncorrection_limit_deg = 360\n",
      "sleepy.toml");
}

class SleepyCell final : public FaultyCell {
 public:
  SleepyCell(const calib::Cell& cell, const SleepyHabits& habits)
      : FaultyCell(cell, {}),
        rsi_(daemon::rsi_config_for(config(), cell)),
        peer_(habits, start(cell)),
        to_pc_(sim::LineKind::kDatagrams, kOneWay, 1),
        to_krc_(sim::LineKind::kDatagrams, kOneWay, 2) {
    new_adapters();
  }

  drivers::Robot& robot() override { return *robot_; }
  /// As between two sessions of a daemon: no adapter listens.
  void leave(Duration duration) {
    robot_.reset();
    live(duration);
    new_adapters();
  }

  sim::Line& to_pc() override { return to_pc_; }
  sim::Line& to_krc() override { return to_krc_; }
  std::vector<double> position_rad() const override { return true_rad_at(now()); }
  // Its faults are not used here.
  void power_off(bool) override {}
  void block_drives(bool) override {}
  void operator_stops() override {}
  void robot_fault() override {}
  void cancel_program() override {}
  void second_on_port(bool) override {}
  void input_wire(bool) override {}

 protected:
  std::vector<double> true_rad_at(TimePoint t) const override { return peer_.actual_rad_at(t); }
  Duration cycle() const override { return kStep; }
  void tick(TimePoint t) override { to_pc_.send(peer_.tick(t), t); }
  TimePoint next_message() const override { return std::min(to_pc_.next(), to_krc_.next()); }
  void deliver_messages() override {
    while (const auto packet = to_pc_.take(now_)) {
      if (robot_) to_krc_.send(robot_->on_datagram(packet->bytes, now_), now_);
    }
    while (const auto reply = to_krc_.take(now_)) peer_.receive(reply->bytes, now_);
  }
  void pc_tick() override {
    if (robot_) robot_->on_tick(now_);
  }
  void make_robot() override {
    robot_ = std::make_unique<drivers::RsiRobotInline>(rsi_, &contact_->guard());
  }
  void repair_controller() override {}
  void input(bool) override {}

 private:
  static std::vector<double> start(const calib::Cell& cell) {
    std::vector<double> start_rad = config().mock.start_rad;
    start_rad.resize(cell.robot.joints.size(), 0.0);
    return start_rad;
  }

  drivers::RsiConfig rsi_;
  drivers::SleepyPeer peer_;
  sim::Line to_pc_, to_krc_;
  std::unique_ptr<drivers::RsiRobotInline> robot_;
};

/// From the true contact of the tip with the sphere.
double distance_m(const FaultyCell& cell, const calib::Touch& touch) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const Edge& edge : cell.edges()) {
    if (!edge.closed) continue;
    const Eigen::Vector3d apart =
        cell.physical().tip_m(touch.joint_rad) - cell.physical().tip_m(edge.joint_rad);
    nearest_m = std::min(nearest_m, apart.norm());
  }
  return nearest_m;
}

struct Peer {
  const char* name;
  SleepyHabits habits;
  double within_m;
};

class SleepyPeerSession : public ::testing::TestWithParam<Peer> {};

TEST_P(SleepyPeerSession, EndsWithAllTouchesRightThreeTimesRunning) {
  static const Job job = [] {
    Job made = make_job(CELLCAL_DEMO_CELL);
    calib::PlanOptions options;
    options.fit_touches = kTouches;
    options.check_touches = 0;
    made.plan = calib::make_plan(made.cell, options);
    made.plan_hash = daemon::plan_hash(made.plan);
    return made;
  }();
  const daemon::testing::TemporaryDirectory folder;
  daemon::Journal journal(folder.path() / "journal.db");
  SleepyCell cell(job.cell, GetParam().habits);
  for (int k = 0; k < 3; ++k) {
    const std::int64_t session = journal.begin(job.inputs, "2000-01-01T00:00:00.000Z");
    cell.end_by(cell.now() + 20min);
    const Ending ending = run_session(cell, job, journal, session, false);
    ASSERT_EQ(ending.hung, "");
    ASSERT_EQ(ending.state.phase, daemon::Phase::kDone)
        << "session " << k + 1 << ": "
        << (ending.state.failure ? describe(*ending.state.failure) : std::string());
    const auto touches = journal.touches(session);
    EXPECT_EQ(touches.size(), static_cast<std::size_t>(kTouches));
    for (const calib::Touch& touch : touches) {
      EXPECT_LT(distance_m(cell, touch), GetParam().within_m) << "session " << k + 1;
    }
    cell.leave(3700ms);
  }
  EXPECT_EQ(cell.crashes(), 0);
}

// Within 0.03 mm, the cell file's 1 sigma of a touch. With widely spaced packets the arm does not
// move straight between them, and the latch states a larger uncertainty.
INSTANTIATE_TEST_SUITE_P(
    That, SleepyPeerSession,
    ::testing::Values(
        Peer{"paces_2500_us_with_pauses",
             {.sleep_s = 0.0025, .jitter = 0.3, .drift = 0.3, .pause_s = 0.05},
             0.03e-3},
        Peer{"counts_milliseconds_that_are_none",
             {.sleep_s = 0.004, .jitter = 0.05, .drift = 0.1, .ipoc_step = 4},
             0.03e-3},
        Peer{"goes_on_counting_while_nobody_answers",
             {.sleep_s = 0.012, .jitter = 0.2, .drift = 0.2, .counts_on = true},
             0.03e-3},
        Peer{"paces_38_ms", {.sleep_s = 0.034, .jitter = 0.05, .drift = 0.1}, 0.06e-3}),
    [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace cellcal::faults
