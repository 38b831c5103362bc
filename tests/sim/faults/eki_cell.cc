// The cell over EKI.

#include "cells.h"
#include "drivers/kuka/eki/eki_robot.h"
#include "drivers/kuka/krl/krl_files.h"
#include "sim/krc/cartesian_arm.h"
#include "sim/krc/eki_controller.h"

namespace cellcal::faults {
namespace {

// One way over a switch and TCP.
constexpr std::chrono::microseconds kSwitch{150};
// Between two connection attempts, as in the adapter's shell.
constexpr std::chrono::milliseconds kRetry{500};
// $OUT of $BRAKETEST_REQ_INT where CELL.SRC selects the programs.
constexpr int kBrakeTestOutput = 101;

// Position of an external axis; its speed when moved unasked (rad/s, m/s).
constexpr double kExternalRad = 0.4, kExternalRadS = 1.0, kCreepPerS = 0.05;

sim::EkiControllerConfig eki_controller(const daemon::DaemonConfig& config, const calib::Cell& cell,
                                        const CellOptions& options) {
  sim::EkiControllerConfig controller;
  controller.start_rad = config.mock.start_rad;
  controller.linear_unit = on_track(options.wire);
  if (controller.linear_unit) {
    controller.start_rad.insert(controller.start_rad.begin(), 0.0);
    controller.arm = sim::make_cartesian_arm(cell);
  }
  const std::size_t joints = cell.robot.joints.size();
  controller.start_rad.resize(joints, 0.0);
  // External axes that are not joints.
  const auto axes = 6 + static_cast<std::size_t>(config.controller.external_axes);
  controller.start_rad.resize(axes, kExternalRad);
  controller.max_acceleration_rad_s2 = config.motion.acceleration_rad_s2;
  drivers::EkiFilesConfig files = config.controller;
  if (options.cell_src) files.brake_test_output = kBrakeTestOutput;
  controller.files = drivers::eki_files(files);
  for (const calib::Joint& joint : cell.robot.joints) {
    controller.max_speed_rad_s.push_back(joint.max_speed_rad_s);
  }
  controller.max_speed_rad_s.resize(axes, kExternalRadS);
  controller.seed = options.seed;
  return controller;
}

class EkiCell final : public FaultyCell {
 public:
  EkiCell(const calib::Cell& cell, const CellOptions& options, const daemon::DaemonConfig& config)
      : FaultyCell(cell, options),
        eki_(daemon::eki_config_for(config, cell)),
        joints_(cell.robot.joints.size()),
        axes_(joints_ + cell.robot.positioner.size()),
        controller_(eki_controller(config, cell, options)),
        to_pc_(sim::LineKind::kStream, kSwitch, options.seed * 37 + 1),
        to_krc_(sim::LineKind::kStream, kSwitch, options.seed * 37 + 2) {
    controller_.set_override(options.override_percent);
    if (options.cell_src) {
      controller_.mode(drivers::OperatingMode::kExt);
      put_under_cell_src(
          {[this] { controller_.call_program(); }, [this] { return !controller_.program_runs(); },
           [] { return false; },
           [this](bool on) {
             controller_.request(on ? drivers::ControllerRequest::kBrakeTest
                                    : drivers::ControllerRequest::kNone);
           },
           [this] { controller_.place(off_by_a_brake_test(controller_.setpoint_rad())); }});
    } else {
      controller_.start_program();
    }
    new_adapters();
  }

  drivers::Robot& robot() override { return *robot_; }
  sim::Line& to_pc() override { return to_pc_; }
  sim::Line& to_krc() override { return to_krc_; }
  void block_drives(bool blocked) override { controller_.drives(!blocked); }
  void operator_stops() override { controller_.emergency_stop(true); }
  void robot_fault() override { controller_.cancel_program(); }
  void cancel_program() override { controller_.cancel_program(); }
  /// The drives' brakes stop the arm, the programs lose their state, the connection ends without
  /// notification.
  void power_off(bool off) override {
    if (off) controller_.drives(false);
    if (!off && off_) controller_.disconnect();
    off_ = off;
  }
  /// Another client: the controller's port accepts only one.
  void second_on_port(bool on) override {
    if (on) {
      other_holds_ = controller_.connect();
    } else if (other_holds_) {
      controller_.disconnect();
      other_holds_ = false;
    }
  }
  void external_axis_moves(bool moves) override {
    controller_.creep(on_track(options_.wire) ? 0 : joints_, moves ? kCreepPerS : 0.0);
  }
  void input_wire(bool broken) override { controller_.input_broken(broken, now_); }
  std::vector<double> position_rad() const override { return true_rad_at(now()); }

 protected:
  std::vector<double> true_rad_at(TimePoint t) const override {
    std::vector<double> all = controller_.actual_rad_at(t);
    all.resize(axes_);
    return all;
  }
  Duration cycle() const override { return controller_.cycle(); }
  void tick(TimePoint t) override {
    run_cell_src(t, true);
    controller_.tick(t);
    const std::string said = controller_.drain_output();
    if (!other_holds_ && !off_) to_pc_.send(said, t);
  }
  TimePoint next_message() const override { return std::min(to_pc_.next(), to_krc_.next()); }
  void deliver_messages() override {
    while (const auto bytes = to_pc_.take(now_)) {
      if (linked_) robot_->on_bytes(bytes->bytes, now_);
    }
    while (const auto bytes = to_krc_.take(now_)) {
      if (!off_ && !other_holds_) controller_.receive(bytes->bytes);
    }
  }
  bool cut() const { return to_pc_.is_cut(now_) || to_krc_.is_cut(now_); }
  void drop_link() {
    linked_ = false;
    to_pc_.restart();
    to_krc_.restart();
    robot_->on_closed(now_);
    next_try_ = now_ + kRetry;
  }
  void pc_tick() override {
    const bool torn = (to_pc_.ended() && now_ >= *to_pc_.ended()) ||
                      (to_krc_.ended() && now_ >= *to_krc_.ended());
    if (half_open_ && !cut()) {  // the disconnection of the client becomes known
      half_open_ = false;
      controller_.disconnect();
    }
    if (linked_ && robot_->wants_close()) {
      if (cut()) {
        half_open_ = true;
      } else {
        controller_.disconnect();
      }
      drop_link();
    } else if (linked_ && torn) {
      controller_.disconnect();
      drop_link();
    } else if (linked_ && !controller_.connected() && !cut() && !off_) {
      drop_link();  // closed by the controller
    } else if (!linked_ && robot_->wants_connection() && !cut() && !off_ && now_ >= next_try_) {
      next_try_ = now_ + kRetry;
      if (controller_.connect()) {
        linked_ = true;
        robot_->on_connected(now_);
      }
    }
    robot_->on_tick(now_);
    if (linked_) to_krc_.send(robot_->output(), now_);
    robot_->sent(robot_->output().size());
  }
  /// The process that held the connection has ended, and the connection with it.
  void make_robot() override {
    if (linked_) controller_.disconnect();
    linked_ = false;
    to_pc_.restart();
    to_krc_.restart();
    robot_ = std::make_unique<drivers::EkiRobotInline>(eki_, &contact_->guard());
    next_try_ = now_;
  }
  void input(bool closed) override { controller_.input(now_, closed); }

  void repair_controller() override {
    power_off(false);
    second_on_port(false);
    controller_.emergency_stop(false);
    controller_.drives(true);
    external_axis_moves(false);
    controller_.input_broken(false, now_);
    controller_.start_program();
  }

 private:
  drivers::EkiConfig eki_;
  std::size_t joints_, axes_;  ///< axes: with those of a positioner
  sim::EkiController controller_;
  sim::Line to_pc_, to_krc_;
  std::unique_ptr<drivers::EkiRobotInline> robot_;
  TimePoint next_try_{};
  bool linked_ = false, half_open_ = false, other_holds_ = false, off_ = false;
};

}  // namespace

std::unique_ptr<FaultyCell> make_eki_cell(const calib::Cell& cell, const CellOptions& options,
                                          const daemon::DaemonConfig& config) {
  return std::make_unique<EkiCell>(cell, options, config);
}

std::unique_ptr<FaultyCell> make_cell(const calib::Cell& cell, const CellOptions& options) {
  const bool rsi = over_rsi(options.wire);
  const char* input = options.wire == Wire::kRsiInput
                          ? "contact_tag = \"Contact.R\"\n[controller]\ncontact_level = \"off\"\n"
                          : "";
  const char* stop = options.wire == Wire::kEkiFlag ? "flag" : "input";
  const char* external = options.wire == Wire::kEkiInput ? "[controller]\nexternal_axes = 1\n"
                         : on_track(options.wire) || on_table(options.wire)
                             ? "[controller]\nexternal_axes = 2\n"
                             : "";
  const std::string text = std::string("format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n") +
                           "[motion]\nspeed_percent = 80\nacceleration_deg_s2 = 600\n"
                           "jerk_deg_s3 = 8000\ntravel_acceleration_mm_s2 = 4000\n"
                           "travel_jerk_mm_s3 = 60000\n"
                           "positioner_speed_deg_s = 80\npositioner_acceleration_deg_s2 = 200\n"
                           "positioner_jerk_deg_s3 = 2000\n" +
                           (rsi ? std::string("[rsi]\ncorrection_limit_deg = 360\n") +
                                      (on_table(options.wire) ? external : input)
                                : std::string("[eki]\nstop = \"") + stop + "\"\n" + external) +
                           "[mock]\nwire = \"" + (rsi ? "rsi" : "eki") + "\"\n";
  const daemon::DaemonConfig config = daemon::parse_config(text, "faults.toml");
  return rsi ? make_rsi_cell(cell, options, config) : make_eki_cell(cell, options, config);
}

}  // namespace cellcal::faults
