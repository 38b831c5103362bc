#pragma once
// As virtual_cell.h, with a controller that runs the EKI programs: the unchanged adapter's core,
// the emulated controller with the generated channel file, microcontroller and physical cell in one
// thread. The contact reaches the controller's input as well, as it is wired on a real cell.

#include "calib/identify/calibration.h"
#include "drivers/contact/contact_inline.h"
#include "drivers/kuka/eki_robot.h"
#include "drivers/time.h"
#include "sim/cell/contact_watch.h"
#include "sim/cell/truth.h"
#include "sim/krc/eki_controller.h"
#include "sim/mcu/mcu_line.h"

namespace cellcal::daemon {

struct VirtualEkiCellOptions {
  sim::TruthOptions truth;
  sim::EkiControllerConfig controller;
  sim::McuOptions mcu;
  drivers::EkiConfig eki;
  drivers::ContactOptions contact;
};

class VirtualEkiCell final : public drivers::Clock {
 public:
  VirtualEkiCell(const calib::Cell& cell, VirtualEkiCellOptions options);

  drivers::TimePoint now() const override { return now_; }
  void sleep_until(drivers::TimePoint t) override;

  drivers::Robot& robot() { return robot_; }
  drivers::ContactSensor& contact() { return contact_; }
  sim::EkiController& controller() { return controller_; }
  sim::Microcontroller& mcu() { return mcu_; }
  const sim::ContactWatch& watch() const { return watch_; }
  const sim::Truth& truth() const { return physical_.truth(); }
  /// Since power on.
  drivers::Duration elapsed() const { return now_ - kPowerOn; }

 private:
  /// Any fixed instant; late enough that nothing computes a time before the epoch.
  static constexpr drivers::TimePoint kPowerOn{std::chrono::hours(1)};

  void cycle();
  void exchange();

  drivers::TimePoint now_ = kPowerOn;
  drivers::TimePoint next_cycle_ = kPowerOn;
  sim::PhysicalCell physical_;
  sim::EkiController controller_;
  sim::Microcontroller mcu_;
  sim::McuLine line_;
  drivers::ContactInline contact_;
  drivers::EkiRobotInline robot_;
  sim::ContactWatch watch_;
};

}  // namespace cellcal::daemon
