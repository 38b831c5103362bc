#pragma once
// Emulated cell with an RSI controller.

#include <string_view>

#include "daemon/backends/virtual_cell_on.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "sim/krc/controller.h"

namespace cellcal::daemon {

struct VirtualCellOptions {
  sim::TruthOptions truth;
  sim::ControllerConfig controller;
  sim::McuOptions mcu;
  drivers::RsiConfig rsi;
  drivers::ContactOptions contact;
  /// Busy computer: period of delayed sensor bytes. 0: never.
  drivers::Duration busy_every{0};
};

struct RsiWire {
  using Options = VirtualCellOptions;
  using Controller = sim::Controller;
  using Robot = drivers::RsiRobotInline;

  /// Controller to PC and back on a direct cable, plus processing time of the adapter: 50-100 us on idle
  /// machines.
  static constexpr drivers::Duration kNetworkTime = std::chrono::microseconds(80);

  static drivers::RsiConfig robot_config(Options options) { return std::move(options.rsi); }
  static void power_on(Controller& controller) { controller.rsi_on(); }
  /// The opto output's transistor conducts while the gun is free: the input is then on.
  static void edge(Controller& controller, drivers::TimePoint t, bool closed) {
    controller.input(t, !closed);
  }
  static std::string_view tick(Controller& controller, drivers::TimePoint t) {
    return controller.tick(t);
  }
  static void exchange(Controller& controller, Robot& robot, std::string_view packet,
                       drivers::TimePoint now);
};

using VirtualCell = VirtualCellOn<RsiWire>;

}  // namespace cellcal::daemon
