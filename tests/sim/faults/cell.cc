#include "cell.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/mcu/mcu_thread.h"

namespace cellcal::faults {
namespace {

// Polling period of the adapters' shells.
constexpr std::chrono::milliseconds kPcTick{2};
// Speed below which the arm is at rest: 0.3 mm/s at 1.4 m.
constexpr double kStillRadS = 0.012 * std::numbers::pi / 180.0;

sim::TruthOptions truth_options(std::uint64_t seed) {
  sim::TruthOptions truth;
  truth.seed = seed;
  return truth;
}

sim::McuOptions mcu_options(const CellOptions& options) {
  sim::McuOptions mcu;
  mcu.first_ticks = options.mcu_ticks;
  mcu.drift_ppm = options.mcu_drift_ppm;
  return options.wire == Wire::kEthernet ? sim::on_ethernet(mcu) : mcu;
}

drivers::ContactOptions contact_options(Wire wire) {
  drivers::ContactOptions contact;
  contact.datagrams = wire == Wire::kEthernet;
  if (contact.datagrams) contact.baud = sim::on_ethernet({}).baud;
  return contact;
}

sim::LineKind kind_of(Wire wire) {
  return wire == Wire::kEthernet ? sim::LineKind::kDatagrams : sim::LineKind::kFrames;
}

}  // namespace

const char* to_string(Wire wire) {
  switch (wire) {
    case Wire::kRsi: return "rsi";
    case Wire::kRsiInput: return "rsi-input";
    case Wire::kRsi6: return "rsi6";
    case Wire::kEkiInput: return "eki";
    case Wire::kEkiFlag: return "eki-flag";
    case Wire::kEthernet: return "ethernet";
    case Wire::kRsiTrack: return "rsi-track";
    case Wire::kEkiTrack: return "eki-track";
    case Wire::kRsiTable: return "rsi-table";
    case Wire::kEkiTable: return "eki-table";
  }
  return "?";
}

FaultyCell::FaultyCell(const calib::Cell& cell, const CellOptions& options)
    : options_(options),
      now_(options.power_on),
      next_cycle_(now_),
      next_pc_tick_(now_),
      physical_(sim::draw_truth(cell, truth_options(options.seed))),
      mcu_(mcu_options(options), now_),
      line_(mcu_),
      serial_(line_, options.seed * 7919 + 3, kind_of(options.wire)),
      watch_(physical_, [this](TimePoint t, bool closed) { level(t, closed); }),
      last_motion_(now_),
      krc_drift_ppm_(options.krc_drift_ppm) {}

void FaultyCell::new_adapters() {
  contact_ =
      std::make_unique<drivers::ContactInline>(contact_options(options_.wire), *this, serial_);
  make_robot();
  next_pc_tick_ = now_;
}

// ---- CELL.SRC and its PLC
// ------------------------------------------------------------------------------------------------

std::vector<double> off_by_a_brake_test(std::vector<double> at_rad) {
  at_rad.at(0) += 0.2 * std::numbers::pi / 180.0;
  return at_rad;
}

void FaultyCell::put_under_cell_src(sim::CellSrc::Programs programs) {
  cell_src_ = std::make_unique<sim::CellSrc>(std::move(programs), std::chrono::seconds(10));
  cell_src_->start();
}

void FaultyCell::run_cell_src(TimePoint t, bool listens) {
  if (!cell_src_) return;
  cell_src_->tick(t);
  if (!cell_src_->asks()) return;
  if (cell_src_->brake_test_requested()) {
    cell_src_->number(sim::CellSrc::kBrakeTest, t);
  } else if (listens) {
    cell_src_->number(sim::CellSrc::kCellcal, t);
  }
}

// ---- the touch circuit
// ---------------------------------------------------------------------------

void FaultyCell::level(TimePoint t, bool closed) {
  edges_.push_back({t, closed, true_rad_at(t)});
  if (shorted_) return;
  bool state = closed;
  for (int i = 0; i <= 2 * bounces_; ++i, state = !state) {
    const TimePoint seen = t + edges_late_ + i * bounce_apart_;
    mcu_.edge(seen, state);
    at(seen, [this, state] { input(state); });
  }
}

void FaultyCell::bounce(int count, Duration apart) {
  bounces_ = count;
  bounce_apart_ = apart;
}

void FaultyCell::chatter(int count, Duration pulse, Duration apart) {
  const bool level = watch_.closed() || shorted_;
  for (int i = 0; i < count; ++i) {
    const TimePoint begin = now_ + i * apart;
    mcu_.edge(begin, !level);
    at(begin, [this, level] { input(!level); });
    at(begin + pulse, [this] {  // back to the truth at that time
      mcu_.edge(now_, watch_.closed() || shorted_);
      input(watch_.closed() || shorted_);
    });
  }
}

void FaultyCell::short_circuit(bool on) {
  shorted_ = on;
  mcu_.edge(now_, on || watch_.closed());
  input(on || watch_.closed());
}

void FaultyCell::repair() {
  for (sim::Line* line : {&to_pc(), &to_krc(), &serial_.to_device(), &serial_.to_host()}) {
    line->mend();
  }
  actions_.clear();
  bounce(0, {});
  mcu_.set_faults({}, now_);
  short_circuit(false);
  repair_controller();
}

// ---- time
// ----------------------------------------------------------------------------------------

TimePoint FaultyCell::next_event() const {
  TimePoint t = std::min({next_cycle_, next_pc_tick_, next_message()});
  if (!actions_.empty()) t = std::min(t, actions_.begin()->first);
  return std::max(t, now_);
}

void FaultyCell::update_contact(TimePoint from, TimePoint to) {
  watch_.update(from, to, [this](TimePoint t) { return true_rad_at(t); });
  const std::vector<double> position = true_rad_at(to);
  if (!last_position_.empty()) {
    const double limit = kStillRadS * std::chrono::duration<double>(to - from).count();
    for (std::size_t i = 0; i < position.size(); ++i) {
      if (shaken_ || std::abs(position[i] - last_position_[i]) > limit) last_motion_ = to;
    }
  }
  last_position_ = position;
  shaken_ = false;
}

void FaultyCell::run_one(TimePoint t) {
  now_ = t;
  run_contact();
  if (!actions_.empty() && actions_.begin()->first <= t) {
    const auto act = std::move(actions_.begin()->second);
    actions_.erase(actions_.begin());
    act();
    return;
  }
  if (next_cycle_ <= t) {
    const TimePoint begin = next_cycle_;
    const double factor = 1.0 - 1e-6 * krc_drift_ppm_;
    next_cycle_ += std::chrono::duration_cast<Duration>(cycle() * factor);
    tick(begin);
    update_contact(begin, next_cycle_);
    return;
  }
  deliver_messages();
  if (next_pc_tick_ <= t) {
    next_pc_tick_ += kPcTick;
    pc_tick();
  }
}

void FaultyCell::sleep_until(TimePoint t) {
  if (t > end_by_) throw std::runtime_error("the session does not come to an end");
  while (next_event() <= t) run_one(next_event());
  now_ = std::max(now_, t);
  run_contact();
}

std::string CellBackend::utc_now() {
  const auto ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(cell_.now() - cell_.power_on()).count();
  return fmt::format("2000-01-01T{:02}:{:02}:{:02}.{:03}Z", ms / 3'600'000 % 24, ms / 60'000 % 60,
                     ms / 1000 % 60, ms % 1000);
}

}  // namespace cellcal::faults
