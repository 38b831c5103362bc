// The cell over RSI.

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "cells.h"
#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "sim/emulator/rsi_context.h"
#include "sim/krc/controller.h"

namespace cellcal::faults {
namespace {

// One way over a direct cable and through the adapter: half of what idle machines measure.
constexpr std::chrono::microseconds kCable{40};

/// As the controller loads what 'cellcal kuka-files' writes for it.
void load_rsi6(const daemon::DaemonConfig& config, const calib::Cell& cell,
               sim::ControllerConfig& controller) {
  drivers::RsiFilesConfig set = daemon::rsi_files_for(config, cell);
  set.rsi_version = 6;
  set.pc_address = "10.0.0.5";
  const drivers::ControllerFiles files = drivers::rsi_files(set);
  const char *const channel = "cellcal_rsi_ethernet.xml", *const context = "cellcal_rsi.rsix";
  controller.channel = sim::RsiChannelConfig::parse(files.at(channel));
  sim::take_context(drivers::read_rsi_context(files.at(context), context),
                    drivers::read_rsi_channel(files.at(channel), channel), controller);
}

sim::ControllerConfig rsi_controller(const daemon::DaemonConfig& config, const calib::Cell& cell,
                                     const CellOptions& options) {
  sim::ControllerConfig controller;
  controller.start_rad = config.mock.start_rad;
  controller.start_rad.resize(cell.robot.joints.size(), 0.0);
  controller.clamp_deg = controller.monitor_deg = config.rsi.correction_limit_deg.at(0);
  for (const calib::Joint& joint : cell.robot.joints) {
    controller.max_speed_rad_s.push_back(joint.max_speed_rad_s);
    controller.fence_min_rad.push_back(joint.min_rad);
    controller.fence_max_rad.push_back(joint.max_rad);
  }
  controller.contact_tag = config.rsi.contact_tag;
  controller.seed = options.seed;
  controller.ipoc_start = options.ipoc_start;
  if (options.wire == Wire::kRsi6) load_rsi6(config, cell, controller);
  return controller;
}

class RsiCell final : public FaultyCell {
 public:
  RsiCell(const calib::Cell& cell, const CellOptions& options, const daemon::DaemonConfig& config)
      : FaultyCell(cell, options),
        config_(config),
        rsi_(daemon::rsi_config_for(config, cell)),
        controller_(rsi_controller(config, cell, options)),
        to_pc_(sim::LineKind::kDatagrams, kCable, options.seed * 31 + 1),
        to_krc_(sim::LineKind::kDatagrams, kCable, options.seed * 31 + 2) {
    if (options.t1) controller_.mode(sim::OperatingMode::kT1);
    controller_.set_override(options.override_percent);
    mcu().on_output([this](TimePoint t, bool free) { output(t, free); });
    if (options.cell_src) {
      controller_.mode(sim::OperatingMode::kExt);
      put_under_cell_src(
          {[this] {
             listens_ = false;  // the PLC calls it once for each session
             controller_.rsi_on();
           },
           [this] { return controller_.phase() == sim::RsiPhase::kEnded; },
           [this] { return controller_.phase() == sim::RsiPhase::kFaulted; }, [](bool) {},
           [this] { controller_.place(off_by_a_brake_test(controller_.actual_rad_at(now()))); }});
    } else {
      controller_.rsi_on();
    }
    sim::ControllerConfig other = rsi_controller(config, cell, options);
    other.start_rad[0] += 0.5;
    other.ipoc_start = 77'000'123;
    other.timeout_cycles = std::numeric_limits<int>::max();  // it goes on without an answer
    second_ = std::make_unique<sim::Controller>(other);
    second_->rsi_on();
    new_adapters();
  }

  drivers::Robot& robot() override { return *robot_; }
  sim::Line& to_pc() override { return to_pc_; }
  sim::Line& to_krc() override { return to_krc_; }
  void block_drives(bool blocked) override { controller_.block_drives(blocked); }
  /// RSI goes on; the drives are off and the brakes closed.
  void operator_stops() override { block_drives(true); }
  void robot_fault() override { power_off(true); }
  void cancel_program() override { controller_.cancel_program(); }
  void power_off(bool off) override {
    off_ = off;
    block_drives(off);
  }
  void second_on_port(bool on) override { second_speaks_ = on; }
  void input_wire(bool broken) override {
    broken_ = broken;
    output(now(), free_);
  }
  void input_stuck_on(bool stuck) override {
    stuck_ = stuck;
    output(now(), free_);
  }
  void input_late(Duration late) override { late_ = late; }
  std::vector<double> position_rad() const override { return true_rad_at(now()); }
  std::string command_beyond() const override { return beyond_; }

 protected:
  std::vector<double> true_rad_at(TimePoint t) const override {
    return controller_.actual_rad_at(t);
  }
  Duration cycle() const override { return controller_.cycle(); }
  void tick(TimePoint t) override {
    run_cell_src(t, listens_);
    const std::string_view packet = controller_.tick(t);
    watch_command();
    if (!off_) to_pc_.send(packet, t);
    const std::string_view strange = second_->tick(t);
    if (second_speaks_) to_pc_.send(strange, t + std::chrono::milliseconds(1));
  }
  TimePoint next_message() const override { return std::min(to_pc_.next(), to_krc_.next()); }
  void take_messages() override {
    while (const auto packet = to_pc_.take(now_)) {
      to_krc_.send(robot_->on_datagram(packet->bytes, now_), now_);
    }
    while (const auto reply = to_krc_.take(now_)) {
      if (!off_) controller_.receive(reply->bytes);
      second_->receive(reply->bytes);
    }
  }
  void pc_tick() override { robot_->on_tick(now_); }
  void make_robot() override {
    robot_ = std::make_unique<drivers::RsiRobotInline>(rsi_, &contact_->guard());
    listens_ = true;
  }
  void input(bool) override {}  // by the sensor's output instead

  void repair_controller() override {
    const bool was_off = off_;
    power_off(false);
    late_ = {};
    stuck_ = broken_ = false;
    output(now(), free_);
    second_speaks_ = false;
    block_drives(false);
    // What rests on a message at the pendant is begun anew.
    if (was_off || controller_.phase() != sim::RsiPhase::kRunning) controller_.rsi_on();
  }

 private:
  void output(TimePoint t, bool free) {
    free_ = free;
    controller_.input(t + late_, stuck_ || (free && !broken_));
  }
  /// Speed in each cycle; and acceleration out of rest, since a packet that is lost stops the command
  /// for a cycle or two, whatever the adapter does.
  void watch_command() {
    const std::vector<double> at = controller_.setpoint_rad();
    const double cycle_s = std::chrono::duration<double>(cycle()).count();
    constexpr double kDeg = 57.29577951308232, kMargin = 1.02, kWireRad = 4e-8;
    constexpr int kRests = 5;
    rested_.resize(at.size());
    for (std::size_t i = 0; i < at.size() && !last_.empty(); ++i) {
      const double step = std::abs(at[i] - last_[i]), speed = step / cycle_s;
      const drivers::AxisLimit& limit = rsi_.limits[i];
      const bool too_fast = speed > kMargin * limit.max_speed_rad_s;
      const bool too_hard =
          rested_[i] >= kRests &&
          step > kMargin * limit.max_acceleration_rad_s2 * cycle_s * cycle_s + kWireRad;
      if ((too_fast || too_hard) && beyond_.empty())
        beyond_ = fmt::format("A{}: {:.1f} deg/s {}", i + 1, speed * kDeg,
                              too_fast ? "in one cycle" : "out of rest in one cycle");
      rested_[i] = step <= kWireRad ? rested_[i] + 1 : 0;
    }
    last_ = at;
  }

  std::vector<double> last_;
  std::vector<int> rested_;
  std::string beyond_;
  daemon::DaemonConfig config_;
  drivers::RsiConfig rsi_;
  sim::Controller controller_;
  std::unique_ptr<sim::Controller> second_;
  sim::Line to_pc_, to_krc_;
  std::unique_ptr<drivers::RsiRobotInline> robot_;
  Duration late_{};
  bool free_ = false, stuck_ = false,
       broken_ = false;  ///< the sensor's output, and its way to the input
  bool off_ = false;
  bool second_speaks_ = false;
  bool listens_ = false;
};

}  // namespace

std::unique_ptr<FaultyCell> make_rsi_cell(const calib::Cell& cell, const CellOptions& options,
                                          const daemon::DaemonConfig& config) {
  return std::make_unique<RsiCell>(cell, options, config);
}

}  // namespace cellcal::faults
