#include "daemon/main/virtual_eki_cell.h"

namespace cellcal::daemon {

namespace {

/// Controller to PC over a switch, TCP and the adapter's own time.
constexpr drivers::Duration kNetworkTime = std::chrono::microseconds(300);

}  // namespace

VirtualEkiCell::VirtualEkiCell(const calib::Cell& cell, VirtualEkiCellOptions options)
    : physical_(sim::draw_truth(cell, options.truth)),
      controller_(options.controller),
      mcu_(options.mcu, kPowerOn),
      line_(mcu_),
      contact_(options.contact, *this, line_),
      robot_(std::move(options.eki), &contact_.guard()),
      watch_(physical_, [this](drivers::TimePoint t, bool closed) {
        mcu_.edge(t, closed);
        controller_.input(t, closed);
      }) {
  controller_.start_program();
}

void VirtualEkiCell::exchange() {
  if (robot_.wants_close() && controller_.connected()) {
    controller_.disconnect();
    robot_.on_closed(now_);
  } else if (robot_.wants_connection() && controller_.connect()) {
    robot_.on_connected(now_);
  }
  robot_.on_bytes(controller_.take_output(), now_);
  robot_.on_tick(now_);
  controller_.receive(robot_.output());
  robot_.sent(robot_.output().size());
}

void VirtualEkiCell::cycle() {
  const drivers::TimePoint tick = next_cycle_;
  next_cycle_ += controller_.cycle();
  contact_.run_until(tick);
  now_ = tick;
  controller_.tick(tick);
  watch_.look(tick, next_cycle_,
              [this](drivers::TimePoint t) { return controller_.actual_rad_at(t); });
  now_ = tick + kNetworkTime;
  contact_.run_until(now_);
  exchange();
}

void VirtualEkiCell::sleep_until(drivers::TimePoint t) {
  while (next_cycle_ + kNetworkTime <= t) cycle();
  if (t > now_) {
    contact_.run_until(t);
    now_ = t;
  }
}

}  // namespace cellcal::daemon
