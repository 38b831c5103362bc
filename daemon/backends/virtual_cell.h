#pragma once
// Emulated cell with an RSI controller.

#include <chrono>
#include <string_view>
#include <utility>

#include "calib/result/calibration.h"
#include "drivers/contact/serial_contact.h"
#include "drivers/kuka/eki/eki_robot.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "drivers/robot.h"
#include "drivers/time.h"
#include "sim/cell/physical_cell.h"
#include "sim/cell/truth.h"
#include "sim/krc/controller.h"
#include "sim/krc/eki_controller.h"
#include "sim/mcu/mcu_line.h"

namespace cellcal::daemon {

// Emulated cell in this process, in virtual time: the unchanged core of the adapter, the emulated controller,
// the emulated microcontroller and the physical cell in one thread. Time passes only in sleep_until(), so the
// same seed gives the same bits. Only daemon/main depends on both sides.
//
// `Wire`: protocol between controller and adapter: RSI or EKI.

template <class Wire>
class VirtualCellOn final : public drivers::Clock {
 public:
  using Options = typename Wire::Options;

  VirtualCellOn(const calib::Cell& cell, Options options)
      : physical_(sim::draw_truth(cell, options.truth)),
        controller_(options.controller),
        mcu_(options.mcu, kPowerOn),
        line_(mcu_),
        late_line_(line_),
        contact_(options.contact, *this, late_line_),
        busy_every_(options.busy_every),
        robot_(Wire::robot_config(std::move(options)), &contact_.guard()),
        watch_(physical_, [this](drivers::TimePoint t, bool closed) { mcu_.edge(t, closed); }) {
    mcu_.on_output([this](drivers::TimePoint t, bool free) { Wire::edge(controller_, t, !free); });
    late_line_.stall(kPowerOn, busy_every_, kBusySpell);
    Wire::power_on(controller_);
  }

  drivers::TimePoint now() const override { return now_; }
  void sleep_until(drivers::TimePoint t) override {
    while (next_cycle_ + Wire::kNetworkTime <= t) cycle();
    if (t > now_) {
      contact_.run_until(t);
      now_ = t;
    }
  }

  drivers::Robot& robot() { return robot_; }
  drivers::ContactSensor& contact() { return contact_; }
  typename Wire::Controller& controller() { return controller_; }
  sim::Microcontroller& mcu() { return mcu_; }
  const sim::ContactWatch& watch() const { return watch_; }
  const sim::Truth& truth() const { return physical_.truth(); }
  /// Time since power on.
  drivers::Duration elapsed() const { return now_ - kPowerOn; }

 private:
  /// A fixed instant, late enough that no time before the epoch is computed.
  static constexpr drivers::TimePoint kPowerOn{std::chrono::hours(1)};

  /// Twice the delay that stops a search.
  static constexpr std::chrono::milliseconds kBusySpell{60};

  void cycle() {
    const drivers::TimePoint tick = next_cycle_;
    next_cycle_ += controller_.cycle();
    contact_.run_until(tick);
    now_ = tick;
    const auto packet = Wire::tick(controller_, tick);
    watch_.update(tick, next_cycle_,
                  [this](drivers::TimePoint t) { return controller_.actual_rad_at(t); });
    now_ = tick + Wire::kNetworkTime;
    contact_.run_until(now_);
    Wire::exchange(controller_, robot_, packet, now_);
  }

  drivers::TimePoint now_ = kPowerOn;
  drivers::TimePoint next_cycle_ = kPowerOn;
  sim::PhysicalCell physical_;
  typename Wire::Controller controller_;
  sim::Microcontroller mcu_;
  sim::McuLine line_;
  sim::LateLine late_line_;
  drivers::ContactInline contact_;
  drivers::Duration busy_every_;
  typename Wire::Robot robot_;
  sim::ContactWatch watch_;
};

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
                       drivers::TimePoint now) {
    if (!packet.empty()) {
      const std::string_view reply = robot.on_datagram(packet, now);
      if (!reply.empty()) controller.receive(reply);
    }
    robot.on_tick(now);
  }
};

using VirtualCell = VirtualCellOn<RsiWire>;

// Emulated cell whose controller runs the EKI programs with the generated channel file. The sensor's output
// drives the controller's input, as wired on a real cell.

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
  static void exchange(Controller& controller, Robot& robot, Nothing, drivers::TimePoint now) {
    if (robot.wants_close() && controller.connected()) {
      controller.disconnect();
      robot.on_closed(now);
    } else if (robot.wants_connection() && controller.connect()) {
      robot.on_connected(now);
    }
    robot.on_bytes(controller.drain_output(), now);
    robot.on_tick(now);
    controller.receive(robot.output());
    robot.sent(robot.output().size());
  }
};

using VirtualEkiCell = VirtualCellOn<EkiWire>;

}  // namespace cellcal::daemon
