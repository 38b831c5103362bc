#pragma once
// The emulated cell with a faulty line on each interface: the unmodified adapters' cores, the
// emulated controller, microcontroller and physical cell, in one thread and in virtual time. Time
// passes only in sleep_until(); deterministic for a seed.
//
// In addition to daemon/main's virtual cells: messages arrive according to the lines, actions can
// be scheduled for an instant, the adapters can be recreated on the running cell, and the truth is
// recorded: the true position of the arm at each edge of the contact, and its last motion.

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/runner/backend.h"
#include "drivers/contact/serial_contact.h"
#include "sim/cell/physical_cell.h"
#include "sim/cell/truth.h"
#include "sim/mcu/mcu_line.h"
#include "tests/sim/faults/cell_src.h"
#include "tests/sim/faults/line.h"

namespace cellcal::faults {

using drivers::Duration;
using drivers::TimePoint;

/// Between cellcal's computer and the controller. ..Input: with a wire from the sensor; kRsi6: the controller
/// as configured by the generated files of RSI 6; kEthernet is RSI with the sensor on Ethernet; ..Track: the arm
/// on a linear unit that travels from touch to touch, and a further external axis; ..Table: the sphere on a
/// positioner that turns between the touches, and a further external axis.
enum class Wire {
  kRsi,
  kRsiInput,
  kRsi6,
  kEkiInput,
  kEkiFlag,
  kEthernet,
  kRsiTrack,
  kEkiTrack,
  kRsiTable,
  kEkiTable
};
inline constexpr std::array kWires{
    Wire::kRsi,      Wire::kRsiInput, Wire::kRsi6,     Wire::kEkiInput, Wire::kEkiFlag,
    Wire::kEthernet, Wire::kRsiTrack, Wire::kEkiTrack, Wire::kRsiTable, Wire::kEkiTable};
constexpr bool over_rsi(Wire wire) {
  return wire != Wire::kEkiInput && wire != Wire::kEkiFlag && wire != Wire::kEkiTrack &&
         wire != Wire::kEkiTable;
}
constexpr bool on_track(Wire wire) { return wire == Wire::kRsiTrack || wire == Wire::kEkiTrack; }
constexpr bool on_table(Wire wire) { return wire == Wire::kRsiTable || wire == Wire::kEkiTable; }
const char* to_string(Wire wire);

/// Options of a cell before power on.
struct CellOptions {
  Wire wire = Wire::kRsi;
  std::uint64_t seed = 1;
  std::uint64_t ipoc_start = 1'000'000;  ///< RSI's counter
  bool t1 = false;                       ///< RSI: mode selector; false: AUT
  int override_percent = 100;            ///< $OV_PRO
  /// The clock at power on. EKI's $TIMER counts its milliseconds, and has 31 bits.
  TimePoint power_on{std::chrono::hours(1)};
  std::uint32_t mcu_ticks = 0;  ///< of the microcontroller's clock at power on
  double mcu_drift_ppm = 0.0;
  double krc_drift_ppm = 0.0;  ///< the controller's clock relative to this computer's
  /// EXT: CELL.SRC calls cellcal's program, controlled by a PLC. false: started by an operator.
  bool cell_src = false;
};

/// True change of the touch circuit.
struct Edge {
  TimePoint t{};
  bool closed = false;
  std::vector<double> joint_rad;  ///< of the arm at that instant
};

class FaultyCell : public drivers::Clock {
 public:
  FaultyCell(const calib::Cell& cell, const CellOptions& options);

  TimePoint now() const override { return now_; }
  TimePoint power_on() const { return options_.power_on; }
  Wire wire() const { return options_.wire; }
  /// Throws std::runtime_error after the last instant allowed for a run.
  void sleep_until(TimePoint t) override;
  void live(Duration d) { sleep_until(now_ + d); }
  void end_by(TimePoint t) { end_by_ = t; }

  virtual drivers::Robot& robot() = 0;
  drivers::ContactSensor& contact() { return *contact_; }
  /// New adapters, as for a daemon's next session; the cell continues.
  void new_adapters();

  // ---- faults
  /// At t, or immediately if t has passed.
  void at(TimePoint t, std::function<void()> act) { actions_.emplace(t, std::move(act)); }
  virtual sim::Line& to_pc() = 0;   ///< controller to PC
  virtual sim::Line& to_krc() = 0;  ///< PC to controller
  sim::SerialLine& serial() { return serial_; }
  sim::Microcontroller& mcu() { return mcu_; }
  /// Each change of the circuit from now on: `count` bounces, `apart` from each other.
  void bounce(int count, Duration apart);
  /// Delays edges for sensor and input relative to the truth (tests of the judgement: not
  /// detectable by a driver).
  void delay_edges(Duration late) { edges_late_ = late; }
  /// The arm is moved independently of the adapter (likewise).
  void shake() { shaken_ = true; }
  /// Noise: pulses against the true level, from now on.
  void chatter(int count, Duration pulse, Duration apart);
  /// A short circuit: closed independently of the tip.
  void short_circuit(bool on);
  /// Relative rate of the controller's clock from now on.
  void krc_drift(double ppm) { krc_drift_ppm_ = ppm; }
  /// The controller is without power while true; the brakes close.
  virtual void power_off(bool off) = 0;
  virtual void block_drives(bool blocked) = 0;
  virtual void operator_stops() = 0;  ///< at the pendant
  virtual void robot_fault() = 0;     ///< the program ends with a message
  virtual void cancel_program() = 0;  ///< stopped and reset, as by a PLC
  /// A second machine on an exclusive port, from now on.
  virtual void second_on_port(bool on) = 0;
  virtual void input_wire(bool broken) = 0;
  virtual void input_stuck_on(bool) {
  }  ///< RSI: 24 V at the controller's input, independently of the sensor
  /// Moved by something else: the linear unit or the positioner, else an external axis of the
  /// controller that is neither.
  virtual void external_axis_moves(bool) {
    throw std::logic_error("a controller without external axes");
  }
  virtual void input_late(Duration) {}  ///< RSI: delay of the input
  /// Options::cell_src: the controller's own program.
  sim::CellSrc& cell_src() { return *cell_src_; }
  /// Restores all lines and devices, like an operator after a fault.
  void repair();

  // ---- truth
  const sim::PhysicalCell& physical() const { return physical_; }
  const std::vector<Edge>& edges() const { return edges_; }
  virtual std::vector<double> position_rad() const = 0;
  /// Commands of the adapter beyond the axes' limits, as text; empty: none.
  virtual std::string command_beyond() const { return {}; }
  TimePoint last_motion() const { return last_motion_; }
  double deepest_m() const { return watch_.deepest_m(); }
  int crashes() const { return watch_.crashes(); }

 protected:
  virtual std::vector<double> true_rad_at(TimePoint t) const = 0;
  virtual void tick(TimePoint t) = 0;  ///< one cycle of the controller
  virtual Duration cycle() const = 0;
  virtual void pc_tick() = 0;
  virtual TimePoint next_message() const = 0;
  virtual void deliver_messages() = 0;
  virtual void make_robot() = 0;
  virtual void repair_controller() = 0;
  virtual void input(bool closed) = 0;  ///< the controller's, at now

  void run_contact() { contact_->run_until(now_); }
  /// A brake test takes 10 s and leaves the arm a fifth of a degree off.
  void put_under_cell_src(sim::CellSrc::Programs programs);
  /// CELL, and the PLC that sends it numbers. `listens`: cellcal's program would reach this
  /// computer.
  void run_cell_src(TimePoint t, bool listens);

  const CellOptions options_;
  TimePoint now_;
  std::unique_ptr<drivers::ContactInline> contact_;
  std::unique_ptr<sim::CellSrc> cell_src_;

 private:
  void level(TimePoint t, bool closed);
  void update_contact(TimePoint from, TimePoint to);
  void run_one(TimePoint t);
  TimePoint next_event() const;

  TimePoint next_cycle_, next_pc_tick_;
  TimePoint end_by_ = TimePoint::max();
  sim::PhysicalCell physical_;
  sim::Microcontroller mcu_;
  sim::McuLine line_;
  sim::SerialLine serial_;
  sim::ContactWatch watch_;
  std::multimap<TimePoint, std::function<void()>> actions_;
  std::vector<Edge> edges_;
  std::vector<double> last_position_;
  TimePoint last_motion_;
  bool shorted_ = false;
  double krc_drift_ppm_;
  Duration edges_late_{};
  bool shaken_ = false;
  int bounces_ = 0;
  Duration bounce_apart_{};
};

/// Position of the arm after a brake test.
std::vector<double> off_by_a_brake_test(std::vector<double> at_rad);

/// As configured by the daemon's mock backend, with the demo's cell.
std::unique_ptr<FaultyCell> make_cell(const calib::Cell& cell, const CellOptions& options);

/// The cell as a session's backend.
class CellBackend final : public daemon::Backend {
 public:
  explicit CellBackend(FaultyCell& cell) : cell_(cell) {}
  drivers::Robot& robot() override { return cell_.robot(); }
  drivers::ContactSensor& contact() override { return cell_.contact(); }
  drivers::Clock& clock() override { return cell_; }
  bool virtual_time() const override { return true; }
  std::string utc_now() override;

 private:
  FaultyCell& cell_;
};

}  // namespace cellcal::faults
