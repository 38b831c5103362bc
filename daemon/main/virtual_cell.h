#pragma once
// The emulated cell in this process, in virtual time: the unchanged adapters' cores, the emulated
// controller, the emulated microcontroller and the physical cell in one thread. Time passes only in
// sleep_until(), so the same seed gives the same bits. Only daemon/main may know both sides.

#include <memory>
#include <string>

#include "calib/identify/calibration.h"
#include "drivers/contact/contact_inline.h"
#include "drivers/kuka/rsi_robot.h"
#include "drivers/time.h"
#include "sim/cell/contact_watch.h"
#include "sim/cell/truth.h"
#include "sim/krc/controller.h"
#include "sim/mcu/mcu_line.h"

namespace cellcal::daemon {

struct VirtualCellOptions {
  sim::TruthOptions truth;
  sim::ControllerConfig controller;
  sim::McuOptions mcu;
  drivers::RsiConfig rsi;
  drivers::ContactOptions contact;
};

class VirtualCell final : public drivers::Clock {
 public:
  VirtualCell(const calib::Cell& cell, VirtualCellOptions options);

  drivers::TimePoint now() const override { return now_; }
  void sleep_until(drivers::TimePoint t) override;

  drivers::Robot& robot() { return robot_; }
  drivers::ContactSensor& contact() { return contact_; }
  sim::Controller& controller() { return controller_; }
  sim::Microcontroller& mcu() { return mcu_; }
  const sim::ContactWatch& watch() const { return watch_; }
  const sim::Truth& truth() const { return physical_.truth(); }
  /// Since power on.
  drivers::Duration elapsed() const { return now_ - kPowerOn; }

 private:
  /// Any fixed instant; late enough that nothing computes a time before the epoch.
  static constexpr drivers::TimePoint kPowerOn{std::chrono::hours(1)};

  void cycle();

  drivers::TimePoint now_ = kPowerOn;
  drivers::TimePoint next_cycle_ = kPowerOn;
  sim::PhysicalCell physical_;
  sim::Controller controller_;
  sim::Microcontroller mcu_;
  sim::McuLine line_;
  drivers::ContactInline contact_;
  drivers::RsiRobotInline robot_;
  sim::ContactWatch watch_;
};

}  // namespace cellcal::daemon
