// Adapter, contact sensor's core, emulated controller and microcontroller together: the arm stops
// if any of them falls silent.

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "calib/files/files.h"
#include "daemon/backends/virtual_cell.h"
#include "daemon/config/config.h"
#include "drivers/kuka/krl/krl_files.h"
#include "tests/drivers/said.h"

namespace cellcal::daemon {
namespace {

using namespace std::chrono_literals;
using drivers::MoveOutcome;
constexpr double kDeg = std::numbers::pi / 180.0;

class AnEkiCell : public ::testing::TestWithParam<drivers::EkiStop> {
 protected:
  void SetUp() override {
    const calib::Cell demo = calib::load_cell(CELLCAL_DEMO_CELL);
    DaemonConfig config = parse_config(
        "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n[mock]\nwire = \"eki\"\n", "d.toml");
    config.eki.stop = GetParam();
    VirtualEkiCellOptions options;
    config.controller.contact_is_on = false;
    options.controller.files = drivers::eki_files(config.controller);
    options.controller.start_rad = config.mock.start_rad;
    options.eki = eki_config_for(config, demo);
    cell = std::make_unique<VirtualEkiCell>(demo, options);
    cell->robot().open();
    cell->contact().open();
    ASSERT_TRUE(until([&] {
      return cell->robot().state().link == drivers::RobotLink::kNotReferenced &&
             cell->contact().status().link == drivers::ContactLink::kReady;
    })) << cell->robot().state().words
        << cell->contact().status().words;
    cell->robot().rereference();
    ASSERT_TRUE(until([&] { return cell->robot().state().link == drivers::RobotLink::kReady; }));
  }

  bool until(const std::function<bool()>& done, drivers::Duration limit = 15s) {
    for (const auto end = cell->now() + limit; cell->now() < end;) {
      cell->sleep_until(cell->now() + 1ms);
      if (done()) return true;
    }
    return false;
  }
  /// A1 at 0.5 deg/s through free space, for a second.
  void search() {
    cell->contact().arm(1, 30s);
    std::optional<drivers::ArmResult> armed;
    ASSERT_TRUE(until([&] { return (armed = cell->contact().poll_arm()).has_value(); }));
    ASSERT_TRUE(armed->armed) << armed->why_not;
    drivers::Move move{1, drivers::MoveKind::kSearch, cell->robot().state().actual_rad, 10.0, 1};
    move.target_rad[0] += 5 * kDeg;
    cell->robot().begin(move);
    until([] { return false; }, 1s);
    ASSERT_FALSE(cell->controller().at_rest());
    at_fault_deg = a1_deg();
  }
  drivers::MoveResult result() {
    std::optional<drivers::MoveResult> one;
    EXPECT_TRUE(until([&] { return (one = cell->robot().poll()).has_value(); }));
    return one.value_or(drivers::MoveResult{});
  }
  double a1_deg() const { return cell->controller().actual_rad_at(cell->now())[0] / kDeg; }

  std::unique_ptr<VirtualEkiCell> cell;
  double at_fault_deg = 0.0;
};

TEST_P(AnEkiCell, StopsWhenTheContactSensorFallsSilent) {
  search();
  sim::McuFaults faults;
  faults.silent = true;
  cell->mcu().set_faults(faults, cell->now());
  const drivers::MoveResult stopped = result();
  EXPECT_EQ(stopped.outcome, MoveOutcome::kContactSilent) << stopped.detail;
  // 25 ms of heartbeat limit, up to 40 ms until the interrupt, the ramp: within 0.1 s.
  EXPECT_LT(a1_deg() - at_fault_deg, 0.05);
  EXPECT_TRUE(cell->controller().at_rest());
}

TEST_P(AnEkiCell, StopsWhenTheContactSensorRestarts) {
  search();
  cell->mcu().reset(cell->now());
  const drivers::MoveResult stopped = result();
  EXPECT_EQ(stopped.outcome, MoveOutcome::kContactSilent) << stopped.detail;
  EXPECT_LT(a1_deg() - at_fault_deg, 0.05);
}

TEST_P(AnEkiCell, IsStoppedByTheSensorsOutputWhereAWireAtTheGunBreaks) {
  search();
  sim::McuFaults faults;
  faults.circuit.sense_wire = sim::TouchCircuit::kOpen;
  cell->mcu().set_faults(faults, cell->now());
  // Sensor and controller both read contact; the next arming's self-test detects the fault.
  EXPECT_EQ(result().outcome, MoveOutcome::kContact);
  EXPECT_LT(a1_deg() - at_fault_deg, 0.06);
  cell->contact().arm(2, 30s);
  std::optional<drivers::ArmResult> armed;
  ASSERT_TRUE(until([&] { return (armed = cell->contact().poll_arm()).has_value(); }));
  EXPECT_FALSE(armed->armed);
}

TEST_P(AnEkiCell, StopsAtItsInputWhenAStandIsNoLongerEarthed) {
  search();
  sim::McuFaults faults;
  faults.circuit.earth_between = sim::TouchCircuit::kOpen;
  cell->mcu().set_faults(faults, cell->now());
  EXPECT_NE(result().outcome, MoveOutcome::kContact);
  EXPECT_LT(a1_deg() - at_fault_deg, 0.06);
}

using AnEkiCellWithAnInput = AnEkiCell;

TEST_P(AnEkiCellWithAnInput, IsStoppedWhereTheWireToItsInputIsCutAndOffMeansContact) {
  search();
  cell->controller().input_broken(true, cell->now());
  const drivers::MoveResult stopped = result();
  EXPECT_EQ(stopped.outcome, MoveOutcome::kContactSilent) << stopped.detail;
  EXPECT_NE(said(stopped.detail).find("sensor detected nothing"), std::string::npos)
      << stopped.detail;
  EXPECT_LT(a1_deg() - at_fault_deg, 0.06);
}

INSTANTIATE_TEST_SUITE_P(Stops, AnEkiCell,
                         ::testing::Values(drivers::EkiStop::kInput, drivers::EkiStop::kFlag),
                         [](const auto& one) {
                           return one.param == drivers::EkiStop::kInput ? "input" : "flag";
                         });

INSTANTIATE_TEST_SUITE_P(Stops, AnEkiCellWithAnInput, ::testing::Values(drivers::EkiStop::kInput));

}  // namespace
}  // namespace cellcal::daemon
