#pragma once
// Emulated cell whose controller runs the EKI programs with the generated channel file. The sensor's output
// drives the controller's input, as wired on a real cell.

#include "daemon/backends/virtual_cell_on.h"
#include "drivers/kuka/eki/eki_robot.h"
#include "sim/krc/eki_controller.h"

namespace cellcal::daemon {

struct VirtualEkiCellOptions {
  sim::TruthOptions truth;
  sim::EkiControllerConfig controller;
  sim::McuOptions mcu;
  drivers::EkiConfig eki;
  drivers::ContactOptions contact;
  /// Busy computer: period of delayed sensor bytes. 0: never.
  drivers::Duration busy_every{0};
};

struct EkiWire {
  using Options = VirtualEkiCellOptions;
  using Controller = sim::EkiController;
  using Robot = drivers::EkiRobotInline;
  struct Nothing {};

  /// Controller to PC over a switch, TCP, plus processing time of the adapter.
  static constexpr drivers::Duration kNetworkTime = std::chrono::microseconds(300);

  static drivers::EkiConfig robot_config(Options options) { return std::move(options.eki); }
  static void power_on(Controller& controller) { controller.start_program(); }
  static void edge(Controller& controller, drivers::TimePoint t, bool closed) {
    controller.input(t, closed);
  }
  /// Its bytes are buffered in the controller.
  static Nothing tick(Controller& controller, drivers::TimePoint t) {
    controller.tick(t);
    return {};
  }
  static void exchange(Controller& controller, Robot& robot, Nothing, drivers::TimePoint now);
};

using VirtualEkiCell = VirtualCellOn<EkiWire>;

}  // namespace cellcal::daemon
