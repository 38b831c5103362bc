#include "daemon/main/virtual_cell.h"

namespace cellcal::daemon {

namespace {

/// Controller to PC and back on a direct cable, and the adapter's own time: what idle machines
/// measure (50-100 us).
constexpr drivers::Duration kPacketTime = std::chrono::microseconds(80);

}  // namespace

VirtualCell::VirtualCell(const calib::Cell& cell, VirtualCellOptions options)
    : physical_(sim::draw_truth(cell, options.truth)),
      controller_(options.controller),
      mcu_(options.mcu, kPowerOn),
      line_(mcu_),
      contact_(options.contact, *this, line_),
      robot_(std::move(options.rsi), &contact_.guard()),
      watch_(physical_, [this](drivers::TimePoint t, bool closed) { mcu_.edge(t, closed); }) {
  controller_.rsi_on();
}

void VirtualCell::cycle() {
  const drivers::TimePoint tick = next_cycle_;
  next_cycle_ += controller_.cycle();
  contact_.run_until(tick);
  now_ = tick;
  const std::string_view datagram = controller_.tick(tick);
  watch_.look(tick, next_cycle_,
              [this](drivers::TimePoint t) { return controller_.actual_rad_at(t); });
  now_ = tick + kPacketTime;
  contact_.run_until(now_);
  if (!datagram.empty())
    if (const std::string_view reply = robot_.on_datagram(datagram, now_); !reply.empty())
      controller_.receive(reply);
  robot_.on_tick(now_);
}

void VirtualCell::sleep_until(drivers::TimePoint t) {
  while (next_cycle_ + kPacketTime <= t) cycle();
  if (t > now_) {
    contact_.run_until(t);
    now_ = t;
  }
}

}  // namespace cellcal::daemon
